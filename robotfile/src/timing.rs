//! When the steps of drawn routes happen: the earliest and the latest time of each, the slack of every
//! limit, whether all limits can be kept together, and whether the battery suffices; where the robots are
//! at each time, where two come too close, and how probable it is that the limits are kept; while the
//! mission runs, how far each robot has come and when it is expected; and the times of a mission that was
//! played, compared with them.
//!
//! A robot never delays a step by itself: a moment is the latest of what it waits for. So the earliest
//! times are longest paths with the shortest durations, and the latest times those with the longest.
//! Whether all limits can be kept together is decided by a simple temporal network.

mod chance;
mod course;
mod drive;
mod encounter;
mod endurance;
mod extremes;
mod motion;
mod nearby;
mod network;
mod preview;
mod progress;
mod rehearsal;
mod timetable;

pub use chance::{CHANCE_DRAWS, DrawnChance, MissionChances};
pub use drive::{DriveLengths, StraightLengths};
pub use encounter::RobotEncounter;
pub(crate) use endurance::{EnduranceGap, OpenTime, find_endurance_gap};
pub use motion::{MotionPiece, RobotMotion};
pub use nearby::ZoneNearby;
pub use preview::{
    Appointment, MissionPreview, PreviewLimit, PreviewRobot, PreviewSchedule, SpeedChoice,
};
pub use progress::{
    FollowedMission, LimitOutlook, MissionSighting, RobotSighting, RouteProgress, RouteStand,
    StepProgress, StepStand,
};
pub use rehearsal::{JournalFiring, LegError, Rehearsal, RehearsedEnd, RehearsedStep, StepBounds};
pub use timetable::{StepLimit, StepTime, Timetable};
pub(crate) use timetable::{TimeConflict, TimeShortage};
