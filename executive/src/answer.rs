//! The answer to a question about a new version of the file.

use armor_plan::{Plan, Stand};
use std::sync::Arc;

/// The answer to a [`crate::VersionQuestion`].
#[derive(Clone, Debug, PartialEq)]
pub struct VersionAnswer {
    /// The number of the question.
    pub serial: u64,
    /// The result.
    pub found: VersionFinding,
}

/// The result of an examination of a new version.
#[derive(Clone, Debug, PartialEq)]
pub enum VersionFinding {
    /// Whether it can be played; an error gives the reason why not.
    Read(Result<VersionOffer, String>),
    /// Whether it is safe to continue with it from the current marking.
    Proven {
        /// The marking and variables that it was proven from.
        stand: Stand,
        /// An error describes the faults, each with a trace that leads to it.
        verdict: Result<(), String>,
    },
}

/// A version that can be played.
#[derive(Clone, Debug)]
pub struct VersionOffer {
    /// Its plan.
    pub plan: Arc<Plan>,
    /// The differences to the version in force, in words.
    pub changes: Vec<String>,
    /// Whether it is the net in force with other values in its places, so that it is proven from
    /// wherever the mission stands as that one is.
    pub is_proven: bool,
}

impl PartialEq for VersionOffer {
    fn eq(&self, other: &Self) -> bool {
        self.plan.version() == other.plan.version()
            && self.changes == other.changes
            && self.is_proven == other.is_proven
    }
}
