//! How the base drives: differential, or steered like a car; acceleration limits, a command timeout
//! that always brings it to rest, wheels that slip.

use crate::contact::{Base, ContactSide};
use crate::pose::Pose2;
use crate::scene::WorldScene;
use crate::slip::{Slip, SlipModel};
use crate::steering::SteeringModel;

/// How the base turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DriveKind {
    /// Two driven wheels: it turns on the spot.
    #[default]
    Differential,
    /// Steered front wheels.
    Ackermann,
}

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
    /// How it turns.
    pub kind: DriveKind,
    /// How it steers, if it does.
    pub steering: SteeringModel,
    /// How its wheels slip.
    pub slip: SlipModel,
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
            kind: DriveKind::default(),
            steering: SteeringModel::default(),
            slip: SlipModel::default(),
        }
    }
}

/// A command counts until its age reaches the timeout.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DriveCommand {
    speed_mps: f64,
    turn_radps: f64,
    given_s: f64,
}

/// The base: where it is, how it moves, its last command.
#[derive(Clone, Debug)]
pub struct Drive {
    model: DriveModel,
    base: Base,
    speed_mps: f64,
    turn_radps: f64,
    /// Of the front wheels, to the left.
    steered_rad: f64,
    slip: Slip,
    /// Share of the wheels' turning that moved nothing in the last step.
    lost: f64,
    command: Option<DriveCommand>,
}

impl Drive {
    /// Makes a base at rest at the origin of the map; its wheels slip by a seed.
    pub fn new(model: DriveModel, seed: u64) -> Self {
        Self {
            model,
            base: Base::new(model.radius_m),
            speed_mps: 0.0,
            turn_radps: 0.0,
            steered_rad: 0.0,
            slip: Slip::new(model.slip, seed),
            lost: 0.0,
            command: None,
        }
    }

    /// Where the base is: map_from_base.
    pub fn pose(&self) -> Pose2 {
        self.base.pose
    }

    /// Speed of the wheels forward now, in metres per second.
    pub fn speed_mps(&self) -> f64 {
        self.speed_mps
    }

    /// Turn rate of the wheels now, anticlockwise, in radians per second.
    pub fn turn_radps(&self) -> f64 {
        self.turn_radps
    }

    /// Number of collisions of the base.
    pub fn collisions(&self) -> u64 {
        self.base.collisions
    }

    /// Share of the wheels' turning that moved nothing in the last step, 0 to 0.95.
    pub fn lost(&self) -> f64 {
        self.lost
    }

    /// The side on which something touches the base.
    pub fn contact(&self, scene: WorldScene<'_>) -> Option<ContactSide> {
        self.base.contact(scene)
    }

    /// Takes a command that was given at `given_s`; what is not a number counts as zero.
    pub fn command(&mut self, speed_mps: f64, turn_radps: f64, given_s: f64) {
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        self.command = Some(DriveCommand {
            speed_mps: finite(speed_mps),
            turn_radps: finite(turn_radps),
            given_s,
        });
    }

    /// Forgets the command: the base comes to rest.
    pub fn release(&mut self) {
        self.command = None;
    }

    /// Stands still immediately, as when the power is cut.
    pub fn halt(&mut self) {
        self.release();
        self.speed_mps = 0.0;
        self.turn_radps = 0.0;
    }

    /// Moves on by `step_s` seconds to the time `now_s`.
    pub fn step(&mut self, scene: WorldScene<'_>, now_s: f64, step_s: f64) {
        let (speed_mps, turn_radps) = self.wanted_motion(now_s);
        let DriveModel { acceleration_mps2, turn_acceleration_radps2, steering, .. } = self.model;
        self.speed_mps = step_toward(self.speed_mps, speed_mps, acceleration_mps2 * step_s);
        self.turn_radps = match self.model.kind {
            DriveKind::Differential => {
                step_toward(self.turn_radps, turn_radps, turn_acceleration_radps2 * step_s)
            }
            DriveKind::Ackermann => {
                let wanted_rad = steering.wanted_rad(speed_mps, turn_radps);
                self.steered_rad = step_toward(
                    self.steered_rad,
                    wanted_rad.unwrap_or(self.steered_rad),
                    steering.rate_radps * step_s,
                );
                steering.turn_radps(self.speed_mps, self.steered_rad)
            }
        };
        let is_moving = self.speed_mps != 0.0 || self.turn_radps != 0.0;
        self.lost = if is_moving { self.slip.share(step_s) } else { 0.0 };
        let moved_s = step_s * (1.0 - self.lost);
        if !self.base.travel_until_contact(
            scene,
            self.speed_mps * moved_s,
            self.turn_radps * moved_s,
        ) {
            self.speed_mps = 0.0;
        }
    }

    /// The velocities that count now: the command within the limits, or rest.
    fn wanted_motion(&self, now_s: f64) -> (f64, f64) {
        let fresh = |command: &DriveCommand| now_s - command.given_s < self.model.command_timeout_s;
        self.command.filter(fresh).map_or((0.0, 0.0), |command| {
            let DriveModel { max_speed_mps, max_turn_radps, .. } = self.model;
            (
                command.speed_mps.clamp(-max_speed_mps, max_speed_mps),
                command.turn_radps.clamp(-max_turn_radps, max_turn_radps),
            )
        })
    }
}

fn step_toward(value: f64, target: f64, most: f64) -> f64 {
    value + (target - value).clamp(-most, most)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;
    use crate::world::World;

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
            drive.step(WorldScene::from(world), now_s, STEP_S);
        }
    }

    #[test]
    fn it_speeds_up_within_its_limits() {
        let model = DriveModel { acceleration_mps2: 1.0, max_speed_mps: 0.5, ..Default::default() };
        let mut drive = Drive::new(model, 1);
        drive_for(&mut drive, &room(), 20, 9.0, 0.0);
        assert!((drive.speed_mps() - 0.2).abs() < 1e-9, "{}", drive.speed_mps());
        drive_for(&mut drive, &room(), 100, 9.0, 0.0);
        assert_eq!(drive.speed_mps(), 0.5);
    }

    #[test]
    fn it_drives_a_circle_back_to_where_it_began() {
        let model = DriveModel {
            acceleration_mps2: 1e6,
            turn_acceleration_radps2: 1e6,
            ..DriveModel::default()
        };
        let mut drive = Drive::new(model, 1);
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
        let mut drive = Drive::new(DriveModel::default(), 1);
        drive.command(0.6, 1.0, 0.0);
        let mut speeds = Vec::new();
        for step in 1..=150 {
            drive.step(WorldScene::from(&world), f64::from(step) * STEP_S, STEP_S);
            speeds.push(drive.speed_mps());
        }
        assert_eq!(speeds[48], 0.6, "the command counts for 0.5 s");
        // Braking takes 0.6 / 1.5 = 0.4 s from then on.
        assert!(speeds[50] < 0.6 && speeds[91] == 0.0, "{} {}", speeds[50], speeds[91]);
        assert_eq!((drive.speed_mps(), drive.turn_radps()), (0.0, 0.0));
    }

    #[test]
    fn a_command_that_is_no_number_is_rest() {
        let mut drive = Drive::new(DriveModel::default(), 1);
        drive_for(&mut drive, &room(), 50, f64::NAN, f64::INFINITY);
        assert_eq!(drive.pose(), Pose2::default());
    }

    #[test]
    fn it_stops_at_a_wall_and_counts_one_contact() {
        let world = room();
        let mut drive = Drive::new(DriveModel::default(), 1);
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
    fn steered_like_a_car_it_turns_only_while_it_rolls_and_no_tighter_than_it_can() {
        let steering = SteeringModel { wheelbase_m: 0.5, limit_rad: 0.5, rate_radps: 1.0 };
        let model = DriveModel { kind: DriveKind::Ackermann, steering, ..DriveModel::default() };
        let mut drive = Drive::new(model, 1);
        drive_for(&mut drive, &room(), 100, 0.0, 1.0);
        assert_eq!(drive.pose(), Pose2::default(), "it cannot turn on the spot");
        drive_for(&mut drive, &room(), 300, 0.5, 2.0);
        let tightest_radps = 0.5 * 0.5f64.tan() / 0.5;
        assert!((drive.turn_radps() - tightest_radps).abs() < 1e-9, "{}", drive.turn_radps());
        // The wheels take a second to come round to the other side.
        drive_for(&mut drive, &room(), 50, 0.5, -2.0);
        assert!(drive.turn_radps().abs() < 0.01, "{}", drive.turn_radps());
    }

    #[test]
    fn slipping_wheels_get_nowhere_and_say_by_how_much() {
        let slip = SlipModel { share: 0.25, ..SlipModel::default() };
        let mut plain = Drive::new(DriveModel::default(), 1);
        let mut slippery = Drive::new(DriveModel { slip, ..DriveModel::default() }, 1);
        for drive in [&mut plain, &mut slippery] {
            drive_for(drive, &room(), 200, 0.8, 0.0);
        }
        assert!((slippery.pose().x_m - 0.75 * plain.pose().x_m).abs() < 1e-9);
        assert_eq!((plain.lost(), slippery.lost()), (0.0, 0.25));
        drive_for(&mut slippery, &room(), 200, 0.0, 0.0);
        assert_eq!(slippery.lost(), 0.0, "what stands does not slip");
    }

    #[test]
    fn it_does_not_slide_along_a_wall() {
        let world = world(r#"<line x1="-9" y1="-1" x2="9" y2="-1"/>"#);
        let mut drive = Drive::new(DriveModel::default(), 1);
        drive.base.pose.yaw_rad = 0.8;
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
            let mut drive = Drive::new(model, 1);
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
            let mut drive = Drive::new(model, 1);
            drive.base.pose.yaw_rad = heading_rad;
            for (speed_mps, turn_radps) in commands {
                drive_for(&mut drive, &world, 30, speed_mps, turn_radps);
                let pose = drive.pose();
                prop_assert!(world.clearance_m(pose.x_m, pose.y_m) >= model.radius_m - 1e-6);
                prop_assert!(pose.x_m.abs() < 0.83 && pose.y_m.abs() < 0.83, "{:?}", pose);
            }
        }
    }
}
