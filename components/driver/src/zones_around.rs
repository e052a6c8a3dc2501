//! The zones near the robot: which points its centre may not come to, how fast it may be, and where
//! its path leads into a closed zone.

use armor_grid::{Point2, Pose2};
use armor_zones::{Barrier, ZoneMap};

use crate::limits::{DriveLimits, REACTION_S};

/// A line is looked at in steps of this, in metres.
const LINE_STEP_M: f64 = 0.05;
/// A path out of a closed zone may begin this much deeper in it than the robot is now, in metres: the
/// robot has moved since the path was planned.
const DEEPER_M: f64 = 0.05;

/// The barriers near the robot, and where it is among them.
#[derive(Clone, Debug)]
pub(crate) struct ZonesAround<'a> {
    map_from_robot: Pose2,
    /// With the room that each leaves at the robot, in metres.
    near: Vec<(&'a Barrier, f64)>,
}

impl<'a> ZonesAround<'a> {
    /// Looks at what is within `reach_m` of the robot.
    pub(crate) fn new(zones: &'a ZoneMap, map_from_robot: Pose2, reach_m: f64) -> Self {
        let here = map_from_robot.point();
        // The room changes by at most a metre per metre: what is further is touched by no arc.
        let rooms = zones.barriers().iter().map(|barrier| (barrier, barrier.room_m(here)));
        Self { map_from_robot, near: rooms.filter(|(_, room_m)| *room_m < reach_m).collect() }
    }

    /// Returns the least room at a point in the robot's frame; `None` if a barrier leaves less than
    /// `keep_m` requires by the room that it leaves at the robot. Barriers that the robot is past
    /// already do not count for the least room.
    pub(crate) fn check_room(&self, point: Point2, keep_m: impl Fn(f64) -> f64) -> Option<f64> {
        let on_map = self.map_from_robot.apply(point);
        let mut least_m = f64::INFINITY;
        for (barrier, here_m) in &self.near {
            let room_m = barrier.room_m(on_map);
            if room_m < keep_m(*here_m) {
                return None;
            }
            if *here_m > 0.0 {
                least_m = least_m.min(room_m);
            }
        }
        Some(least_m)
    }

    /// Returns whether the straight line to a point in the robot's frame keeps `clear_m` from every
    /// barrier, or as much as the robot has now.
    pub(crate) fn is_line_clear(&self, to: Point2, clear_m: f64) -> bool {
        if self.near.is_empty() {
            return true;
        }
        let steps = (to.distance_m(Point2::default()) / LINE_STEP_M).ceil().max(1.0) as u32;
        (1..=steps).all(|step| {
            let point = Point2::default().toward(to, f64::from(step) / f64::from(steps));
            self.check_room(point, |here_m| clear_m.min(here_m)).is_some()
        })
    }
}

/// Cuts a path where it leads into a closed zone, behind the point nearest to the robot. Returns how
/// many of its poses are left, and the name of the zone. A path that leads out of a zone is not cut.
pub(crate) fn cut_path(
    zones: &ZoneMap,
    path: &[Pose2],
    robot: Point2,
    radius_m: f64,
) -> Option<(usize, String)> {
    let away_m = |pose: &Pose2| pose.point().distance_m(robot);
    let nearest = path.iter().enumerate().min_by(|a, b| away_m(a.1).total_cmp(&away_m(b.1)))?.0;
    let cuts = zones.barriers().iter().filter_map(|barrier| {
        let mut least_m = radius_m.min(barrier.room_m(robot) - DEEPER_M);
        let closed = path[nearest..].iter().position(|pose| {
            let room_m = barrier.room_m(pose.point());
            // Once the path is out of the zone, it must not lead in again.
            least_m = if room_m >= radius_m { radius_m } else { least_m };
            room_m < least_m
        });
        closed.map(|index| (nearest + index, barrier.name()))
    });
    cuts.min_by_key(|(index, _)| *index).map(|(index, name)| (index, name.to_owned()))
}

/// Returns how fast the robot may be, in metres per second: its limit in a speed zone, and before
/// one so fast that it has slowed down when its outline reaches the zone; infinite without one.
pub(crate) fn fastest_mps(
    zones: &ZoneMap,
    robot: Point2,
    radius_m: f64,
    now_mps: f64,
    limits: &DriveLimits,
) -> f64 {
    let late_m = now_mps.abs() * REACTION_S;
    let fastest = zones.speed_limits(robot).map(|(limit_mps, away_m)| {
        let gap_m = (away_m - radius_m - late_m).max(0.0);
        (limit_mps * limit_mps + 2.0 * limits.acceleration_mps2 * gap_m).sqrt()
    });
    fastest.fold(f64::INFINITY, f64::min)
}
