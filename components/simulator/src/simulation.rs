//! The whole simulation, in fixed steps that know no wall clock: the same world, models, seed and
//! commands give the same outputs on every machine. The caller passes the time in; the simulation
//! catches up in steps and returns what its sensors measured meanwhile.

use crate::battery::{Battery, BatteryModel};
use crate::camera::CameraModel;
use crate::compass::{Compass, CompassModel};
use crate::contact::ContactSide;
use crate::drive::{Drive, DriveModel};
use crate::gps::{Gps, GpsModel};
use crate::imu::{Gyroscope, ImuModel};
use crate::laser::{Laser, LaserModel};
use crate::odometry::{OdometryModel, WheelOdometry};
use crate::people::{Crowd, Manners};
use crate::pose::{Portable, Pose2, wrap_angle};
pub use crate::reading::{BaseMotion, Rates, SensorReading, Stamped};
use crate::scene::{Body, BodyKind, WorldScene};
use crate::world::{World, WorldError};

/// Length of a simulation step, in seconds.
pub const STEP_S: f64 = 0.01;

/// Most time caught up in one call, in seconds: after a longer pause (a suspended machine, a
/// stopped process) simulated time jumps, instead of burning the processor to live through it.
pub const CATCH_UP_S: f64 = 0.5;

/// How many other robots may share the world.
pub const OTHERS: usize = 4;

/// Battery reports per second.
const BATTERY_RATE_HZ: f64 = 1.0;

/// Everything that can be set about a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Models {
    /// The laser.
    pub laser: LaserModel,
    /// The base.
    pub drive: DriveModel,
    /// The faults of the odometry.
    pub odometry: OdometryModel,
    /// The gyroscope.
    pub imu: ImuModel,
    /// The compass.
    pub compass: CompassModel,
    /// The satellite receiver.
    pub gps: GpsModel,
    /// The camera.
    pub camera: CameraModel,
    /// The battery.
    pub battery: BatteryModel,
    /// What people do.
    pub people: Manners,
    /// Rates of the sensors.
    pub rates: Rates,
    /// Seed of all noise.
    pub seed: u64,
}

/// A robot in a world.
pub struct Simulation {
    world: World,
    models: Models,
    drive: Drive,
    sensors: Sensors,
    battery: Battery,
    crowd: Crowd,
    /// The last reported poses of the other robots, in the map frame.
    others: [Option<Body>; OTHERS],
    /// All that moves, in the step just made.
    bodies: Vec<Body>,
    clock: Clock,
    /// Whether anything subscribes to the pictures.
    is_watched: bool,
    reported: Reported,
}

/// The sensors that have a state of their own.
struct Sensors {
    odometry: WheelOdometry,
    laser: Laser,
    gyroscope: Gyroscope,
    compass: Compass,
    gps: Gps,
}

/// Values already reported, which are reported again only when they change.
#[derive(Default)]
struct Reported {
    collisions: Option<u64>,
    contact: Option<Option<ContactSide>>,
}

/// Counts steps; only the time stamps depend on where the counting began.
struct Clock {
    epoch_s: f64,
    steps: u64,
}

impl Clock {
    fn time_s(&self) -> f64 {
        self.epoch_s + self.steps as f64 * STEP_S
    }

    fn set(&mut self, time_s: f64) {
        self.epoch_s = time_s - self.steps as f64 * STEP_S;
    }

    /// Whether something that happens at a rate happens in the step just made.
    fn is_due(&self, rate_hz: f64) -> bool {
        let count = |steps: u64| libm::floor(steps as f64 * STEP_S * rate_hz + 1e-6);
        count(self.steps) > count(self.steps.saturating_sub(1))
    }
}

impl Simulation {
    /// Puts the robot at the start of a world, at a time in seconds.
    ///
    /// # Errors
    /// The start is nearer to a wall than the radius of the base.
    pub fn new(world: World, models: Models, now_s: f64) -> Result<Self, WorldError> {
        world.check_start(models.drive.radius_m)?;
        let seed = models.seed;
        let sensors = Sensors {
            odometry: WheelOdometry::new(models.odometry, seed),
            laser: Laser::new(models.laser, seed),
            gyroscope: Gyroscope::new(models.imu, seed),
            compass: Compass::new(models.compass, seed),
            gps: Gps::new(models.gps, seed),
        };
        Ok(Self {
            drive: Drive::new(models.drive, seed),
            sensors,
            battery: Battery::new(models.battery),
            crowd: Crowd::new(world.routes(), models.people),
            others: [None; OTHERS],
            bodies: Vec::new(),
            clock: Clock { epoch_s: now_s, steps: 0 },
            is_watched: false,
            reported: Reported::default(),
            world,
            models,
        })
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Where the base really is: map_from_base.
    pub fn pose(&self) -> Pose2 {
        self.drive.pose()
    }

    /// The people and other robots, as of the last step.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Simulated time, in seconds on the caller's clock.
    pub fn time_s(&self) -> f64 {
        self.clock.time_s()
    }

    /// Takes a velocity command given at `given_s`; it counts from the next step until the command
    /// timeout. A time in the future counts as now, so that no command outlives its timeout.
    pub fn command(&mut self, speed_mps: f64, turn_radps: f64, given_s: f64, now_s: f64) {
        self.drive.command(speed_mps, turn_radps, given_s.min(now_s));
    }

    /// Stops the base immediately.
    pub fn halt(&mut self) {
        self.drive.halt();
    }

    /// Places another robot, by its pose on the sheet and its radius in metres. It stays there
    /// until the next call for it. An index of [`OTHERS`] or more is ignored.
    pub fn other_seen(&mut self, index: usize, sheet_from_other: Pose2, radius_m: f64) {
        let map_from_sheet = self.world.sheet_from_map().inverted();
        let (x_m, y_m) = map_from_sheet.point_from(sheet_from_other.x_m, sheet_from_other.y_m);
        if let Some(other) = self.others.get_mut(index) {
            *other = Some(Body { x_m, y_m, radius_m, kind: BodyKind::Robot });
        }
    }

    /// Sets whether anything subscribes to the pictures: only then are they taken at their rate,
    /// else one a second.
    pub fn watch(&mut self, is_watched: bool) {
        self.is_watched = is_watched;
    }

    /// Catches up with the time `now_s` and appends what the sensors measured, oldest first. When
    /// `now_s` is further away than [`CATCH_UP_S`], simulated time jumps there first.
    pub fn advance_to(&mut self, now_s: f64, readings: &mut Vec<Stamped>) {
        let behind_s = now_s - self.clock.time_s();
        if behind_s.abs() > CATCH_UP_S {
            self.clock.set(now_s - STEP_S);
        }
        while self.clock.time_s() + STEP_S <= now_s + 1e-6 {
            self.step(readings);
        }
    }

    /// Makes one step.
    pub fn step(&mut self, readings: &mut Vec<Stamped>) {
        self.clock.steps += 1;
        if self.battery.is_empty() {
            self.drive.release();
        }
        let before = self.drive.pose();
        self.crowd.walk_on(STEP_S, &self.robot_bodies(before));
        self.bodies.clear();
        self.bodies.extend(self.crowd.bodies().chain(self.others.into_iter().flatten()));
        let scene = WorldScene { world: &self.world, bodies: &self.bodies };
        self.drive.step(scene, self.clock.time_s(), STEP_S);
        let after = self.drive.pose();
        self.sensors.odometry.slipped(before, after, self.drive.lost(), STEP_S);
        self.battery.drain(STEP_S, libm::hypot(after.x_m - before.x_m, after.y_m - before.y_m));
        let turn_radps = wrap_angle(after.yaw_rad - before.yaw_rad) / STEP_S;
        self.report_contacts(readings);
        self.report_readings(turn_radps, readings);
    }

    /// All robots, this one first.
    fn robot_bodies(&self, here: Pose2) -> Vec<Body> {
        let radius_m = self.models.drive.radius_m;
        let own = Body { x_m: here.x_m, y_m: here.y_m, radius_m, kind: BodyKind::Robot };
        std::iter::once(own).chain(self.others.into_iter().flatten()).collect()
    }

    /// Reports collisions and the bumper's contact if they have changed.
    fn report_contacts(&mut self, readings: &mut Vec<Stamped>) {
        let time_s = self.clock.time_s();
        let collisions = self.drive.collisions();
        if self.reported.collisions.replace(collisions) != Some(collisions) {
            readings.push(Stamped { time_s, reading: SensorReading::Collisions(collisions) });
        }
        let contact = self.drive.contact(WorldScene { world: &self.world, bodies: &self.bodies });
        if self.reported.contact.replace(contact) != Some(contact) {
            readings.push(Stamped { time_s, reading: SensorReading::Bumper(contact) });
        }
    }

    /// Reads the sensors that are due: odometry before the scan of the same instant.
    fn report_readings(&mut self, turn_radps: f64, readings: &mut Vec<Stamped>) {
        let (clock, rates, drive) = (&self.clock, self.models.rates, &self.drive);
        let time_s = clock.time_s();
        let mut push = |reading| readings.push(Stamped { time_s, reading });
        let scene = WorldScene { world: &self.world, bodies: &self.bodies };
        let here = drive.pose();
        let sheet_from_base = self.world.sheet_from_map().then(here);
        let sensors = &mut self.sensors;
        if clock.is_due(rates.imu_hz) {
            push(SensorReading::Turn(sensors.gyroscope.read(turn_radps, 1.0 / rates.imu_hz)));
        }
        if clock.is_due(rates.odometry_hz) {
            let (speed_mps, turn_radps) = (drive.speed_mps(), drive.turn_radps());
            let motion = |pose| BaseMotion { pose, speed_mps, turn_radps };
            push(SensorReading::Odometry(motion(sensors.odometry.pose())));
            push(SensorReading::Truth(motion(here)));
            push(SensorReading::Presence(sheet_from_base));
        }
        if clock.is_due(rates.scan_hz) {
            push(SensorReading::Scan(sensors.laser.scan(scene, here)));
        }
        if clock.is_due(rates.compass_hz) {
            push(SensorReading::Heading(sensors.compass.read(sheet_from_base.yaw_rad)));
        }
        if clock.is_due(rates.gps_hz) {
            let Pose2 { x_m, y_m, .. } = sheet_from_base;
            push(SensorReading::Position(sensors.gps.read(x_m, y_m, 1.0 / rates.gps_hz)));
        }
        if clock.is_due(if self.is_watched { rates.camera_hz } else { rates.camera_hz.min(1.0) }) {
            push(SensorReading::Picture(self.models.camera.picture(scene, here)));
        }
        if clock.is_due(BATTERY_RATE_HZ) {
            let current_a = self.battery.current_a(drive.speed_mps());
            push(SensorReading::Battery { battery: self.battery.clone(), current_a });
        }
    }
}

#[cfg(test)]
#[path = "simulation_tests.rs"]
mod tests;
