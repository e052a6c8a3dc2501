//! When the steps of drawn routes happen: the earliest and the latest time of each, the slack of every
//! limit, whether all limits can be kept together, and whether the battery suffices.
//!
//! A robot never delays a step by itself: a moment is the latest of what it waits for. So the earliest
//! times are longest paths with the shortest durations, and the latest times those with the longest.
//! Whether all limits can be kept together is decided by a simple temporal network.

mod course;
mod drive;
mod endurance;
mod extremes;
mod network;
mod timetable;

pub use drive::{DriveLengths, StraightLengths};
pub(crate) use endurance::{EnduranceGap, OpenTime, find_endurance_gap};
pub use timetable::{StepLimit, StepTime, Timetable};
pub(crate) use timetable::{TimeConflict, TimeShortage};
