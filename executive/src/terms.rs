//! The terms of records: how a mission ends, why tokens move, what components report.

use serde::{Deserialize, Serialize};
use std::fmt;

/// How a mission ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MissionOutcome {
    /// At its goal.
    Goal,
    /// In its safe place.
    Safe,
    /// Neither: something could not be stopped, or the safe place could not be reached.
    Failed,
    /// Not at all: the executive was stopped, and the mission can be resumed.
    Interrupted,
}

impl MissionOutcome {
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
    /// A component of a marked place failed for good, and the place has an `on-failure`.
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
pub enum ComponentReport {
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

impl fmt::Display for ComponentReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done => f.write_str("done"),
            Self::Failed { reason } => write!(f, "failed: {reason}"),
            Self::Event { name, value } => write!(f, "{name} ({value})"),
        }
    }
}

impl ComponentReport {
    /// The name that `on="component.name"` gives it.
    pub fn name(&self) -> &str {
        match self {
            Self::Done => "done",
            Self::Failed { .. } => "failed",
            Self::Event { name, .. } => name,
        }
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
