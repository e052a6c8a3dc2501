//! One step of driving: who says where to, where the robot is, and the speeds that bring it on.
//! Time is passed in: there is no clock.

use armor_grid::{Grid, Occupancy, Point2, Pose2, wrap_angle};

use crate::follower::lead;
use crate::guard::guarded;
use crate::limits::{LONGEST_S, Limits, REACTION_S, Velocity};
use crate::recovery::Recovery;
use crate::surroundings::{Scan, surroundings};
use crate::track::Track;
use crate::window::{Distances, HORIZON_S, Window};

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
/// Things further away than this touch no arc that is tried, in metres, unless the base takes longer
/// to stop.
const NEAR_M: f64 = 1.5;
/// Arcs that stay further than this from everything are not better for it, in metres.
const COMFORT_M: f64 = 0.15;

/// What the robot is and how it shall drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What the base can do.
    pub limits: Limits,
    /// Radius of the circle around the robot's centre that holds all of it, in metres.
    pub radius_m: f64,
    /// Kept free around it, in metres.
    pub margin_m: f64,
    /// The end of a path is reached within this, in metres.
    pub tolerance_m: f64,
    /// Paths, scans, odometry and what a hand says do not count when older than this, in seconds.
    pub timeout_s: f64,
    /// Whether who drives by hand is slowed down and stopped before what the laser sees.
    pub guarded: bool,
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
            guarded: true,
        }
    }
}

/// The state of driving.
#[derive(Debug)]
pub struct Driving {
    settings: Settings,
    track: Track,
    recovery: Recovery,
    map: Option<Grid<Occupancy>>,
    path: Option<Received<Vec<Pose2>>>,
    hand: Option<Received<Velocity>>,
    is_stopped: bool,
    scan: Option<Received<Scan>>,
    odometry_s: f64,
    command: Velocity,
    stepped_s: f64,
    spinning: bool,
}

/// Something and when it came.
#[derive(Clone, Debug)]
struct Received<T> {
    at_s: f64,
    value: T,
}

/// What is known of here and now.
struct Senses {
    map_from_robot: Option<Pose2>,
    /// Everything near, in the robot's frame.
    obstacles: Vec<Point2>,
}

impl Driving {
    /// Starts with nothing known, at rest.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            track: Track::default(),
            recovery: Recovery::default(),
            map: None,
            path: None,
            hand: None,
            is_stopped: false,
            scan: None,
            odometry_s: f64::NEG_INFINITY,
            command: Velocity::ZERO,
            stepped_s: f64::NEG_INFINITY,
            spinning: false,
        }
    }

    /// Starts afresh; only the map and the order to stand, which are not said again, are kept.
    pub fn begin_anew(&mut self, settings: Settings) {
        let (map, is_stopped) = (self.map.take(), self.is_stopped);
        *self = Self { map, is_stopped, ..Self::new(settings) };
    }

    /// Takes the newest map: what it shows is kept clear of where the laser does not look.
    pub fn map_seen(&mut self, map: Grid<Occupancy>) {
        self.map = Some(map);
    }

    /// Takes a pose on the map, valid at its stamp.
    pub fn pose_seen(&mut self, stamp_s: f64, map_from_robot: Pose2) {
        if stamp_s.is_finite() && map_from_robot.is_finite() {
            self.track.pose_seen(stamp_s, map_from_robot);
        }
    }

    /// Takes an odometry pose that came at `now_s`.
    pub fn odometry_seen(&mut self, now_s: f64, stamp_s: f64, odom_from_robot: Pose2) {
        if stamp_s.is_finite() && odom_from_robot.is_finite() {
            self.track.odometry_seen(stamp_s, odom_from_robot);
            self.odometry_s = now_s;
        }
    }

    /// Takes a scan that came at `now_s`; one that says nothing, as of a covered laser, does not count.
    pub fn scan_seen(&mut self, now_s: f64, scan: Scan) {
        if scan.says_something() {
            self.scan = Some(Received { at_s: now_s, value: scan });
        }
    }

    /// Takes a path on the map that came at `now_s`: from the robot to the goal, with its heading at
    /// the end; empty if there is no way. One that is not finite counts as empty.
    pub fn path_seen(&mut self, now_s: f64, mut path: Vec<Pose2>) {
        if !path.iter().all(|pose| pose.is_finite()) {
            path.clear();
        }
        self.path = Some(Received { at_s: now_s, value: path });
    }

    /// Takes what somebody's hand wants, which came at `now_s`; it holds before the path. What is no
    /// number stands.
    pub fn hand_seen(&mut self, now_s: f64, mut wanted: Velocity) {
        if !(wanted.speed_mps.is_finite() && wanted.turn_radps.is_finite()) {
            wanted = Velocity::ZERO;
        }
        self.hand = Some(Received { at_s: now_s, value: wanted });
    }

    /// Takes the order to stand, whatever else is said, or its end.
    pub fn stop_seen(&mut self, is_stopped: bool) {
        self.is_stopped = is_stopped;
    }

    /// Forgets where to drive; the next step stands still.
    pub fn forget(&mut self) {
        (self.path, self.hand) = (None, None);
    }

    /// Decides at time `now_s` how to move; at rest if told to stand, or without a fresh path or
    /// hand, or blind.
    pub fn step(&mut self, now_s: f64) -> Velocity {
        let interval_s = (now_s - self.stepped_s).clamp(0.02, LONGEST_S);
        self.stepped_s = now_s;
        self.command = match self.fresh(&self.hand, now_s) {
            _ if self.is_stopped => None,
            Some(&wanted) => self.by_hand(wanted, now_s, interval_s),
            None => self.along_path(now_s, interval_s),
        }
        .unwrap_or_else(|| self.rest());
        self.command
    }

    fn rest(&mut self) -> Velocity {
        self.recovery.rest();
        self.spinning = false;
        Velocity::ZERO
    }

    /// As the hand wants, within what the base can do and, if guarded, what is safe; `None` if that
    /// cannot be told.
    fn by_hand(&mut self, wanted: Velocity, now_s: f64, interval_s: f64) -> Option<Velocity> {
        self.rest();
        let limits = self.settings.limits;
        let wanted = limits.within(wanted);
        if !self.settings.guarded {
            return Some(limits.approach(self.command, wanted, interval_s));
        }
        let senses = self.senses(now_s)?;
        Some(guarded(&self.window(&limits, &senses.obstacles, interval_s), wanted))
    }

    /// The next step on the path; `None` without one, or if it is not known where the robot is.
    fn along_path(&mut self, now_s: f64, interval_s: f64) -> Option<Velocity> {
        let path = self.fresh(&self.path, now_s)?.clone();
        let senses = self.senses(now_s)?;
        let robot = senses.map_from_robot?;
        let limits = self.settings.limits;
        let window = self.window(&limits, &senses.obstacles, interval_s);
        if let Some(goal) = path.last()
            && robot.point().distance_m(goal.point()) <= self.settings.tolerance_m
        {
            return Some(self.face(wrap_angle(goal.yaw_rad - robot.yaw_rad), &window));
        }
        if let Some(escape) = self.recovery.step(robot, !path.is_empty(), &window, now_s) {
            return Some(limits.approach(self.command, escape, interval_s));
        }
        Some(self.follow(&path, robot, &window))
    }

    /// Where the robot is and what is around it; `None` without a fresh scan and odometry.
    fn senses(&self, now_s: f64) -> Option<Senses> {
        let scan = self.fresh(&self.scan, now_s)?;
        self.is_fresh(self.odometry_s, now_s).then_some(())?;
        let odom_from_then = self.track.odom_from_robot_at(scan.stamp_s)?;
        let now_from_then = self.track.odom_from_robot()?.inverse().compose(odom_from_then);
        let map_from_robot = self.track.map_from_robot();
        let map = self.map.as_ref().zip(map_from_robot);
        let reach_m = NEAR_M.max(self.settings.radius_m + self.settings.limits.stopping_m());
        let obstacles = surroundings(scan, now_from_then, map, reach_m);
        Some(Senses { map_from_robot, obstacles })
    }

    fn window<'a>(
        &self,
        limits: &'a Limits,
        obstacles: &'a [Point2],
        interval_s: f64,
    ) -> Window<'a> {
        let keep_m = self.settings.radius_m + self.settings.margin_m / 2.0;
        let distances = Distances { keep_m, comfort_m: keep_m + COMFORT_M };
        Window { limits, distances, obstacles, now: self.command, interval_s }
    }

    /// At the goal: turns to its heading, then stands.
    fn face(&mut self, off_rad: f64, window: &Window<'_>) -> Velocity {
        self.recovery.rest();
        if off_rad.abs() > HEADING_RAD { self.spin(off_rad, window) } else { Velocity::ZERO }
    }

    /// Drives on along the path; stands if there is none.
    fn follow(&mut self, path: &[Pose2], robot: Pose2, window: &Window<'_>) -> Velocity {
        let look_m = LOOK_M.max(window.limits.speed_mps * HORIZON_S);
        let clear_m = self.settings.radius_m + self.settings.margin_m;
        let robot_from_map = robot.inverse();
        let is_open = |point| window.is_way_clear(robot_from_map.apply(point), clear_m);
        let Some(lead) = lead(path, robot.point(), look_m, is_open) else {
            return Velocity::ZERO;
        };
        let target = robot_from_map.apply(lead.target);
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

    fn fresh<'a, T>(&self, received: &'a Option<Received<T>>, now_s: f64) -> Option<&'a T> {
        received.as_ref().filter(|it| self.is_fresh(it.at_s, now_s)).map(|it| &it.value)
    }

    /// What came in a future that time has gone back from is not fresh either.
    fn is_fresh(&self, at_s: f64, now_s: f64) -> bool {
        (now_s - at_s).abs() <= self.settings.timeout_s
    }
}

#[cfg(test)]
#[path = "driver_tests.rs"]
mod tests;
