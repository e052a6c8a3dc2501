//! How far the robots of drawn routes have come while the mission runs, and when each of their steps is
//! expected to end: from where the tokens are, the transitions that have fired, and the poses.
//!
//! What is left of a drive takes its time by the speeds of the file, stretched by the pace kept so far: the
//! time that the drives since the begin took, divided by the time that they should have taken.

mod followed;
mod outlook;
#[cfg(test)]
mod tests;

pub use followed::FollowedMission;

use armor_geo::MapPoint;

use crate::date::Date;
use crate::timing::nearby::ZoneNearby;

/// What is observed of a running mission. Times are mission time, in seconds from its begin.
#[derive(Clone, Debug, Default)]
pub struct MissionSighting<'a> {
    /// Now.
    pub now_s: f64,
    /// The date now, if a clock states it.
    pub utc: Option<Date>,
    /// The places that hold tokens, and those that tokens are on their way to.
    pub places: Vec<&'a str>,
    /// The transitions that have fired, and when, the oldest first. The first ones may be missing.
    pub fired: Vec<(&'a str, f64)>,
    /// When the mission stood still, from and to.
    pub pauses: Vec<[f64; 2]>,
    /// The robots, in the order of the routes.
    pub robots: Vec<RobotSighting>,
}

/// What is observed of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotSighting {
    /// Where it is, if that is known.
    pub at: Option<MapPoint>,
    /// The path that it is about to drive, if one is published.
    pub path: Vec<MapPoint>,
}

/// How a route stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RouteStand {
    /// It has not begun.
    Waiting,
    /// One of its steps is under way.
    Underway,
    /// The robot has left its step for this point, or waits there for the operator to resume it.
    Detour {
        /// The rally point, or the start.
        point: String,
        /// Whether it is there.
        is_there: bool,
    },
    /// Its last step has ended.
    Ended,
    /// It was left for another place of the mission.
    Left,
}

/// How a step stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepStand {
    /// It has ended.
    Done,
    /// It is under way.
    Current,
    /// It has not begun.
    Coming,
}

/// How far the robot of a route has come.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteProgress {
    /// The name of the route.
    pub route: String,
    /// How it stands.
    pub stand: RouteStand,
    /// Its steps; a leg that is divided by phase lines has one for each part.
    pub steps: Vec<StepProgress>,
    /// The number of the step that is under way, or was left for a detour.
    pub current: Option<usize>,
    /// The straight metres of all legs that are done, with the part of the present one.
    pub done_m: f64,
    /// Those of all legs.
    pub total_m: f64,
    /// The metres that are left of the present drive: along the published path, otherwise straight.
    pub left_m: Option<f64>,
    /// How far the robot is from the straight line of the present leg.
    pub off_leg_m: Option<f64>,
    /// The speed over the present leg so far, in metres per second.
    pub speed_mps: Option<f64>,
    /// The time that drives took, divided by the time that they should have taken; 1 where there is nothing
    /// to compare yet.
    pub stretch: f64,
    /// The zones near the robot, the nearest first.
    pub zones: Vec<ZoneNearby>,
}

/// A step, or a part of a leg.
#[derive(Clone, Debug, PartialEq)]
pub struct StepProgress {
    /// `l1`, or `l1 to green` for the part of a leg up to a phase line.
    pub step: String,
    /// How it stands.
    pub stand: StepStand,
    /// Where it begins and ends, if that is known.
    pub ends_at: [Option<MapPoint>; 2],
    /// When it ended, or is expected to end; none where that is not known.
    pub end_s: Option<f64>,
    /// When it would have ended at exactly the speeds of the file.
    pub nominal_s: Option<f64>,
    /// Its tightest limit, if it has one.
    pub limit: Option<LimitOutlook>,
}

/// A limit of a step that has not ended.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitOutlook {
    /// `by 1 min`, `not after 2026-…`, `patience 9 s`.
    pub words: String,
    /// When it is over.
    pub at_s: f64,
    /// How much time is left of it at the expected end; negative if the step is expected to be late.
    pub left_s: Option<f64>,
}

impl StepProgress {
    /// How much later than nominal it ends, in seconds; negative if it is early.
    pub fn late_s(&self) -> Option<f64> {
        Some(self.end_s? - self.nominal_s?)
    }
}

impl RouteProgress {
    /// When the route is expected to end.
    pub fn end_s(&self) -> Option<f64> {
        self.steps.last()?.end_s
    }

    /// How much later than nominal the present step is expected to end, or the last one that is done.
    pub fn late_s(&self) -> Option<f64> {
        let last_done = || self.steps.iter().rposition(|step| step.stand == StepStand::Done);
        self.steps.get(self.current.or_else(last_done)?)?.late_s()
    }
}
