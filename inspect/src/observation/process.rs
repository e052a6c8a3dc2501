//! One process of a running system and what it is doing, as seen from outside.

use std::time::Duration;

use armor_sdk::control::{CurrentCall, RunState, Status};
use armor_wire::registry::ComponentEntry;

/// What a process is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// It is registered and has not reported its state yet.
    Unknown,
    /// It waits for its settings and parameters.
    Starting,
    /// It is frozen: its code is not called.
    Frozen,
    /// It is active.
    Active,
    /// It has reported that its task is over.
    Done,
    /// It has reported a failure.
    Failed,
    /// It is registered, but does not answer.
    Suspected,
    /// It has ended, and may be restarted.
    Restarting,
    /// It has ended, and was not restarted for a long time.
    Dead,
}

impl Condition {
    /// All conditions.
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

    /// Returns the condition as one word.
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

    /// Returns whether the process has ended.
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
pub struct ObservedProcess {
    /// Its entry in the registry.
    pub entry: ComponentEntry,
    /// What it is doing.
    pub condition: Condition,
    /// When that began, since the beginning of the watch.
    pub since: Duration,
    /// The call of user code that runs, if it is a long one.
    pub call: Option<CurrentCall>,
    /// Its last status.
    pub status: Option<Status>,
    /// Why it does not answer; empty if it does.
    pub problem: String,
    /// How many starts of it were seen.
    pub starts: u32,
    pub(super) before: Option<Status>,
    pub(super) connection: ControlLink,
}

/// The control connection to a process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ControlLink {
    /// Being made.
    Pending,
    Up,
    /// To be retried at this time.
    Down {
        retry: Duration,
    },
    /// The process has none, or has ended.
    Never,
}

impl ObservedProcess {
    /// Sets the condition; returns whether it has changed.
    pub(super) fn set_condition(&mut self, condition: Condition, now: Duration) -> bool {
        let is_new = self.condition != condition;
        if is_new {
            (self.condition, self.since) = (condition, now);
        }
        is_new
    }

    /// Notes that the process has left the registry.
    pub(super) fn mark_gone(&mut self, now: Duration) {
        self.set_condition(Condition::Restarting, now);
        (self.connection, self.call, self.before) = (ControlLink::Never, None, None);
        self.problem.clear();
    }
}
