//! What the journal says: each thing decided, before it is done. Names, not numbers, so that a
//! person can read it and a changed file cannot be mistaken for the old one.

use crate::order::Judged;
use crate::snapshot::Snapshot;
use armor_plan::{DatePhase, GivenValue, Version};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::time::Duration;

/// How a mission ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// At its goal.
    Goal,
    /// In its safe place.
    Safe,
    /// Neither: something could not be stopped, or the safe place could not be reached.
    Failed,
    /// Not at all: it was told to stop, and can be resumed.
    Interrupted,
}

impl Outcome {
    /// The exit code of an executive whose mission ended so.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Goal => 0,
            Self::Safe => 3,
            Self::Failed => 4,
            Self::Interrupted => 130,
        }
    }
}

/// Tokens of one place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tokens {
    /// The place's name.
    pub place: String,
    /// How many.
    pub tokens: u32,
}

/// A variable that is set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ValueSet {
    /// The variable.
    pub variable: String,
    /// What it is from now on.
    pub value: i64,
}

/// A guard that is another one now.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GuardTurned {
    /// Of which transition.
    pub transition: String,
    /// Whether it holds.
    pub holds: bool,
}

/// Why tokens move.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// The mission begins.
    Start,
    /// A transition of the net.
    Transition(String),
    /// A component of a marked place failed for good, and the place says where to go then.
    Failure {
        /// The place.
        place: String,
        /// The component.
        component: String,
    },
    /// Everything is given up for the safe place.
    Retreat,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => f.write_str("the start"),
            Self::Transition(name) => f.write_str(name),
            Self::Failure { component, .. } => write!(f, "failure of {component}"),
            Self::Retreat => f.write_str("the retreat"),
        }
    }
}

/// What a component reported.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Report {
    /// Its task is over.
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
        #[serde(with = "any_number")]
        value: f64,
    },
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done => f.write_str("done"),
            Self::Failed { reason } => write!(f, "failed: {reason}"),
            Self::Event { name, value } => write!(f, "{name} ({value})"),
        }
    }
}

impl Report {
    /// The name that `on="component.name"` gives it.
    pub fn name(&self) -> &str {
        match self {
            Self::Done => "done",
            Self::Failed { .. } => "failed",
            Self::Event { name, .. } => name,
        }
    }
}

/// One thing decided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "entry", rename_all = "kebab-case")]
pub enum Entry {
    /// All that was decided so far, in the place of the records that said so; the first of a
    /// journal that was cut.
    Snapshot(Box<Snapshot>),
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
    /// A new version of the file is not played; the one before goes on.
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
        /// Of which process start; 0 if the executive itself says that the component failed.
        instance: u64,
        /// Its number in that process.
        serial: u64,
        /// What.
        report: Report,
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
    /// Whoever commanded has not come back in time.
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
        /// What the clock says, in UTC.
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
        outcome: Outcome,
    },
}

/// One line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Mission time, since its beginning.
    #[serde(rename = "at_ns", with = "nanoseconds")]
    pub at: Duration,
    /// What.
    #[serde(flatten)]
    pub entry: Entry,
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

/// JSON has no word for what is not a number or not finite; components may report it.
pub(crate) mod any_number {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written {
        Number(f64),
        Word(String),
    }

    pub(crate) fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
        if value.is_finite() { to.serialize_f64(*value) } else { to.collect_str(value) }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        match Written::deserialize(from)? {
            Written::Number(value) => Ok(value),
            Written::Word(word) => word.parse().map_err(D::Error::custom),
        }
    }
}
