//! One step of driving: the input that has priority, the robot's pose, and the velocity that
//! follows from them.
//! Time is passed in: there is no clock.

use std::sync::Arc;

use armor_grid::{Grid, Occupancy, Point2, Pose2, wrap_angle};
use armor_zones::ZoneMap;

use crate::follower::lead_point;
use crate::guard::guard_velocity;
use crate::limits::{DriveLimits, LONGEST_S, REACTION_S, Velocity};
use crate::phase::DrivingPhase;
use crate::recovery::StuckRecovery;
use crate::surroundings::{DriverScan, list_obstacles};
use crate::track::PoseTrack;
use crate::window::{Distances, DynamicWindow, HORIZON_S};
use crate::zones_around::{ZonesAround, cut_path, fastest_mps};

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
/// Things further away than this touch no arc that is tried, in metres, unless the base takes
/// longer to stop.
const NEAR_M: f64 = 1.5;
/// Arcs that stay further than this from everything are not better for it, in metres.
const COMFORT_M: f64 = 0.15;

/// What the robot is and how it shall drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverSettings {
    /// What the base can do.
    pub limits: DriveLimits,
    /// Radius of the circle around the robot's centre that encloses it, in metres.
    pub radius_m: f64,
    /// Kept free around it, in metres.
    pub margin_m: f64,
    /// The end of a path is reached within this, in metres.
    pub tolerance_m: f64,
    /// Paths, scans, odometry and manual velocities older than this are ignored, in seconds.
    pub timeout_s: f64,
    /// Whether manual velocities are limited so that the robot stops before what the laser sees.
    pub guarded: bool,
}

/// The state of driving.
#[derive(Debug)]
pub struct Driving {
    settings: DriverSettings,
    track: PoseTrack,
    recovery: StuckRecovery,
    map: Option<Grid<Occupancy>>,
    zones: Arc<ZoneMap>,
    /// Whether it is known where the robot may be.
    are_zones_known: bool,
    /// The zone that the path leads into, if the robot stands before it.
    zone_ahead: Option<String>,
    path: Option<Received<Vec<Pose2>>>,
    manual: Option<Received<Velocity>>,
    is_stopped: bool,
    scan: Option<Received<DriverScan>>,
    odometry_s: f64,
    command: Velocity,
    stepped_s: f64,
    spinning: bool,
    phase: DrivingPhase,
}

/// Something and when it came.
#[derive(Clone, Debug)]
struct Received<T> {
    at_s: f64,
    value: T,
}

/// Where the robot is and what is around it now.
struct DriverSenses {
    map_from_robot: Option<Pose2>,
    /// Everything near, in the robot's frame.
    obstacles: Vec<Point2>,
}

impl Driving {
    /// Starts with nothing known, at rest.
    pub fn new(settings: DriverSettings) -> Self {
        Self {
            settings,
            track: PoseTrack::default(),
            recovery: StuckRecovery::default(),
            map: None,
            zones: Arc::default(),
            are_zones_known: true,
            zone_ahead: None,
            path: None,
            manual: None,
            is_stopped: false,
            scan: None,
            odometry_s: f64::NEG_INFINITY,
            command: Velocity::ZERO,
            stepped_s: f64::NEG_INFINITY,
            spinning: false,
            phase: DrivingPhase::Idle,
        }
    }

    /// Resets the state. Only the map, the zones and the order to stand are kept: they are not sent
    /// again.
    pub fn reset_state(&mut self, settings: DriverSettings) {
        let (map, zones) = (self.map.take(), std::mem::take(&mut self.zones));
        let (is_stopped, are_zones_known) = (self.is_stopped, self.are_zones_known);
        *self = Self { map, zones, is_stopped, are_zones_known, ..Self::new(settings) };
    }

    /// Takes the newest zones, replacing those before.
    pub fn zones_seen(&mut self, zones: ZoneMap) {
        self.zones = Arc::new(zones);
    }

    /// Takes whether the zones of the robot's frame are known. While they are not, no path is
    /// followed.
    pub fn set_zones_known(&mut self, are_known: bool) {
        self.are_zones_known = are_known;
    }

    /// Returns the zone that the path leads into, if the robot stands before it.
    pub fn zone_ahead(&self) -> Option<&str> {
        self.zone_ahead.as_deref()
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

    /// Takes a scan that arrived at `now_s`. One without any range, as of a covered laser, is
    /// ignored.
    pub fn scan_seen(&mut self, now_s: f64, scan: DriverScan) {
        if scan.has_ranges() {
            self.scan = Some(Received { at_s: now_s, value: scan });
        }
    }

    /// Takes a path on the map that came at `now_s`: from the robot to the goal, with its heading
    /// at the end; empty if no path exists. One that is not finite counts as empty.
    pub fn path_seen(&mut self, now_s: f64, mut path: Vec<Pose2>) {
        if !path.iter().all(|pose| pose.is_finite()) {
            path.clear();
        }
        self.path = Some(Received { at_s: now_s, value: path });
    }

    /// Takes a manual velocity that arrived at `now_s`; it has priority over the path. A velocity
    /// that is not finite counts as zero.
    pub fn manual_seen(&mut self, now_s: f64, mut wanted: Velocity) {
        if !(wanted.speed_mps.is_finite() && wanted.turn_radps.is_finite()) {
            wanted = Velocity::ZERO;
        }
        self.manual = Some(Received { at_s: now_s, value: wanted });
    }

    /// Takes the order to stand, which has priority over every other input, or its end.
    pub fn stop_seen(&mut self, is_stopped: bool) {
        self.is_stopped = is_stopped;
    }

    /// Forgets where to drive; the next step stands still.
    pub fn forget_orders(&mut self) {
        (self.path, self.manual) = (None, None);
    }

    /// Forgets the path; the next step stands still unless a manual velocity is fresh.
    pub fn forget_path(&mut self) {
        self.path = None;
    }

    /// Forgets everything that lies in the map frame: its origin is another place.
    pub fn forget_frame(&mut self) {
        (self.path, self.map) = (None, None);
        self.track.forget_map();
        self.recovery = StuckRecovery::default();
    }

    /// Decides at time `now_s` how to move. The robot rests if it is ordered to stand, if neither a
    /// path nor a manual velocity is fresh, or if it has no fresh scan.
    pub fn step(&mut self, now_s: f64) -> Velocity {
        let interval_s = (now_s - self.stepped_s).clamp(0.02, LONGEST_S);
        self.stepped_s = now_s;
        self.zone_ahead = None;
        let wanted = self.fresh_value(&self.manual, now_s).copied();
        self.command = if self.is_stopped {
            self.phase = DrivingPhase::Stopped;
            None
        } else if let Some(wanted) = wanted {
            self.phase = DrivingPhase::Manual;
            self.follow_manual_velocity(wanted, now_s, interval_s)
        } else {
            self.phase = DrivingPhase::Idle;
            self.continue_path(now_s, interval_s)
        }
        .unwrap_or_else(|| self.rest());
        self.command
    }

    /// Returns what the robot did in the last step.
    pub fn phase(&self) -> DrivingPhase {
        self.phase
    }

    fn rest(&mut self) -> Velocity {
        self.recovery.rest();
        self.spinning = false;
        Velocity::ZERO
    }

    /// The manual velocity within what the base can do and, if guarded, what is safe; `None` if
    /// safety cannot be judged.
    fn follow_manual_velocity(
        &mut self,
        wanted: Velocity,
        now_s: f64,
        interval_s: f64,
    ) -> Option<Velocity> {
        self.rest();
        let limits = self.settings.limits;
        let wanted = limits.limit_velocity(wanted);
        if !self.settings.guarded {
            return Some(limits.approach_velocity(self.command, wanted, interval_s));
        }
        let Some(senses) = self.gather_senses(now_s) else {
            self.phase = DrivingPhase::Blind;
            return None;
        };
        let zones = Arc::clone(&self.zones);
        let around = self.zones_around(&zones, senses.map_from_robot);
        let window = self.build_window(&limits, &senses.obstacles, around.as_ref(), interval_s);
        let fastest_mps = self.zone_speed_mps(senses.map_from_robot);
        let speed_mps = wanted.speed_mps.clamp(-fastest_mps, fastest_mps);
        Some(guard_velocity(&window, Velocity { speed_mps, ..wanted }))
    }

    /// The next step on the path; `None` without one, or if it is not known where the robot is.
    fn continue_path(&mut self, now_s: f64, interval_s: f64) -> Option<Velocity> {
        let path = self.fresh_value(&self.path, now_s)?.clone();
        if !self.are_zones_known {
            self.phase = DrivingPhase::WithoutZones;
            return None;
        }
        self.phase = DrivingPhase::Blind;
        let senses = self.gather_senses(now_s)?;
        let robot = senses.map_from_robot?;
        let limits = self.settings.limits;
        let zones = Arc::clone(&self.zones);
        let around = self.zones_around(&zones, senses.map_from_robot);
        let window = self.build_window(&limits, &senses.obstacles, around.as_ref(), interval_s);
        let tolerance_m = self.settings.tolerance_m;
        let is_at = |pose: &Pose2| robot.point().distance_m(pose.point()) <= tolerance_m;
        if let Some(goal) = path.last().filter(|goal| is_at(goal)) {
            self.phase = DrivingPhase::AtGoal;
            return Some(self.face_target(wrap_angle(goal.yaw_rad - robot.yaw_rad), &window));
        }
        let cut = cut_path(&zones, &path, robot.point(), self.settings.radius_m);
        let path = &path[..cut.as_ref().map_or(path.len(), |(count, _)| *count)];
        if let Some((_, zone)) = cut
            && path.last().is_none_or(is_at)
        {
            self.phase = DrivingPhase::AtZone;
            self.zone_ahead = Some(zone);
            self.recovery.rest();
            return Some(limits.brake_velocity(self.command, interval_s));
        }
        if let Some(escape) = self.recovery.step(robot, !path.is_empty(), &window, now_s) {
            self.phase = DrivingPhase::Escaping;
            let fastest_mps = self.zone_speed_mps(Some(robot));
            let speed_mps = escape.speed_mps.clamp(-fastest_mps, fastest_mps);
            let escape = Velocity { speed_mps, ..escape };
            return Some(limits.approach_velocity(self.command, escape, interval_s));
        }
        Some(self.follow_path(path, robot, &window))
    }

    /// Where the robot is and what is around it; `None` without a fresh scan and odometry.
    fn gather_senses(&self, now_s: f64) -> Option<DriverSenses> {
        let scan = self.fresh_value(&self.scan, now_s)?;
        self.is_fresh(self.odometry_s, now_s).then_some(())?;
        let odom_from_then = self.track.odom_from_robot_at(scan.stamp_s)?;
        let now_from_then = self.track.odom_from_robot()?.inverse().compose(odom_from_then);
        let map_from_robot = self.track.map_from_robot();
        let map = self.map.as_ref().zip(map_from_robot);
        let obstacles = list_obstacles(scan, now_from_then, map, self.reach_m());
        Some(DriverSenses { map_from_robot, obstacles })
    }

    /// What is further from the robot does not matter to the next step, in metres.
    fn reach_m(&self) -> f64 {
        NEAR_M.max(self.settings.radius_m + self.settings.limits.stopping_m())
    }

    fn zones_around<'a>(
        &self,
        zones: &'a ZoneMap,
        map_from_robot: Option<Pose2>,
    ) -> Option<ZonesAround<'a>> {
        Some(ZonesAround::new(zones, map_from_robot?, self.reach_m()))
    }

    /// How fast the robot may be where it is; infinite if that is not known.
    fn zone_speed_mps(&self, map_from_robot: Option<Pose2>) -> f64 {
        let Some(robot) = map_from_robot else { return f64::INFINITY };
        let DriverSettings { radius_m, limits, .. } = &self.settings;
        fastest_mps(&self.zones, robot.point(), *radius_m, self.command.speed_mps, limits)
    }

    fn build_window<'a>(
        &self,
        limits: &'a DriveLimits,
        obstacles: &'a [Point2],
        zones: Option<&'a ZonesAround<'a>>,
        interval_s: f64,
    ) -> DynamicWindow<'a> {
        let keep_m = self.settings.radius_m + self.settings.margin_m / 2.0;
        let distances = Distances { keep_m, comfort_m: keep_m + COMFORT_M };
        DynamicWindow { limits, distances, obstacles, zones, now: self.command, interval_s }
    }

    /// At the goal: turns to its heading, then stands.
    fn face_target(&mut self, off_rad: f64, window: &DynamicWindow<'_>) -> Velocity {
        self.recovery.rest();
        if off_rad.abs() > HEADING_RAD { self.spin_by(off_rad, window) } else { Velocity::ZERO }
    }

    /// Drives on along the path; stands if there is none.
    fn follow_path(
        &mut self,
        path: &[Pose2],
        robot: Pose2,
        window: &DynamicWindow<'_>,
    ) -> Velocity {
        let look_m = LOOK_M.max(window.limits.speed_mps * HORIZON_S);
        let clear_m = self.settings.radius_m + self.settings.margin_m;
        let robot_from_map = robot.inverse();
        let is_open = |point| window.is_way_clear(robot_from_map.apply(point), clear_m);
        let Some(lead) = lead_point(path, robot.point(), look_m, is_open) else {
            self.phase = DrivingPhase::WithoutPath;
            return Velocity::ZERO;
        };
        self.phase = DrivingPhase::Following { to_go_m: lead.remaining_m };
        let target = robot_from_map.apply(lead.target);
        let bearing_rad = Point2::default().bearing_rad(target);
        let was_spinning = self.spinning;
        self.spinning = bearing_rad.abs() > if was_spinning { SPUN_RAD } else { SPIN_RAD };
        if was_spinning && !self.spinning {
            self.recovery.turned_to_path(robot, self.stepped_s);
        }
        if self.spinning {
            return self.spin_by(bearing_rad, window);
        }
        let limits = window.limits;
        // Slow enough to stop at the end of the path.
        let stopping_mps = (limits.acceleration_mps2 * lead.remaining_m).sqrt();
        let fastest_mps = limits.speed_mps.min(stopping_mps).max(0.05);
        let fastest_mps = fastest_mps.min(self.zone_speed_mps(Some(robot)));
        match window.choose_velocity(target, fastest_mps) {
            Some(velocity) if velocity.speed_mps > 0.01 => velocity,
            // Nothing but standing is safe: look for an opening towards the target.
            _ => self.spin_by(bearing_rad, window),
        }
    }

    /// Turns on the spot. A base that still rolls is brought to rest first, on the arc it is on:
    /// that one was found to be free, others only where nothing is near.
    fn spin_by(&self, off_rad: f64, window: &DynamicWindow<'_>) -> Velocity {
        let limits = window.limits;
        // By the time this takes effect, the robot has turned on.
        let left_rad = off_rad - window.now.turn_radps * REACTION_S / 2.0;
        let braking_radps =
            (2.0 * SPIN_BRAKE * limits.turn_acceleration_radps2 * left_rad.abs()).sqrt();
        let turn_radps = braking_radps.min(limits.turn_radps) * left_rad.signum();
        let wanted = Velocity::spin(turn_radps);
        if !window.is_room_to_stop() {
            return limits.brake_velocity(window.now, window.interval_s);
        }
        let mut next = limits.approach_velocity(window.now, wanted, window.interval_s);
        if !window.is_safe(next) {
            next.speed_mps = 0.0;
        }
        next
    }

    fn fresh_value<'a, T>(&self, received: &'a Option<Received<T>>, now_s: f64) -> Option<&'a T> {
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
