//! The records of the journal: each thing decided, before it is done. Names, not numbers, so that a
//! person can read it and a changed file cannot be mistaken for the old one.

use crate::order::Judged;
use crate::snapshot::LedgerSnapshot;
use crate::terms::{Cause, ComponentReport, GuardTurned, MissionOutcome, Tokens, ValueSet};
use armor_plan::{DatePhase, GivenValue, Version};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// One thing decided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "kebab-case")]
pub enum JournalEntry {
    /// All that was decided so far, in place of the records before; the first of a journal that was cut.
    Snapshot(Box<LedgerSnapshot>),
    /// A mission begins; the first of every journal that was not cut.
    Began {
        /// Its name.
        mission: String,
        /// Of its plan.
        fingerprint: String,
        /// What it is played from.
        #[serde(default)]
        version: Version,
    },
    /// A new version of the file is played from now on.
    Changed {
        /// The version.
        version: Version,
        /// Of its plan.
        fingerprint: String,
        /// What is not as before, in words.
        changes: Vec<String>,
    },
    /// A new version of the file is not played; the one before stays in force.
    Refused {
        /// Its number.
        version: u64,
        /// Why, in words.
        why: String,
    },
    /// A firing has taken its tokens; what must stop is being stopped.
    Took {
        /// Counts firings, from 1.
        firing: u64,
        /// Why.
        cause: Cause,
        /// What was taken.
        from: Vec<Tokens>,
        /// What will be put.
        to: Vec<Tokens>,
        /// How long after its deadline, in seconds.
        late_s: f64,
        /// The variables that it has set.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        sets: Vec<ValueSet>,
        /// The guards that hold, or do not hold any more, because of that.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        guards: Vec<GuardTurned>,
    },
    /// All that had to stop for a firing has confirmed it; what must start is being started.
    Stopped {
        /// The firing.
        firing: u64,
    },
    /// A component is about to be activated.
    Activating {
        /// The component.
        component: String,
        /// Counts activations of all components, from 1.
        activation: u64,
        /// The values that places give its parameters.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        values: Vec<GivenValue>,
    },
    /// A firing goes elsewhere than it was going to.
    Redirected {
        /// The firing.
        firing: u64,
        /// Where to.
        to: Vec<Tokens>,
        /// Why, in words.
        why: String,
    },
    /// A firing is complete: its tokens are put.
    Put {
        /// The firing.
        firing: u64,
    },
    /// A report counts.
    Heard {
        /// Whose.
        component: String,
        /// Of which process start; 0 if the executive itself decides that the component failed.
        instance: u64,
        /// Its number in that process.
        serial: u64,
        /// What.
        report: ComponentReport,
    },
    /// An operator's order has been judged; what follows from an accepted one is done with it.
    Ordered(Judged),
    /// The operator is asked whether a transition may fire.
    Asked {
        /// The transition.
        transition: String,
    },
    /// No answer came in time.
    Unanswered {
        /// The transition.
        transition: String,
        /// Whether it fires all the same.
        fires: bool,
    },
    /// The holder of the lease has not come back in time.
    LinkLost {
        /// Who commanded.
        author: String,
    },
    /// The executive itself holds the mission until an operator resumes it.
    Held {
        /// Why, in words.
        why: String,
    },
    /// A guard has come to hold, or does not hold any more.
    Guard {
        /// Of which transition.
        transition: String,
        /// Whether it holds.
        holds: bool,
        /// The values it looks at, in words.
        because: String,
    },
    /// A date of a transition has come or passed, or is to come after all: the clock was set.
    Dated {
        /// The transition.
        transition: String,
        /// Where its dates stand.
        phase: DatePhase,
        /// Whether it has fired before.
        used: bool,
        /// The reading of the clock, in UTC.
        utc: String,
    },
    /// Every token and every firing is given up; the mission goes to its safe place.
    Retreated {
        /// Why, in words.
        why: String,
    },
    /// Not even the safe place could be reached.
    GaveUp {
        /// Why, in words.
        why: String,
    },
    /// The end.
    Ended {
        /// How.
        outcome: MissionOutcome,
    },
}

/// One line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalRecord {
    /// Mission time, since its beginning.
    #[serde(rename = "at_ns", with = "nanoseconds")]
    pub at: Duration,
    /// What.
    #[serde(flatten)]
    pub entry: JournalEntry,
}

/// Whole nanoseconds: exact, so that clocks come back as they were.
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
