//! One process of a running system, and what it is doing as far as it can be told from outside.

use std::time::Duration;

use armor_sdk::control::{RunState, Status};
use armor_wire::registry::ComponentEntry;

/// What a process is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// It is registered and has not said yet.
    Unknown,
    /// It waits for its settings and parameters.
    Starting,
    /// It gets no calls.
    Frozen,
    /// It runs.
    Active,
    /// It has reported that its task is over.
    Done,
    /// It has reported a failure.
    Failed,
    /// It is registered and has been silent for three beats.
    Suspected,
    /// It has gone, and may be started again.
    Restarting,
    /// It has gone, and nothing has come in its place for long.
    Dead,
}

impl Condition {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Unknown,
        Self::Starting,
        Self::Frozen,
        Self::Active,
        Self::Done,
        Self::Failed,
        Self::Suspected,
        Self::Restarting,
        Self::Dead,
    ];

    /// In one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Starting => "starting",
            Self::Frozen => "frozen",
            Self::Active => "active",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Suspected => "suspected",
            Self::Restarting => "restarting",
            Self::Dead => "dead",
        }
    }

    /// Whether its process has gone.
    pub fn is_gone(self) -> bool {
        matches!(self, Self::Restarting | Self::Dead)
    }
}

impl From<RunState> for Condition {
    fn from(state: RunState) -> Self {
        match state {
            RunState::Starting => Self::Starting,
            RunState::Frozen => Self::Frozen,
            RunState::Active => Self::Active,
            RunState::Done => Self::Done,
            RunState::Failed => Self::Failed,
        }
    }
}

/// A process of the system.
#[derive(Clone, Debug, PartialEq)]
pub struct Process {
    /// What the registry knows of it.
    pub entry: ComponentEntry,
    /// What it is doing.
    pub condition: Condition,
    /// Since when, after the beginning of the watch.
    pub since: Duration,
    /// How long the running call of user code has taken, in seconds, if it is a long one.
    pub call_s: Option<f64>,
    /// What it said of itself last.
    pub status: Option<Status>,
    /// Why nothing is heard of it; empty if something is.
    pub problem: String,
    /// How many of its starts have been seen.
    pub starts: u32,
    pub(super) before: Option<Status>,
    pub(super) connection: Connection,
}

/// The control connection to a process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Connection {
    /// Being made.
    Pending,
    Up,
    /// To be made again then.
    Down {
        retry: Duration,
    },
    /// The process has none, or has gone.
    Never,
}

impl Process {
    /// Whether that is new.
    pub(super) fn is(&mut self, condition: Condition, now: Duration) -> bool {
        let is_new = self.condition != condition;
        if is_new {
            (self.condition, self.since) = (condition, now);
        }
        is_new
    }

    pub(super) fn go(&mut self, now: Duration) {
        self.is(Condition::Restarting, now);
        (self.connection, self.call_s, self.before) = (Connection::Never, None, None);
        self.problem.clear();
    }
}
