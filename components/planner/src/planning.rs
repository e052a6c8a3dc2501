//! Which goal has priority, and the path to publish. Time is passed in: there is no clock.

use armor_grid::{Grid, Inflation, Occupancy, Pose2};
use armor_zones::ZoneMap;

use crate::planned_path::PlannedPath;

/// Further than the margin from walls, paths gain nothing, in metres.
const COMFORT_M: f64 = 0.3;
/// What a metre of path costs at a wall, on top of its length.
const WALL_WEIGHT: f64 = 4.0;
/// What a metre of path costs where nothing was seen yet, on top of its length.
const UNKNOWN_WEIGHT: f64 = 10.0;

/// What the robot is and how long goals are valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannerSettings {
    /// Radius of the circle around the robot's centre that encloses it, in metres.
    pub radius_m: f64,
    /// Kept free around it, in metres.
    pub margin_m: f64,
    /// Fastest speed, in metres per second: what a slower zone costs is measured against it.
    pub speed_mps: f64,
    /// Goals older than this do not count, in seconds.
    pub timeout_s: f64,
}

/// Whose goal it is. While the goal of a higher rank is fresh, the lower ones do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// The component that carries out the task.
    Task,
    /// The component that interrupts the task.
    Override,
    /// A person.
    Operator,
}

/// The state of planning.
#[derive(Debug)]
pub struct Planning {
    timeout_s: f64,
    /// When they came and where they are, by rank.
    goals: [Option<(f64, Pose2)>; 3],
    robot: Option<Pose2>,
    path: PlannedPath,
    has_goal: bool,
    /// Whether it is known where the robot may be.
    are_zones_known: bool,
}

impl Planning {
    /// Starts with nothing known.
    pub fn new(settings: PlannerSettings) -> Self {
        let comfort_m = settings.radius_m + settings.margin_m + COMFORT_M;
        let inflation = |radius_m| Inflation {
            radius_m,
            comfort_m,
            weight: WALL_WEIGHT,
            unknown_weight: Some(UNKNOWN_WEIGHT),
        };
        let inflations = [settings.radius_m + settings.margin_m, settings.radius_m].map(inflation);
        Self {
            timeout_s: settings.timeout_s,
            goals: [None; 3],
            robot: None,
            path: PlannedPath::new(inflations, settings.speed_mps),
            has_goal: false,
            are_zones_known: true,
        }
    }

    /// Resets the state. Only the map and the zones are kept: they may not be sent again.
    pub fn reset_state(&mut self, settings: PlannerSettings) {
        let (map, zones) = self.path.take_map();
        *self = Self { are_zones_known: self.are_zones_known, ..Self::new(settings) };
        map.into_iter().for_each(|map| self.map_seen(map));
        self.path.zones_seen(zones);
    }

    /// Takes the newest zones.
    pub fn zones_seen(&mut self, zones: ZoneMap) {
        self.path.zones_seen(zones);
    }

    /// Takes whether the zones of the robot's frame are known. While they are not, every path is
    /// empty.
    pub fn set_zones_known(&mut self, are_known: bool) {
        if !are_known {
            self.path.forget_path();
        }
        self.are_zones_known = are_known;
    }

    /// Returns the zone that the goal of the last step is in, if no robot may be there.
    pub fn goal_zone(&self) -> Option<&str> {
        self.path.goal_zone()
    }

    /// Takes the newest map.
    pub fn map_seen(&mut self, map: Grid<Occupancy>) {
        self.path.map_seen(map);
    }

    /// Takes where the robot is on the map.
    pub fn pose_seen(&mut self, map_from_robot: Pose2) {
        if map_from_robot.is_finite() {
            self.robot = Some(map_from_robot);
        }
    }

    /// Takes a goal on the map that came at `now_s`; one that is not finite is none.
    pub fn goal_seen(&mut self, now_s: f64, rank: Rank, goal: Pose2) {
        self.goals[rank as usize] = goal.is_finite().then_some((now_s, goal));
    }

    /// Returns whether the path leads elsewhere than to the goal that has priority, so that another
    /// one is wanted before the next tick.
    pub fn is_path_wanted(&self, now_s: f64) -> bool {
        let goal = self.freshest_goal(now_s).filter(|_| self.robot.is_some());
        goal.is_some_and(|goal| self.path.leads_elsewhere(goal.point(), now_s))
    }

    /// Forgets everything that lies in the map frame: its origin is another place.
    pub fn forget_frame(&mut self) {
        self.forget_goals();
        self.robot = None;
        self.path.forget_map();
    }

    /// Forgets all goals.
    pub fn forget_goals(&mut self) {
        self.goals = [None; 3];
    }

    /// Returns what to publish at time `now_s`: the path to the goal that has priority, empty if no
    /// path exists or the goal is where no robot may be; one empty path when the last goal has ended; `None` without a goal.
    ///
    /// A path goes from where the robot was when it was planned to the goal, or as near to it as a
    /// robot may stand, and ends with the goal's heading.
    pub fn step(&mut self, now_s: f64) -> Option<&[Pose2]> {
        let Some(goal) = self.freshest_goal(now_s) else {
            self.path.forget_path();
            return std::mem::take(&mut self.has_goal).then_some(&[]);
        };
        self.has_goal = true;
        let Some(robot) = self.robot.filter(|_| self.are_zones_known) else { return Some(&[]) };
        Some(self.path.path_to(goal, robot.point(), now_s))
    }

    /// The fresh goal of the highest rank.
    fn freshest_goal(&self, now_s: f64) -> Option<Pose2> {
        // What came in a future that time has gone back from is not fresh either.
        let fresh = |&(at_s, _): &(f64, Pose2)| (now_s - at_s).abs() <= self.timeout_s;
        self.goals.iter().rev().find_map(|goal| goal.filter(fresh)).map(|(_, goal)| goal)
    }
}

#[cfg(test)]
#[path = "planning_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "zone_tests.rs"]
mod zone_tests;
