//! Events and actions of the supervisor.

use std::fmt;
use std::time::Duration;

use armor_robotfile::model::Restart;
use armor_wire::control::RunState;
use armor_wire::liveness::SILENCE;

/// A process by its place in the list of duties.
pub type ChildId = usize;

/// What a process is for; in the order of starting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChildRole {
    /// Name to endpoint. Everybody needs it to find the others.
    Registry,
    /// Settings and parameters.
    Configd,
    /// One task of the robot.
    Component,
    /// Lets people on other hosts take part. The system runs without it.
    Gate,
    /// Plays the mission. Its own end is the end of the run.
    Executive,
}

/// A process to be kept running.
#[derive(Clone, Debug)]
pub struct Duty {
    /// Name in the system.
    pub name: String,
    /// What it is for.
    pub role: ChildRole,
    /// What happens when a component ends by itself; daemons are always restarted.
    pub restart: Restart,
    /// How long one call of a component's code may take.
    pub watchdog: Option<Duration>,
    /// The kind of a component in the file.
    pub kind: Option<String>,
    /// Whether the run is over when it ends by itself: it plays what the system is run for.
    pub ends_run: bool,
    /// The other host on which it runs, if it does not run on this one.
    pub host: Option<String>,
}

impl Duty {
    /// How long a component may be silent. On another host three times as long: a cut is noticed within
    /// less, and then silence proves nothing.
    pub fn silence(&self) -> Duration {
        if self.host.is_some() { 3 * SILENCE } else { SILENCE }
    }
}

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildExit {
    /// By itself.
    Code(i32),
    /// By a signal.
    Signal(i32),
    /// It never began: the operating system's error for its executable.
    NotStarted(i32),
    /// The agent of its host has ended it while that was cut off.
    CutOff,
    /// The agent of its host has died, and so has the process, or it cannot be asked.
    WithAgent,
}

/// Why a process that runs must be killed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HangCause {
    /// One call of the component's code has taken longer than its watchdog allows.
    LongCall {
        /// How long it had taken.
        call: Duration,
        /// How long it may take.
        watchdog: Duration,
    },
    /// A signal or a debugger has stopped it.
    Suspended,
    /// It has not registered within this time.
    NotReady(Duration),
    /// It has registered, and has not sent its first beat within this time.
    NoFirstBeat(Duration),
    /// It has sent no beat for this time.
    Silent(Duration),
    /// It is missing at the registry, or is the registry and does not answer, for this time.
    Missing(Duration),
}

/// Why the run should stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopRequest {
    /// Ctrl-C or a signal to end. The second one kills.
    Interrupt,
    /// `armor stop --all`.
    Ordered,
    /// `--for` is over.
    TimeUp,
}

/// An event.
#[derive(Clone, Debug, PartialEq)]
pub enum SupervisorEvent {
    /// Time passed. The first one starts the system.
    Tick,
    /// A process could not be started.
    SpawnFailed(ChildId, String),
    /// The process is in the registry; the registry itself: it answers.
    Ready(ChildId),
    /// A component's control port sent an answer: its state, if it was one.
    Heard(ChildId, Option<RunState>),
    /// The launcher cannot connect to a component for want of descriptors of its own.
    Unheard(ChildId),
    /// One call of the component's code has taken this long, longer than it may.
    Stuck(ChildId, Duration),
    /// The registry lost a process of which no end is known; the registry itself: it is silent.
    Vanished(ChildId),
    /// A signal or a debugger has stopped a process that is missing or overdue: it cannot come back
    /// by itself.
    Suspended(ChildId),
    /// The process that is about to end has printed this panic.
    Panicked(ChildId, String),
    /// The process ended.
    Exited(ChildId, ChildExit),
    /// The run is to stop.
    Stop(StopRequest),
    /// An operator orders one component.
    Order(ChildId, ChildOrder),
}

/// What an operator orders for one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildOrder {
    /// End it, if it runs, and start it again; its record of deaths is cleared.
    Restart,
    /// End it; it stays down until it is restarted.
    Stop,
}

/// An action.
#[derive(Clone, Debug, PartialEq)]
pub enum SupervisorAction {
    /// Start the process.
    Spawn(ChildId),
    /// Ask the process to end.
    Terminate(ChildId),
    /// Kill the process and its group.
    Kill(ChildId),
    /// Report to the executive that the component was given up, and why.
    ReportGivenUp(ChildId, String),
    /// Log a message about the process.
    Log(LogLevel, ChildId, String),
    /// All processes have ended; the run is over.
    End(RunVerdict),
}

/// Severity of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Something failed for good.
    Error,
    /// Something failed and is being repaired.
    Warn,
    /// A life event.
    Info,
}

/// The result of the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunVerdict {
    /// The mission reached its goal.
    Goal,
    /// The mission ended in its safe place.
    Safe,
    /// The mission failed.
    Failed,
    /// Interrupted.
    Interrupted,
    /// An operator has stopped it.
    Stopped {
        /// Whether its mission was not over.
        is_unfinished: bool,
        /// Components that failed for good.
        failed: Vec<String>,
    },
    /// The time it was to run is over.
    TimeUp {
        /// Components that failed for good.
        failed: Vec<String>,
    },
    /// Without a mission: every component has ended.
    AllEnded {
        /// Components that failed for good.
        failed: Vec<String>,
    },
    /// The recording that was played is over.
    RecordingOver {
        /// Whether a mission was not over.
        is_unfinished: bool,
        /// Components that failed for good.
        failed: Vec<String>,
    },
    /// A process that the system needs failed for good.
    Essential(String),
}

impl HangCause {
    /// Returns what is logged when the process is killed.
    pub fn describe_kill(self) -> String {
        match self {
            Self::LongCall { call, watchdog } => format!(
                "one call has taken {:.1} s, longer than its watchdog of {} s allows: killed",
                call.as_secs_f64(),
                watchdog.as_secs_f64()
            ),
            _ => format!("{}: suspected of hanging and killed", self.describe_state()),
        }
    }

    /// Returns how its process ended, in words that follow its name.
    pub fn describe_end(self) -> String {
        match self {
            Self::LongCall { .. } => {
                format!("was killed by its watchdog ({})", self.describe_state())
            }
            Self::Suspended => format!("was killed while {}", self.describe_state()),
            _ => format!("was killed as hanging ({})", self.describe_state()),
        }
    }

    fn describe_state(self) -> String {
        match self {
            Self::LongCall { call, watchdog } => {
                let (call_s, limit_s) = (call.as_secs_f64(), watchdog.as_secs_f64());
                format!("one call took {call_s:.1} s, longer than {limit_s} s")
            }
            Self::Suspended => "stopped (SIGSTOP or a debugger)".into(),
            Self::NotReady(within) => format!("not ready after {} s", within.as_secs()),
            Self::NoFirstBeat(within) => format!("no answer within {} s", within.as_secs()),
            Self::Silent(time) => format!("silent for {} s", time.as_secs_f64()),
            Self::Missing(time) => format!("no answer for {} s", time.as_secs()),
        }
    }
}

impl fmt::Display for ChildExit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let signal = match self {
            Self::Code(0) => return f.write_str("ended"),
            Self::Code(code) => return write!(f, "ended with code {code}"),
            Self::Signal(signal) => signal,
            Self::CutOff => return f.write_str("ended while its host was cut off"),
            Self::WithAgent => return f.write_str("ended with the agent of its host"),
            Self::NotStarted(error) => {
                let error = std::io::Error::from_raw_os_error(*error);
                return write!(f, "cannot be started: {error}");
            }
        };
        let names = [(4, "ILL"), (6, "ABRT"), (9, "KILL"), (11, "SEGV"), (15, "TERM")];
        match names.iter().find(|(number, _)| number == signal) {
            Some((_, name)) => write!(f, "ended by signal {signal} (SIG{name})"),
            None => write!(f, "ended by signal {signal}"),
        }
    }
}
