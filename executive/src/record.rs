//! The records of the journal. Each decision is recorded before it is carried out. Records hold
//! names instead of ids, so that a person can read them and a changed file is not mistaken for the
//! old one.

use crate::order::Judged;
use crate::snapshot::LedgerSnapshot;
use crate::terms::{Cause, ComponentReport, GuardTurned, MissionOutcome, Tokens, ValueSet};
use armor_plan::{DatePhase, GivenValue, Version};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// One decision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "kebab-case")]
pub enum JournalEntry {
    /// The state after all earlier records, which it replaces: the first record of a journal that
    /// was cut.
    Snapshot(Box<LedgerSnapshot>),
    /// A mission begins: the first record of a journal that was not cut.
    Began {
        /// The name of the mission.
        mission: String,
        /// The fingerprint of the plan.
        fingerprint: String,
        /// The version of the file.
        #[serde(default)]
        version: Version,
    },
    /// A new version of the file is played from now on.
    Changed {
        /// The version.
        version: Version,
        /// The fingerprint of the plan.
        fingerprint: String,
        /// The differences to the version before, in words.
        changes: Vec<String>,
        /// The components that are started again, as a marked place gives them other values.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        restarts: Vec<String>,
    },
    /// A new version of the file is not played; the one before stays in force.
    Refused {
        /// The number of the version.
        version: u64,
        /// The reason, in words.
        why: String,
    },
    /// A firing has taken its tokens. The components that must stop are being stopped.
    Took {
        /// The number of the firing, from 1.
        firing: u64,
        /// The reason for the firing.
        cause: Cause,
        /// The tokens taken.
        from: Vec<Tokens>,
        /// The tokens to be put.
        to: Vec<Tokens>,
        /// The time since its deadline, in seconds; 0 if it is not late.
        late_s: f64,
        /// The variables that it has set.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        sets: Vec<ValueSet>,
        /// The guards whose truth changes with these variables.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        guards: Vec<GuardTurned>,
    },
    /// All components that had to stop for a firing have confirmed it. Those that must start are
    /// being started.
    Stopped {
        /// The firing.
        firing: u64,
    },
    /// A component is about to be activated.
    Activating {
        /// The component.
        component: String,
        /// The number of the activation, counted over all components, from 1.
        activation: u64,
        /// The values that places give its parameters.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        values: Vec<GivenValue>,
    },
    /// A firing leads to other places, since a component did not stop or did not start.
    Redirected {
        /// The firing.
        firing: u64,
        /// The tokens to be put instead.
        to: Vec<Tokens>,
        /// The reason, in words.
        why: String,
    },
    /// A firing is complete: its tokens are put.
    Put {
        /// The firing.
        firing: u64,
    },
    /// A report of a component is accepted.
    Heard {
        /// The component.
        component: String,
        /// The process start; 0 if the executive itself decides that the component failed.
        instance: u64,
        /// The number of the report in that process start.
        serial: u64,
        /// The report.
        report: ComponentReport,
    },
    /// An operator's order has been judged. An accepted order takes effect with this record.
    Ordered(Judged),
    /// The operator is asked whether a transition may fire.
    Asked {
        /// The transition.
        transition: String,
    },
    /// The operator did not answer in time.
    Unanswered {
        /// The transition.
        transition: String,
        /// Whether it fires without an answer.
        fires: bool,
    },
    /// The holder of the lease has not come back in time.
    LinkLost {
        /// The operator who held the lease.
        author: String,
    },
    /// The executive itself pauses the mission until an operator resumes it.
    Held {
        /// The reason, in words.
        why: String,
    },
    /// The truth of a guard has changed.
    Guard {
        /// The transition.
        transition: String,
        /// Whether the guard is true.
        holds: bool,
        /// The values that it reads, in words.
        because: String,
    },
    /// A date of a transition has come or passed, or is in the future again as the clock was set
    /// back.
    Dated {
        /// The transition.
        transition: String,
        /// The phase of its dates.
        phase: DatePhase,
        /// Whether the transition has fired before.
        used: bool,
        /// The reading of the clock, in UTC.
        utc: String,
    },
    /// Every token and every firing is given up; the mission goes to its safe place.
    Retreated {
        /// The reason, in words.
        why: String,
    },
    /// The safe place could not be reached.
    GaveUp {
        /// The reason, in words.
        why: String,
    },
    /// The mission has ended.
    Ended {
        /// Its outcome.
        outcome: MissionOutcome,
    },
}

/// One line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalRecord {
    /// Mission time: the time since the mission began.
    #[serde(rename = "at_ns", with = "nanoseconds")]
    pub at: Duration,
    /// The decision.
    #[serde(flatten)]
    pub entry: JournalEntry,
}

/// Durations as whole nanoseconds: a replay must give the clocks their exact values.
mod nanoseconds {
    use serde::{Deserialize, Deserializer, Serializer};
    use std::time::Duration;

    pub(super) fn serialize<S: Serializer>(at: &Duration, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u64(u64::try_from(at.as_nanos()).unwrap_or(u64::MAX))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Duration, D::Error> {
        u64::deserialize(from).map(Duration::from_nanos)
    }
}
