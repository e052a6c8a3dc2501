//! The messages of a control connection to a component: the executive's commands, the component's
//! reports, the questions of observers, and an operator's orders to the executive.

mod order;
mod playback_order;

use std::fmt;

use serde::Serialize;

use crate::Message;
use crate::config::Assigned;
use crate::keep::Keep;

pub use order::{MAX_AUTHOR_LEN, MAX_MOVES, MAX_ORDER_NAME_LEN, Order, OrderFault, TokenMove};
pub use playback_order::PlaybackOrder;

/// The role in which a control connection is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Role {
    /// Activates and freezes; gets reports. The one that connected last is the executive.
    Executive,
    /// Watches beats and may end the process.
    Launcher,
    /// Reads the component's status.
    Observer,
    /// Commands the mission: gives orders to the executive.
    Operator,
}

/// The state of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message, Serialize)]
#[message(wire = "armor_wire")]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// It waits for its settings and parameters.
    Starting,
    /// It gets no calls.
    Frozen,
    /// It runs.
    Active,
    /// It has reported that it is done; it gets no calls until it is activated again.
    Done,
    /// It has reported a failure; it gets no calls until it is activated again.
    Failed,
}

/// To a component.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum Command {
    /// Run. Confirmed by `State`.
    Activate {
        /// Counts the executive's activations; reports carry it.
        activation: u64,
        /// The values that the mission gives its parameters for this activation.
        parameters: Vec<GivenParameter>,
    },
    /// Come to rest and stop. Confirmed by `State`, after the last call.
    Freeze {
        /// The activation that ends.
        activation: u64,
    },
    /// Come to rest and end the process.
    Terminate,
    /// "How are you?" Answered by `Status`.
    Status {
        /// Names the answer.
        request: u64,
    },
    /// "I have that report."
    Acknowledge {
        /// The report's number.
        report: u64,
    },
    /// "I am alive."
    Beat,
    /// From an operator to the executive. Answered by `Ordered`.
    Order {
        /// Identifies the order, also when it is sent again on another connection: a random number
        /// other than 0. A repeated order gets the answer of the first one.
        request: u64,
        /// The person who gives it, such as `ruth@station`.
        author: String,
        /// Whether to take the command over from its holder.
        take: bool,
        /// The order.
        order: Order,
    },
    /// Changes what the process logs, until it ends. Answered by `Ordered`.
    SetLogFilter {
        /// Names the answer.
        request: u64,
        /// A level (`debug`), or levels by module (`my_crate=debug,info`).
        filter: String,
    },
    /// To the process that plays a recording. Answered by `Ordered`.
    Playback {
        /// Names the answer.
        request: u64,
        /// The order.
        order: PlaybackOrder,
    },
}

/// A parameter's value for the duration of an activation; it has priority over configd's.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct GivenParameter {
    /// The parameter.
    pub name: String,
    /// Its value, as the file writes it.
    pub assigned: Assigned,
}

/// From a component.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum Answer {
    /// Its state; sent first, and at every change.
    State {
        /// The state.
        state: RunState,
        /// The activation it belongs to.
        activation: u64,
        /// Whether it can be activated and frozen.
        controllable: bool,
    },
    /// A report of user code. Sent again until acknowledged.
    Report {
        /// Counts the reports of this process start, from 1.
        report: u64,
        /// The activation it belongs to.
        activation: u64,
        /// The report.
        outcome: ReportKind,
    },
    /// Its status.
    Status {
        /// The request.
        request: u64,
        /// The answer.
        status: Status,
    },
    /// "I am alive."
    Beat {
        /// The call of user code that runs now.
        call: Option<CurrentCall>,
    },
    /// The result of an order, or of a change of the log's filter.
    Ordered {
        /// The order. 0: not the answer to an order; the operator's command was taken over.
        request: u64,
        /// Whether it is carried out.
        accepted: bool,
        /// The consequence, or why it is refused.
        text: String,
    },
}

/// A call of user code that has not returned.
#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
pub struct CurrentCall {
    /// The function: `new`, `exec`, `data_received` or `parameter_received`.
    pub function: String,
    /// How long the call has taken so far, in seconds.
    pub call_s: f64,
}

/// A component's report to the executive.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub enum ReportKind {
    /// The task is over.
    Done,
    /// It cannot be done.
    Failed {
        /// Why.
        reason: String,
    },
    /// Something happened.
    Event {
        /// Its name.
        name: String,
        /// Its value.
        value: f64,
    },
}

/// The status of a component, as `armor ps`, `graph` and the designer show it.
#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
pub struct Status {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Its state.
    pub state: RunState,
    /// The activation it belongs to.
    pub activation: u64,
    /// Whether it can be activated and frozen.
    pub controllable: bool,
    /// Seconds since its start.
    pub uptime_s: f64,
    /// Calls of `exec` so far.
    pub exec_calls: u64,
    /// Ticks at which `exec` was not called, because earlier calls took too long.
    pub skipped_ticks: u64,
    /// The share of such ticks in the last ten seconds, 0 to 1; one slow call alone does not count.
    pub skipped_share: f64,
    /// System time minus this host's wall clock, in seconds.
    pub clock_offset_s: f64,
    /// Half the round trip the offset was measured with, in seconds: its error is at most that.
    pub clock_error_s: Option<f64>,
    /// Its last error, in words; empty if there was none.
    pub last_error: String,
    /// Events that no executive has taken for a second, and reports that were dropped because none did.
    pub untaken_events: u64,
    /// The call of user code that runs now.
    pub call: Option<CurrentCall>,
    /// System time as it knows it, in seconds.
    pub time_s: f64,
    /// Whether it has something to finish: a call, or a report that the executive has not taken; the
    /// executive: an event, or a firing.
    pub busy: bool,
    /// Its outputs.
    pub outputs: Vec<OutputStatus>,
    /// Its inputs.
    pub inputs: Vec<InputStatus>,
}

/// An output and its links.
#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
pub struct OutputStatus {
    /// Local name.
    pub id: String,
    /// Unique name.
    pub data: String,
    /// Name of its type.
    pub type_name: String,
    /// Number of data published.
    pub published: u64,
    /// Their bytes, each message once whatever its number of links. A message that has no link is not
    /// always encoded, and then not counted.
    pub published_bytes: u64,
    /// Its links.
    pub links: Vec<LinkStatus>,
}

/// One link, seen from its provider.
#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
pub struct LinkStatus {
    /// The subscriber.
    pub to: String,
    /// Which data it gets when it is slow; sent as the text that the file has for it.
    #[message(text)]
    pub keep: Keep,
    /// Data given to the network.
    pub sent: u64,
    /// Data dropped here because the subscriber was slow.
    pub dropped: u64,
    /// Data waiting now.
    pub queued: u64,
    /// Whether the subscriber asked for a pause.
    pub paused: bool,
    /// What carries the data: `shm`, `unix` or `tcp`.
    pub transport: String,
}

/// An input.
#[derive(Clone, Debug, PartialEq, Message, Serialize)]
#[message(wire = "armor_wire")]
pub struct InputStatus {
    /// Local name.
    pub id: String,
    /// Unique name of the data that feeds it; empty if none does.
    pub data: String,
    /// Whether the link is up.
    pub connected: bool,
    /// Data handed to the component.
    pub received: u64,
    /// Data that have arrived and wait for the component.
    pub waiting: u64,
    /// Data lost before this process, seen as gaps.
    pub lost: u64,
    /// Data dropped in this process because the component was busy.
    pub dropped: u64,
    /// Data published between two pulls, which no pull has asked for.
    pub skipped: u64,
    /// Messages of its history that were dropped before their time, because all were too long
    /// together.
    pub history_dropped: u64,
    /// Number of times the link came up.
    pub connections: u64,
    /// Why the link is down, in words; empty if it is up.
    pub problem: String,
}

impl fmt::Display for RunState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Starting => "starting",
            Self::Frozen => "frozen",
            Self::Active => "active",
            Self::Done => "done",
            Self::Failed => "failed",
        })
    }
}
