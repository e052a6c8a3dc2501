//! Running a component on another host: what the launcher asks of the agent there, and what the agent
//! reports, on one connection for each component. Beats go in both directions; the end of the
//! connection is a host that is cut off, not the end of the component.

use crate::Message;

/// The port of the registry in an address `HOST:0` of another host: the gate there knows it, and it
/// stays valid when the system is started again on another port.
pub const REGISTRY_PORT: u16 = 0;

/// Longest executable that is sent to another host, in bytes: builds with debug information have some
/// hundred MiB.
pub const MAX_EXECUTABLE_LEN: u64 = 1 << 30;

/// A component to be run.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct RemoteStart {
    /// The system that it belongs to.
    pub system: String,
    /// The start of that system. What an earlier one has left behind is ended, unless it is adopted.
    pub run: u64,
    /// The component.
    pub component: String,
    /// Its kind.
    pub kind: String,
    /// All components that this start of the system has on the agent's host: what others of the system
    /// an earlier start has left there is ended.
    pub components: Vec<String>,
    /// Hash of the manifest of that kind where the system was checked, as JSON.
    pub manifest: u64,
    /// The SHA-256 of its executable where the system was checked, in hexadecimal digits; for a kind
    /// that is part of `armor`, that of `armor`. Empty if it cannot be read.
    pub build: String,
    /// The length of that executable, if the launcher can send it; 0 for a kind that is part of
    /// `armor`.
    pub executable_len: u64,
    /// Names of the agent's variables that it gets, besides the usual ones.
    pub variables: Vec<String>,
    /// Further variables.
    pub settings: Vec<VariableSetting>,
    /// What it may use of the host.
    pub resources: ProcessResources,
    /// What happens to it while the agent is cut off from the launcher.
    pub cut_off: CutOff,
    /// Whether an executive activates and freezes it.
    pub is_commanded: bool,
    /// Where the gates of the other hosts are.
    pub hosts: Vec<HostAddress>,
    /// The port of the gate of the launcher's own host.
    pub gate_port: u16,
    /// Whether a process that runs already is taken over.
    pub takeover: Takeover,
}

/// One environment variable.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct VariableSetting {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
}

/// What a process may use of its host; what is not given is not limited.
#[derive(Clone, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct ProcessResources {
    /// Its niceness.
    pub nice: Option<i32>,
    /// Its priority in real time.
    pub realtime: Option<u8>,
    /// The processors on which it may run; all if there are none.
    pub cpus: Vec<u32>,
    /// The processor time of all its processes together, in thousandths of one processor.
    pub cpu_permille: Option<u32>,
    /// The bytes that each of its processes may allocate.
    pub memory: Option<u64>,
}

/// Where the gate of a host is.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Message)]
#[message(wire = "armor_wire")]
pub struct HostAddress {
    /// The host's name in the file, and in its key.
    pub host: String,
    /// Each `address:port`, to be tried in turn; the address may be a name. Or [`crate::gate::ANNOUNCED`].
    pub addresses: Vec<String>,
}

/// What happens to the components of a host that is cut off from the launcher's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum CutOff {
    /// They continue; actuators come to rest by their own timeouts, since no command arrives.
    #[default]
    Continue,
    /// They are ended, and started again when the connection is back.
    Stop,
    /// They are frozen. When the connection is back, the executive commands them again; those that none
    /// commands are activated again.
    Safe,
}

impl CutOff {
    /// All of them, as the file spells them.
    pub const ALL: [(&str, Self); 3] =
        [("continue", Self::Continue), ("stop", Self::Stop), ("safe", Self::Safe)];
}

/// Whether a process that runs already is taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Takeover {
    /// No: it is killed first.
    Never,
    /// A process of any earlier run: the launcher itself was restarted.
    Any,
    /// This one only, after a cut. If it has ended, its end is reported.
    Only {
        /// Its number, from [`RemoteEvent::Running`].
        process: u64,
    },
    /// Nothing is started or taken over: all that earlier runs of the system have left is ended.
    /// [`RemoteEvent::Ended`] follows.
    End,
}

/// From the launcher, on a connection whose component runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum RemoteOrder {
    /// Ask the process to end.
    Terminate,
    /// Kill it with all that it has started.
    Kill,
    /// Answer with the time of the host.
    Clock {
        /// When this was asked, in microseconds since 1970 by the launcher's clock.
        asked_us: u64,
    },
}

/// From the agent.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum RemoteEvent {
    /// The process runs.
    Running {
        /// Its number at this agent.
        process: u64,
        /// Its process id on that host.
        pid: u32,
        /// It ran before this connection.
        is_taken_over: bool,
        /// What a person should know, such as that it is another build; may be empty.
        notice: String,
    },
    /// A piece of its output; lines may be split.
    Output {
        /// Which stream.
        stream: OutputStream,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// Output of the time in which the agent was cut off that is only in the agent's log.
    Missed {
        /// How many bytes.
        bytes: u64,
        /// The file in which it is.
        file: String,
    },
    /// The time of the agent's host.
    Clock {
        /// As in the question.
        asked_us: u64,
        /// In microseconds since 1970 by the agent's clock.
        answered_us: u64,
    },
    /// The process has ended. The connection ends, too.
    Ended {
        /// How.
        end: ProcessEnd,
    },
}

/// Where a process writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum OutputStream {
    /// Standard output.
    Out,
    /// Standard error.
    Error,
}

/// How a process has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum ProcessEnd {
    /// By itself.
    Code {
        /// Its exit code.
        code: i32,
    },
    /// By a signal.
    Signal {
        /// Its number.
        signal: i32,
    },
    /// It could not be started.
    NotStarted {
        /// The operating system's error.
        error: i32,
    },
    /// The agent has ended it while it was cut off from the launcher, as the file specifies.
    CutOff,
}
