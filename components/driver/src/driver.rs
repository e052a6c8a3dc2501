//! One step of driving: which goal holds, where the robot is, and the speeds that bring it on.
//! Time is passed in: there is no clock.

use armor_grid::{Grid, Inflation, Occupancy, Point2, Pose2, wrap_angle};

use crate::follower::lead;
use crate::planner::Planner;
use crate::recovery::Recovery;
use crate::surroundings::{Scan, surroundings};
use crate::track::Track;
use crate::window::{Distances, HORIZON_S, Limits, REACTION_S, Velocity, Window};

/// The robot heads for a point at least this far ahead on its path, in metres, and as far as it
/// gets within the window's horizon.
const LOOK_M: f64 = 0.6;
/// A point further to the side than this is turned to on the spot, in radians ...
const SPIN_RAD: f64 = 1.0;
/// ... until it is within this, so that turning and driving do not alternate.
const SPUN_RAD: f64 = 0.35;
/// Turning on the spot is slowed down this part as hard as the base could, so that it ends in time.
const SPIN_BRAKE: f64 = 0.7;
/// The heading at the goal is met within this, in radians.
const HEADING_RAD: f64 = 0.15;
/// Further than the margin from walls, paths and arcs gain nothing, in metres.
const COMFORT_M: f64 = 0.3;
/// What a metre of path costs at a wall, on top of its length.
const WALL_WEIGHT: f64 = 4.0;
/// What a metre of path costs where nothing was seen yet, on top of its length.
const UNKNOWN_WEIGHT: f64 = 10.0;

/// What the robot is and how it shall drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What the base can do.
    pub limits: Limits,
    /// Radius of the circle around the robot's centre that holds all of it, in metres.
    pub radius_m: f64,
    /// Kept free around it, in metres.
    pub margin_m: f64,
    /// A goal is reached within this, in metres.
    pub tolerance_m: f64,
    /// Goals, scans and odometry older than this do not count, in seconds.
    pub timeout_s: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            limits: Limits {
                speed_mps: 0.6,
                turn_radps: 1.2,
                acceleration_mps2: 0.8,
                turn_acceleration_radps2: 3.0,
            },
            radius_m: 0.18,
            margin_m: 0.05,
            tolerance_m: 0.12,
            timeout_s: 0.5,
        }
    }
}

/// The state of driving.
#[derive(Debug)]
pub struct Driving {
    settings: Settings,
    track: Track,
    planner: Planner,
    recovery: Recovery,
    goal: Option<Received<Pose2>>,
    override_goal: Option<Received<Pose2>>,
    scan: Option<Received<Scan>>,
    odometry_s: f64,
    command: Velocity,
    stepped_s: f64,
    spinning: bool,
    path_changed: bool,
}

/// Something and when it came.
#[derive(Clone, Debug)]
struct Received<T> {
    at_s: f64,
    value: T,
}

impl Driving {
    /// Starts with nothing known, at rest.
    pub fn new(settings: Settings) -> Self {
        let radius_m = settings.radius_m + settings.margin_m;
        let inflation = Inflation {
            radius_m,
            comfort_m: radius_m + COMFORT_M,
            weight: WALL_WEIGHT,
            unknown_weight: Some(UNKNOWN_WEIGHT),
        };
        Self {
            settings,
            track: Track::default(),
            planner: Planner::new(inflation),
            recovery: Recovery::default(),
            goal: None,
            override_goal: None,
            scan: None,
            odometry_s: f64::NEG_INFINITY,
            command: Velocity::ZERO,
            stepped_s: f64::NEG_INFINITY,
            spinning: false,
            path_changed: false,
        }
    }

    /// Takes the newest map.
    pub fn map_seen(&mut self, map: Grid<Occupancy>) {
        self.planner.map_seen(map);
    }

    /// Takes a pose on the map, valid at its stamp.
    pub fn pose_seen(&mut self, stamp_s: f64, map_from_robot: Pose2) {
        self.track.pose_seen(stamp_s, map_from_robot);
    }

    /// Takes an odometry pose that came at `now_s`.
    pub fn odometry_seen(&mut self, now_s: f64, stamp_s: f64, odom_from_robot: Pose2) {
        self.track.odometry_seen(stamp_s, odom_from_robot);
        self.odometry_s = now_s;
    }

    /// Takes a scan that came at `now_s`.
    pub fn scan_seen(&mut self, now_s: f64, scan: Scan) {
        self.scan = Some(Received { at_s: now_s, value: scan });
    }

    /// Takes a goal on the map that came at `now_s`.
    pub fn goal_seen(&mut self, now_s: f64, goal: Pose2) {
        self.goal = Some(Received { at_s: now_s, value: goal });
    }

    /// Takes a goal that holds before the others, as long as it is fresh.
    pub fn override_seen(&mut self, now_s: f64, goal: Pose2) {
        self.override_goal = Some(Received { at_s: now_s, value: goal });
    }

    /// Forgets all goals; the next step stands still.
    pub fn stop(&mut self) {
        (self.goal, self.override_goal) = (None, None);
        self.rest();
    }

    /// Returns the path if it changed since it was last asked for; empty when there is none.
    pub fn changed_path(&mut self) -> Option<&[Point2]> {
        std::mem::take(&mut self.path_changed).then(|| self.planner.path())
    }

    /// Decides at time `now_s` how to move; at rest without a fresh goal, scan and odometry.
    pub fn step(&mut self, now_s: f64) -> Velocity {
        let interval_s = (now_s - self.stepped_s).clamp(0.02, 0.2);
        self.stepped_s = now_s;
        let wanted = self.wanted(now_s, interval_s);
        self.command = wanted.unwrap_or_else(|| self.rest());
        self.command
    }

    fn rest(&mut self) -> Velocity {
        self.recovery.rest();
        self.spinning = false;
        self.command = Velocity::ZERO;
        if !self.planner.path().is_empty() {
            self.path_changed = true;
        }
        self.planner.forget();
        Velocity::ZERO
    }

    fn wanted(&mut self, now_s: f64, interval_s: f64) -> Option<Velocity> {
        let goal = self.fresh_goal(now_s)?;
        let scan = self.scan.as_ref().filter(|scan| self.is_fresh(scan.at_s, now_s))?;
        self.is_fresh(self.odometry_s, now_s).then_some(())?;
        let map_from_robot = self.track.map_from_robot()?;
        let odom_from_then = self.track.odom_from_robot_at(scan.value.stamp_s)?;
        let now_from_then = self.track.odom_from_robot()?.inverse().compose(odom_from_then);
        let map = self.planner.map().map(|map| (map, map_from_robot));
        let obstacles = surroundings(&scan.value, now_from_then, map);

        let limits = self.settings.limits;
        let keep_m = self.settings.radius_m + self.settings.margin_m / 2.0;
        let window = Window {
            limits: &limits,
            distances: Distances { keep_m, comfort_m: keep_m + COMFORT_M / 2.0 },
            obstacles: &obstacles,
            now: self.command,
            interval_s,
        };
        let robot = map_from_robot;
        if robot.point().distance_m(goal.point()) <= self.settings.tolerance_m {
            return Some(self.face(wrap_angle(goal.yaw_rad - robot.yaw_rad), &window));
        }
        self.path_changed |= self.planner.renew(robot.point(), goal.point(), now_s);
        let has_path = !self.planner.path().is_empty();
        if let Some(escape) = self.recovery.step(robot, has_path, &window, now_s) {
            return Some(limits.approach(self.command, escape, interval_s));
        }
        Some(self.follow(robot, &window))
    }

    /// At the goal: turns to its heading, then stands.
    fn face(&mut self, off_rad: f64, window: &Window<'_>) -> Velocity {
        self.recovery.rest();
        if off_rad.abs() > HEADING_RAD { self.spin(off_rad, window) } else { Velocity::ZERO }
    }

    /// Drives on along the path; stands if there is none.
    fn follow(&mut self, robot: Pose2, window: &Window<'_>) -> Velocity {
        let look_m = LOOK_M.max(window.limits.speed_mps * HORIZON_S);
        let open = |from, to| self.planner.is_straight_open(from, to);
        let Some(lead) = lead(self.planner.path(), robot.point(), look_m, open) else {
            return Velocity::ZERO;
        };
        let target = robot.inverse().apply(lead.target);
        let bearing_rad = Point2::default().bearing_rad(target);
        self.spinning = bearing_rad.abs() > if self.spinning { SPUN_RAD } else { SPIN_RAD };
        if self.spinning {
            return self.spin(bearing_rad, window);
        }
        let limits = window.limits;
        // Slow enough to stop at the end of the path.
        let stopping_mps = (limits.acceleration_mps2 * lead.remaining_m).sqrt();
        let fastest_mps = limits.speed_mps.min(stopping_mps).max(0.05);
        match window.choose(target, fastest_mps) {
            Some(velocity) if velocity.speed_mps > 0.01 => velocity,
            // Nothing but standing is safe: look for an opening towards the target.
            _ => self.spin(bearing_rad, window),
        }
    }

    /// Turns on the spot. A base that still rolls is brought to rest first, on the arc it is on: that
    /// one was found to be free, others only where nothing is near.
    fn spin(&self, off_rad: f64, window: &Window<'_>) -> Velocity {
        let limits = window.limits;
        // By the time this takes effect, the robot has turned on.
        let left_rad = off_rad - window.now.turn_radps * REACTION_S / 2.0;
        let braking_radps =
            (2.0 * SPIN_BRAKE * limits.turn_acceleration_radps2 * left_rad.abs()).sqrt();
        let turn_radps = braking_radps.min(limits.turn_radps) * left_rad.signum();
        let wanted = Velocity::spin(turn_radps);
        if !window.is_room_to_stop() {
            return limits.braked(window.now, window.interval_s);
        }
        let mut next = limits.approach(window.now, wanted, window.interval_s);
        if !window.is_safe(next) {
            next.speed_mps = 0.0;
        }
        next
    }

    fn fresh_goal(&self, now_s: f64) -> Option<Pose2> {
        [&self.override_goal, &self.goal]
            .into_iter()
            .flatten()
            .find(|goal| self.is_fresh(goal.at_s, now_s))
            .map(|goal| goal.value)
    }

    fn is_fresh(&self, at_s: f64, now_s: f64) -> bool {
        now_s - at_s <= self.settings.timeout_s
    }
}

#[cfg(test)]
#[path = "driver_tests.rs"]
mod tests;
