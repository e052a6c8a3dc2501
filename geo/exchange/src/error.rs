//! Why a plan cannot be read or written.

/// The most items, corners and positions of a file.
pub(crate) const MOST_POSITIONS: usize = 100_000;

/// Why a file of plans cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlanReadError {
    /// The file is larger than any plan.
    #[error("the file has {bytes} bytes, and at most {most} are read; split it")]
    TooLarge {
        /// How many it has.
        bytes: usize,
        /// How many are read.
        most: usize,
    },
    /// It has more items, corners or positions than are read.
    #[error("the file has more than {most} positions and items; split it")]
    TooMany {
        /// How many are read.
        most: usize,
    },
    /// It is no text of its format at all.
    #[error("this is no {format}: {reason}")]
    Syntax {
        /// The format.
        format: &'static str,
        /// What is wrong, with its place.
        reason: String,
    },
    /// A version that is not read.
    #[error(
        "{what} has version {found}, and version {known} is read; save it again with a planner of that version"
    )]
    Version {
        /// What has the version.
        what: String,
        /// The version.
        found: String,
        /// The one that is read.
        known: &'static str,
    },
    /// Something that must be there is not.
    #[error("{place} has no {what}; a plan cannot be read without")]
    Missing {
        /// Where.
        place: String,
        /// What.
        what: &'static str,
    },
    /// A value that cannot be.
    #[error("{place}: {reason}")]
    Value {
        /// Where.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// Something that changes the route and has no counterpart here.
    #[error(
        "{place} is a {what}, which the file contains without its positions, so that the route is not known; replace it by waypoints in the planner"
    )]
    Unsupported {
        /// Where.
        place: String,
        /// What it is.
        what: String,
    },
}

impl PlanReadError {
    pub(crate) fn value(place: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Value { place: place.into(), reason: reason.into() }
    }

    pub(crate) fn missing(place: impl Into<String>, what: &'static str) -> Self {
        Self::Missing { place: place.into(), what }
    }
}

/// Why a plan cannot be written in a format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlanWriteError {
    /// The format has place for one route.
    #[error(
        "{format} has place for one route, and the plan has {found}; write each into a file of its own"
    )]
    SeveralRoutes {
        /// The format.
        format: &'static str,
        /// How many routes there are.
        found: usize,
    },
    /// A repetition leads to an item that does not exist.
    #[error("item {item} continues at item {to}, which does not exist")]
    Repetition {
        /// The item, counted from 1.
        item: usize,
        /// The item it names, counted from 1.
        to: usize,
    },
}
