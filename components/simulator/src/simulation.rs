//! The whole simulation, in fixed steps that know no wall clock: the same world, models, seed and
//! commands give the same outputs on every machine. Whoever runs it says what time it is; the
//! simulation catches up in steps and hands back what its sensors said on the way.

use crate::battery::{Battery, BatteryModel};
use crate::drive::{Drive, DriveModel};
use crate::laser::LaserModel;
use crate::odometry::{Odometry, OdometryModel};
use crate::pose::Pose2;
use crate::random::{Random, Stream};
use crate::world::{DrawingError, World};

/// Length of a simulation step, in seconds.
pub const STEP_S: f64 = 0.01;

/// Most time caught up at once, in seconds: after a longer pause (a suspended machine, a stopped
/// process) simulated time jumps, instead of burning the processor to live through it.
pub const CATCH_UP_S: f64 = 0.5;

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
    /// The battery.
    pub battery: BatteryModel,
    /// How often the sensors report.
    pub rates: Rates,
    /// Seed of all noise.
    pub seed: u64,
}

/// How often the sensors report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Scans per second.
    pub scan_hz: f64,
    /// Odometry and truth per second.
    pub odometry_hz: f64,
}

impl Default for Rates {
    fn default() -> Self {
        Self { scan_hz: 10.0, odometry_hz: 20.0 }
    }
}

/// Where the base is and how it moves, at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// The pose, in the frame of whoever says it.
    pub pose: Pose2,
    /// Speed forward, in metres per second.
    pub speed_mps: f64,
    /// Turn rate, in radians per second.
    pub turn_radps: f64,
}

/// What a sensor says.
#[derive(Clone, Debug, PartialEq)]
pub enum Reading {
    /// The wheels: odom_from_base.
    Odometry(Motion),
    /// The exact motion: map_from_base.
    Truth(Motion),
    /// Ranges from right to left, in metres; +∞ and NaN mean nothing seen.
    Scan(Vec<f32>),
    /// The battery, and its current in amperes.
    Battery {
        /// The battery now.
        battery: Battery,
        /// Its current, negative when discharging.
        current_a: f64,
    },
    /// Collisions so far, at the start and after each one.
    Collisions(u64),
}

/// A reading and its time, on the clock of whoever runs the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Stamped {
    /// When it was taken, in seconds.
    pub time_s: f64,
    /// What it says.
    pub reading: Reading,
}

/// A robot in a world.
pub struct Simulation {
    world: World,
    models: Models,
    drive: Drive,
    odometry: Odometry,
    battery: Battery,
    laser_random: Random,
    clock: Clock,
    reported_collisions: Option<u64>,
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
    pub fn new(world: World, models: Models, now_s: f64) -> Result<Self, DrawingError> {
        world.check_start(models.drive.radius_m)?;
        Ok(Self {
            drive: Drive::new(models.drive),
            odometry: Odometry::new(models.odometry, models.seed),
            battery: Battery::new(models.battery),
            laser_random: Random::new(models.seed, Stream::Laser),
            clock: Clock { epoch_s: now_s, steps: 0 },
            reported_collisions: None,
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

    /// Simulated time, in seconds on the clock of whoever runs it.
    pub fn time_s(&self) -> f64 {
        self.clock.time_s()
    }

    /// Takes a velocity command given at `given_s`; it counts from the next step until the command
    /// timeout. A time in the future counts as now, so that no command outlives its timeout.
    pub fn command(&mut self, speed_mps: f64, turn_radps: f64, given_s: f64, now_s: f64) {
        self.drive.command(speed_mps, turn_radps, given_s.min(now_s));
    }

    /// Puts the base to rest at once.
    pub fn halt(&mut self) {
        self.drive.halt();
    }

    /// Catches up with the time `now_s` and appends what the sensors said, oldest first. When
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
        self.drive.step(&self.world, self.clock.time_s(), STEP_S);
        let after = self.drive.pose();
        self.odometry.moved(before, after, STEP_S);
        self.battery.drain(STEP_S, libm::hypot(after.x_m - before.x_m, after.y_m - before.y_m));
        self.report(readings);
    }

    /// Reads the sensors that are due: odometry before the scan of the same instant.
    fn report(&mut self, readings: &mut Vec<Stamped>) {
        let time_s = self.clock.time_s();
        let mut say = |reading| readings.push(Stamped { time_s, reading });
        let collisions = self.drive.collisions();
        if self.reported_collisions != Some(collisions) {
            self.reported_collisions = Some(collisions);
            say(Reading::Collisions(collisions));
        }
        if self.clock.is_due(self.models.rates.odometry_hz) {
            let (speed_mps, turn_radps) = (self.drive.speed_mps(), self.drive.turn_radps());
            let motion = |pose| Motion { pose, speed_mps, turn_radps };
            say(Reading::Odometry(motion(self.odometry.pose())));
            say(Reading::Truth(motion(self.drive.pose())));
        }
        if self.clock.is_due(self.models.rates.scan_hz) {
            let laser = &self.models.laser;
            say(Reading::Scan(laser.scan(&self.world, self.drive.pose(), &mut self.laser_random)));
        }
        if self.clock.is_due(BATTERY_RATE_HZ) {
            let current_a = self.battery.current_a(self.drive.speed_mps());
            say(Reading::Battery { battery: self.battery.clone(), current_a });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: &[u8] = br#"<svg><rect x="-3" y="-3" width="6" height="6"/>
        <circle cx="1.5" cy="1.5" r="0.3"/><circle id="start"/></svg>"#;

    fn simulation(models: Models, now_s: f64) -> Simulation {
        let world = World::parse("room.svg", ROOM).expect("a readable world");
        Simulation::new(world, models, now_s).expect("a free start")
    }

    /// Runs 20 s in ticks of a given length, turning and driving, and gives back all readings.
    fn run(seed: u64, epoch_s: f64, tick_s: f64) -> Vec<Stamped> {
        let mut simulation = simulation(Models { seed, ..Models::default() }, epoch_s);
        let mut readings = Vec::new();
        let ticks = (20.0 / tick_s).round() as u32;
        for tick in 1..=ticks {
            let now_s = epoch_s + f64::from(tick) * tick_s;
            simulation.advance_to(now_s, &mut readings);
            simulation.command(0.6, 0.3, now_s, now_s);
        }
        readings
    }

    /// The readings as text without their times (NaN equals NaN there).
    fn said(readings: &[Stamped]) -> Vec<String> {
        readings.iter().map(|stamped| format!("{:?}", stamped.reading)).collect()
    }

    #[test]
    fn a_seed_repeats_the_whole_run_at_any_time_of_day() {
        let first = said(&run(3, 0.0, 0.05));
        assert_eq!(first, said(&run(3, 0.0, 0.05)));
        assert_eq!(first, said(&run(3, 1_795_000_000.0, 0.05)));
        assert_ne!(first, said(&run(4, 0.0, 0.05)));
    }

    #[test]
    fn sensors_report_at_their_rates_with_exact_stamps() {
        let readings = run(1, 100.0, 0.05);
        let times = |wanted: fn(&Reading) -> bool| -> Vec<f64> {
            readings.iter().filter(|s| wanted(&s.reading)).map(|s| s.time_s).collect()
        };
        let scans = times(|r| matches!(r, Reading::Scan(_)));
        let odometry = times(|r| matches!(r, Reading::Odometry(_)));
        assert_eq!(scans.len(), 200);
        assert_eq!(odometry.len(), 400);
        assert_eq!(times(|r| matches!(r, Reading::Truth(_))), odometry);
        assert_eq!(times(|r| matches!(r, Reading::Battery { .. })).len(), 20);
        assert!(scans.windows(2).all(|pair| (pair[1] - pair[0] - 0.1).abs() < 1e-9));
        assert!(scans.iter().all(|scan| odometry.contains(scan)), "each scan has its odometry");
    }

    #[test]
    fn odometry_comes_before_the_scan_of_its_instant() {
        let readings = run(1, 0.0, 0.05);
        let scan = readings.iter().position(|s| matches!(s.reading, Reading::Scan(_)));
        let before = &readings[..scan.expect("a scan")];
        let time_s = readings[before.len()].time_s;
        assert!(
            before
                .iter()
                .any(|s| { s.time_s == time_s && matches!(s.reading, Reading::Odometry(_)) })
        );
    }

    #[test]
    fn collisions_are_said_at_first_and_when_they_happen() {
        let mut simulation = simulation(Models::default(), 0.0);
        let mut readings = Vec::new();
        for tick in 1..=200 {
            let now_s = f64::from(tick) * 0.05;
            simulation.command(1.0, 0.0, now_s, now_s);
            simulation.advance_to(now_s, &mut readings);
        }
        let counts: Vec<u64> = readings
            .iter()
            .filter_map(
                |s| if let Reading::Collisions(count) = s.reading { Some(count) } else { None },
            )
            .collect();
        assert_eq!(counts, [0, 1]);
    }

    #[test]
    fn without_commands_the_base_comes_to_rest_whatever_the_clock_does() {
        let mut simulation = simulation(Models::default(), 0.0);
        let mut readings = Vec::new();
        simulation.command(1.0, 0.0, 1e12, 0.0);
        simulation.advance_to(0.4, &mut readings);
        assert!(simulation.pose().x_m > 0.1, "it drives: {:?}", simulation.pose());
        // The process is stopped for a minute; then it runs on.
        for tick in 0..40 {
            simulation.advance_to(60.0 + f64::from(tick) * 0.05, &mut readings);
        }
        let rest = simulation.pose();
        assert!(rest.x_m < 0.5, "braked as soon as it ran on: {rest:?}");
        simulation.advance_to(62.4, &mut readings);
        assert_eq!(simulation.pose(), rest);
    }

    #[test]
    fn a_clock_that_jumps_costs_no_time_to_catch_up_with() {
        let mut simulation = simulation(Models::default(), 0.0);
        let mut readings = Vec::new();
        for now_s in [1e6, 1e9, 5.0, -3600.0] {
            simulation.advance_to(now_s, &mut readings);
            assert!((simulation.time_s() - now_s).abs() < 1e-3, "{now_s}");
        }
        assert!(readings.len() < 20, "{}", readings.len());
    }

    #[test]
    fn an_empty_battery_ends_all_driving() {
        let battery = BatteryModel { initial_level: 0.001, endurance_s: 1000.0, range_m: 1e9 };
        let mut simulation = simulation(Models { battery, ..Models::default() }, 0.0);
        let mut readings = Vec::new();
        for tick in 1..=100 {
            let now_s = f64::from(tick) * 0.05;
            simulation.command(0.3, 0.0, now_s, now_s);
            simulation.advance_to(now_s, &mut readings);
        }
        let x_m = simulation.pose().x_m;
        assert!((0.2..0.5).contains(&x_m), "a second of driving, then braking: {x_m}");
    }
}
