//! The answer to a question about a new version of the file.

use armor_plan::{Plan, Stand};
use std::sync::Arc;

/// The answer to a [`Question`].
#[derive(Clone, Debug, PartialEq)]
pub struct VersionAnswer {
    /// Which question it answers.
    pub serial: u64,
    /// What was found.
    pub found: VersionFinding,
}

/// What was found of a new version.
#[derive(Clone, Debug, PartialEq)]
pub enum VersionFinding {
    /// It can be played, or why not.
    Read(Result<VersionOffer, String>),
    /// Nothing bad follows from where the mission stands, or what does.
    Proven {
        /// Where that is.
        stand: Stand,
        /// In words, with a way there.
        verdict: Result<(), String>,
    },
}

/// A version that can be played.
#[derive(Clone, Debug)]
pub struct VersionOffer {
    /// Its plan.
    pub plan: Arc<Plan>,
    /// What is not as before, in words.
    pub changes: Vec<String>,
}

impl PartialEq for VersionOffer {
    fn eq(&self, other: &Self) -> bool {
        self.plan.version() == other.plan.version() && self.changes == other.changes
    }
}
