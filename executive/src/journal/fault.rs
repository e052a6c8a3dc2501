//! The damages of a journal and of its state file, each with its place.

use super::line::LineDamage;
use std::fmt;

/// The first damage of a journal. Records are counted from 1 over the whole mission, lines from 1
/// in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JournalFault {
    /// A line is not as it was written.
    Line {
        /// The record that is expected there.
        record: u64,
        /// The line.
        line: usize,
        /// The damage.
        damage: LineDamage,
    },
    /// Records are missing.
    Gap {
        /// The first missing record.
        record: u64,
        /// The line where it is expected.
        line: usize,
        /// The record in that line.
        found: u64,
    },
    /// Records are in another order than they were written.
    Order {
        /// The record that is expected.
        record: u64,
        /// The line where it is expected.
        line: usize,
        /// The line that holds it.
        found_in: usize,
    },
    /// A record is repeated.
    Repeated {
        /// The record.
        record: u64,
        /// The line that repeats it.
        line: usize,
    },
    /// A record does not follow the one before it: one of the two is from another journal.
    Chain {
        /// The record.
        record: u64,
        /// Its line.
        line: usize,
    },
    /// A record is as it was written, but this version cannot read it.
    Content {
        /// The record.
        record: u64,
        /// Its line.
        line: usize,
        /// The reason.
        error: String,
    },
    /// The beginning is missing: the first record is neither the first of a mission nor the
    /// summary that a cut leaves.
    Beginning {
        /// The first record that is present.
        record: u64,
    },
    /// The end is missing: more records were committed.
    End {
        /// The last record that is present.
        last: u64,
        /// The line after it.
        line: usize,
        /// The last record that was committed.
        committed: u64,
    },
    /// The file is missing.
    Missing {
        /// The last record that was committed.
        committed: u64,
    },
    /// The file is empty.
    Emptied {
        /// The last record that was committed.
        committed: u64,
    },
    /// The state file is missing.
    StateMissing,
    /// The state file is unreadable.
    StateDamaged,
    /// The state file is older than the journal.
    StateOld {
        /// The last record that was committed, by the state file.
        committed: u64,
        /// The line of the first record that cannot be there.
        line: usize,
    },
    /// The state file is one of another journal.
    StateOfOther {
        /// The last record that was committed, by the state file.
        committed: u64,
    },
}

impl JournalFault {
    /// A word for programs.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Line { .. } => "damaged-record",
            Self::Gap { .. } => "missing-record",
            Self::Order { .. } => "swapped-records",
            Self::Repeated { .. } => "repeated-record",
            Self::Chain { .. } => "foreign-record",
            Self::Content { .. } => "unreadable-record",
            Self::Beginning { .. } => "missing-beginning",
            Self::End { .. } => "missing-end",
            Self::Missing { .. } => "missing-journal",
            Self::Emptied { .. } => "empty-journal",
            Self::StateMissing => "missing-state",
            Self::StateDamaged => "damaged-state",
            Self::StateOld { .. } => "old-state",
            Self::StateOfOther { .. } => "foreign-state",
        }
    }

    /// The number of the record where it was noticed, if it was noticed at one.
    pub fn record(&self) -> Option<u64> {
        match self {
            Self::Line { record, .. }
            | Self::Gap { record, .. }
            | Self::Order { record, .. }
            | Self::Repeated { record, .. }
            | Self::Chain { record, .. }
            | Self::Content { record, .. }
            | Self::Beginning { record } => Some(*record),
            Self::End { last, .. } => Some(last + 1),
            Self::Missing { .. } | Self::Emptied { .. } => Some(1),
            Self::StateOld { committed, .. } | Self::StateOfOther { committed } => Some(*committed),
            Self::StateMissing | Self::StateDamaged => None,
        }
    }

    /// The line where it was noticed, if it was noticed at one.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::Line { line, .. }
            | Self::Gap { line, .. }
            | Self::Order { line, .. }
            | Self::Repeated { line, .. }
            | Self::Chain { line, .. }
            | Self::Content { line, .. }
            | Self::End { line, .. }
            | Self::StateOld { line, .. } => Some(*line),
            Self::Beginning { .. } | Self::Emptied { .. } => Some(1),
            Self::Missing { .. }
            | Self::StateMissing
            | Self::StateDamaged
            | Self::StateOfOther { .. } => None,
        }
    }
}

impl fmt::Display for JournalFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line { record, line, damage } => {
                write!(
                    f,
                    "line {line} is not a record as it was written, record {record} is expected: \
                     {damage}"
                )
            }
            Self::Gap { record, line, found } if found - record == 1 => {
                write!(f, "line {line} is record {found}, and record {record} is missing")
            }
            Self::Gap { record, line, found } => {
                let last = found - 1;
                write!(
                    f,
                    "line {line} is record {found}, and records {record} to {last} are missing"
                )
            }
            Self::Order { record, line, found_in } => write!(
                f,
                "record {record} is in line {found_in} instead of line {line}: records are swapped"
            ),
            Self::Repeated { record, line } => {
                write!(f, "line {line} repeats record {record}")
            }
            Self::Chain { record, line } => write!(
                f,
                "record {record} in line {line} does not follow the record before it: one of the \
                 two is from another journal"
            ),
            Self::Content { record, line, error } => {
                write!(f, "record {record} in line {line} cannot be read by this version: {error}")
            }
            Self::Beginning { record } => {
                write!(f, "it begins with record {record}, and the records before it are missing")
            }
            Self::End { last, line, committed } => write!(
                f,
                "it ends before line {line} with record {last}, and {committed} records were \
                 committed: its end is missing"
            ),
            Self::Missing { committed } => {
                write!(f, "it is gone, and {committed} records were committed")
            }
            Self::Emptied { committed } => {
                write!(f, "it is empty, and {committed} records were committed")
            }
            Self::StateMissing => write!(
                f,
                "its state file is missing, so it is not known whether the end of the journal is \
                 missing, too"
            ),
            Self::StateDamaged => write!(
                f,
                "its state file is damaged, so it is not known whether the end of the journal is \
                 missing"
            ),
            Self::StateOld { committed, line } => {
                write!(f, "its state file is older than line {line}: it ends at record {committed}")
            }
            Self::StateOfOther { committed } => write!(
                f,
                "its state file is that of another journal: record {committed} is not the one \
                 that was committed"
            ),
        }
    }
}
