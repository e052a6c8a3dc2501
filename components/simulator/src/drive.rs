//! A round base with differential drive: acceleration limits, a command timeout that always brings
//! it to rest, and walls that stop it.

use crate::pose::{Pose2, wrap_angle};
use crate::world::World;

/// How the base moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveModel {
    /// Radius of the round footprint, in metres.
    pub radius_m: f64,
    /// Fastest it drives, forward or back, in metres per second.
    pub max_speed_mps: f64,
    /// Fastest it turns, in radians per second.
    pub max_turn_radps: f64,
    /// Largest change of speed, in metres per second squared.
    pub acceleration_mps2: f64,
    /// Largest change of turn rate, in radians per second squared.
    pub turn_acceleration_radps2: f64,
    /// Age from which a command no longer counts, in seconds.
    pub command_timeout_s: f64,
}

impl Default for DriveModel {
    fn default() -> Self {
        Self {
            radius_m: 0.18,
            max_speed_mps: 1.0,
            max_turn_radps: 2.0,
            acceleration_mps2: 1.5,
            turn_acceleration_radps2: 6.0,
            command_timeout_s: 0.5,
        }
    }
}

/// How far the base must be off a wall before touching it again counts as another collision (metres).
const CONTACT_RELEASE_M: f64 = 0.02;

/// A command counts until its age reaches the timeout.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Command {
    speed_mps: f64,
    turn_radps: f64,
    given_s: f64,
}

/// The base: where it is, how it moves, what it was told.
#[derive(Clone, Debug)]
pub struct Drive {
    model: DriveModel,
    pose: Pose2,
    speed_mps: f64,
    turn_radps: f64,
    command: Option<Command>,
    is_touching: bool,
    collisions: u64,
}

impl Drive {
    /// Makes a base at rest at the origin of the map.
    pub fn new(model: DriveModel) -> Self {
        Self {
            model,
            pose: Pose2::default(),
            speed_mps: 0.0,
            turn_radps: 0.0,
            command: None,
            is_touching: false,
            collisions: 0,
        }
    }

    /// Where the base is: map_from_base.
    pub fn pose(&self) -> Pose2 {
        self.pose
    }

    /// Speed forward now, in metres per second.
    pub fn speed_mps(&self) -> f64 {
        self.speed_mps
    }

    /// Turn rate now, anticlockwise, in radians per second.
    pub fn turn_radps(&self) -> f64 {
        self.turn_radps
    }

    /// How often the base has run into something.
    pub fn collisions(&self) -> u64 {
        self.collisions
    }

    /// Takes a command that was given at `given_s`; what is not a number counts as zero.
    pub fn command(&mut self, speed_mps: f64, turn_radps: f64, given_s: f64) {
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        self.command =
            Some(Command { speed_mps: finite(speed_mps), turn_radps: finite(turn_radps), given_s });
    }

    /// Forgets the command: the base comes to rest.
    pub fn release(&mut self) {
        self.command = None;
    }

    /// Stands still at once, as when the power is cut.
    pub fn halt(&mut self) {
        self.release();
        self.speed_mps = 0.0;
        self.turn_radps = 0.0;
    }

    /// Moves on by `step_s` seconds to the time `now_s`.
    pub fn step(&mut self, world: &World, now_s: f64, step_s: f64) {
        let (speed_mps, turn_radps) = self.wanted(now_s);
        let DriveModel { acceleration_mps2, turn_acceleration_radps2, .. } = self.model;
        self.speed_mps = toward(self.speed_mps, speed_mps, acceleration_mps2 * step_s);
        self.turn_radps = toward(self.turn_radps, turn_radps, turn_acceleration_radps2 * step_s);
        self.travel(world, self.speed_mps * step_s, self.turn_radps * step_s);
    }

    /// The velocities that count now: the command within the limits, or rest.
    fn wanted(&self, now_s: f64) -> (f64, f64) {
        let fresh = |command: &Command| now_s - command.given_s < self.model.command_timeout_s;
        self.command.filter(fresh).map_or((0.0, 0.0), |command| {
            let DriveModel { max_speed_mps, max_turn_radps, .. } = self.model;
            (
                command.speed_mps.clamp(-max_speed_mps, max_speed_mps),
                command.turn_radps.clamp(-max_turn_radps, max_turn_radps),
            )
        })
    }

    /// Drives an arc of a given length and turn, as far as the walls let it. The arc is cut into
    /// pieces of a quarter radius: a base that is clear of a wall cannot be beyond it one piece later.
    fn travel(&mut self, world: &World, length_m: f64, turn_rad: f64) {
        let pieces = libm::ceil(length_m.abs() / (self.model.radius_m / 4.0)).max(1.0);
        for _ in 0..pieces as u32 {
            let next = along_arc(self.pose, length_m / pieces, turn_rad / pieces);
            if length_m == 0.0 || self.may_be(world, next) {
                self.pose = next;
            } else {
                self.run_into(world, length_m / pieces, turn_rad / pieces);
                break;
            }
        }
        let clearance_m = world.clearance_m(self.pose.x_m, self.pose.y_m);
        if clearance_m > self.model.radius_m + CONTACT_RELEASE_M {
            self.is_touching = false;
        }
    }

    /// Whether the base may be there: clear of the walls, or leaving one it touches.
    fn may_be(&self, world: &World, next: Pose2) -> bool {
        let clearance_m = world.clearance_m(next.x_m, next.y_m);
        clearance_m >= self.model.radius_m
            || clearance_m > world.clearance_m(self.pose.x_m, self.pose.y_m)
    }

    /// Stops at the wall: halves the way until the base touches it, and counts a new contact.
    fn run_into(&mut self, world: &World, length_m: f64, turn_rad: f64) {
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..10 {
            let share = f64::midpoint(free, blocked);
            let there = along_arc(self.pose, length_m * share, turn_rad * share);
            let is_free = world.clearance_m(there.x_m, there.y_m) >= self.model.radius_m;
            *(if is_free { &mut free } else { &mut blocked }) = share;
        }
        let stop = along_arc(self.pose, length_m * free, turn_rad * free);
        // Turning on the spot is free: the footprint is round.
        self.pose = Pose2 { yaw_rad: wrap_angle(self.pose.yaw_rad + turn_rad), ..stop };
        self.speed_mps = 0.0;
        self.collisions += u64::from(!self.is_touching);
        self.is_touching = true;
    }
}

fn toward(value: f64, target: f64, most: f64) -> f64 {
    value + (target - value).clamp(-most, most)
}

/// Where a pose ends up after an arc of a given length and turn.
fn along_arc(pose: Pose2, length_m: f64, turn_rad: f64) -> Pose2 {
    let half_rad = turn_rad / 2.0;
    let chord_m =
        if half_rad.abs() < 1e-9 { length_m } else { length_m * libm::sin(half_rad) / half_rad };
    let (sin, cos) = libm::sincos(pose.yaw_rad + half_rad);
    Pose2 {
        x_m: pose.x_m + chord_m * cos,
        y_m: pose.y_m + chord_m * sin,
        yaw_rad: wrap_angle(pose.yaw_rad + turn_rad),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;

    const STEP_S: f64 = 0.01;

    fn world(shapes: &str) -> World {
        let text = format!(r#"<svg>{shapes}<circle id="start"/></svg>"#);
        World::parse("world.svg", text.as_bytes()).expect("a readable world")
    }

    /// A box from −3 to 3 m.
    fn room() -> World {
        world(r#"<rect x="-3" y="-3" width="6" height="6"/>"#)
    }

    /// Drives with a command repeated at every step.
    fn drive_for(drive: &mut Drive, world: &World, steps: u32, speed_mps: f64, turn_radps: f64) {
        for step in 0..steps {
            let now_s = f64::from(step) * STEP_S;
            drive.command(speed_mps, turn_radps, now_s);
            drive.step(world, now_s, STEP_S);
        }
    }

    #[test]
    fn it_speeds_up_within_its_limits() {
        let model = DriveModel { acceleration_mps2: 1.0, max_speed_mps: 0.5, ..Default::default() };
        let mut drive = Drive::new(model);
        drive_for(&mut drive, &room(), 20, 9.0, 0.0);
        assert!((drive.speed_mps() - 0.2).abs() < 1e-9, "{}", drive.speed_mps());
        drive_for(&mut drive, &room(), 100, 9.0, 0.0);
        assert_eq!(drive.speed_mps(), 0.5);
    }

    #[test]
    fn it_drives_a_circle_back_to_where_it_began() {
        let mut drive = Drive::new(DriveModel {
            acceleration_mps2: 1e6,
            turn_acceleration_radps2: 1e6,
            ..DriveModel::default()
        });
        drive_for(&mut drive, &room(), 250, 0.5, FRAC_PI_2 / 2.5);
        // A quarter of a circle of radius 0.5 / (π / 5) after 2.5 s.
        let radius_m = 0.5 * 2.5 / FRAC_PI_2;
        assert!((drive.pose().x_m - radius_m).abs() < 1e-9, "{:?}", drive.pose());
        assert!((drive.pose().y_m - radius_m).abs() < 1e-9, "{:?}", drive.pose());
        drive_for(&mut drive, &room(), 750, 0.5, FRAC_PI_2 / 2.5);
        assert!(drive.pose().x_m.abs() < 1e-9 && drive.pose().y_m.abs() < 1e-9);
    }

    #[test]
    fn a_stale_command_brings_it_to_rest() {
        let world = room();
        let mut drive = Drive::new(DriveModel::default());
        drive.command(0.6, 1.0, 0.0);
        let mut speeds = Vec::new();
        for step in 1..=150 {
            drive.step(&world, f64::from(step) * STEP_S, STEP_S);
            speeds.push(drive.speed_mps());
        }
        assert_eq!(speeds[48], 0.6, "the command counts for 0.5 s");
        // Braking takes 0.6 / 1.5 = 0.4 s from then on.
        assert!(speeds[50] < 0.6 && speeds[91] == 0.0, "{} {}", speeds[50], speeds[91]);
        assert_eq!((drive.speed_mps(), drive.turn_radps()), (0.0, 0.0));
    }

    #[test]
    fn a_command_that_is_no_number_is_rest() {
        let mut drive = Drive::new(DriveModel::default());
        drive_for(&mut drive, &room(), 50, f64::NAN, f64::INFINITY);
        assert_eq!(drive.pose(), Pose2::default());
    }

    #[test]
    fn it_stops_at_a_wall_and_counts_one_contact() {
        let world = room();
        let mut drive = Drive::new(DriveModel::default());
        drive_for(&mut drive, &world, 1000, 1.0, 0.0);
        let gap_m = 3.0 - drive.pose().x_m - 0.18;
        assert!((0.0..0.001).contains(&gap_m), "{gap_m}");
        assert_eq!(drive.collisions(), 1);
        // It may turn there and leave, and run into it again.
        drive_for(&mut drive, &world, 100, -0.5, 0.0);
        assert!(drive.pose().x_m < 2.7, "{:?}", drive.pose());
        drive_for(&mut drive, &world, 300, 1.0, 0.0);
        assert_eq!(drive.collisions(), 2);
    }

    #[test]
    fn it_does_not_slide_along_a_wall() {
        let world = world(r#"<line x1="-9" y1="-1" x2="9" y2="-1"/>"#);
        let mut drive = Drive::new(DriveModel::default());
        drive.pose.yaw_rad = 0.8;
        drive_for(&mut drive, &world, 300, 1.0, 0.0);
        let touched = drive.pose();
        drive_for(&mut drive, &world, 300, 1.0, 0.0);
        assert!((drive.pose().x_m - touched.x_m).abs() < 0.001, "{:?}", drive.pose());
    }

    #[test]
    fn a_thin_wall_holds_at_any_speed() {
        let world = world(r#"<line x1="1" y1="-50" x2="1" y2="50"/>"#);
        for max_speed_mps in [1.0, 5.0, 50.0, 500.0] {
            let model =
                DriveModel { max_speed_mps, acceleration_mps2: 1e9, ..DriveModel::default() };
            let mut drive = Drive::new(model);
            drive_for(&mut drive, &world, 50, max_speed_mps, 0.0);
            assert!(drive.pose().x_m <= 0.82, "{max_speed_mps}: {:?}", drive.pose());
        }
    }

    proptest! {
        /// However it is driven, the base stays inside and clear of the walls.
        #[test]
        fn it_never_enters_a_wall(
            commands in proptest::collection::vec((-5.0..5.0f64, -4.0..4.0f64), 1..20),
            heading_rad in 0.0..TAU,
        ) {
            let world = world(
                r#"<rect x="-1" y="-1" width="2" height="2"/><circle cx="0.6" cy="0.6" r="0.1"/>"#,
            );
            let model =
                DriveModel { max_speed_mps: 5.0, acceleration_mps2: 50.0, ..DriveModel::default() };
            let mut drive = Drive::new(model);
            drive.pose.yaw_rad = heading_rad;
            for (speed_mps, turn_radps) in commands {
                drive_for(&mut drive, &world, 30, speed_mps, turn_radps);
                let pose = drive.pose();
                prop_assert!(world.clearance_m(pose.x_m, pose.y_m) >= model.radius_m - 1e-6);
                prop_assert!(pose.x_m.abs() < 0.83 && pose.y_m.abs() < 0.83, "{:?}", pose);
            }
        }
    }
}
