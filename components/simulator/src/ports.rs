//! The simulator as a component: its parameters, its ports, and the messages they carry.

use std::path::PathBuf;

use armor_sdk::prelude::*;

use crate::battery::Battery;
use crate::laser::{LaserModel, RANGE_MIN_M};
use crate::pace::Pace;
use crate::pose::Pose2;
use crate::simulation::{CATCH_UP_S, Models, Motion, Reading, STEP_S, Simulation, Stamped};
use crate::world::World;

/// Simulates a robot with a laser, wheels and a battery in a drawn world.
pub struct Simulator {
    armor: Armor,
    world: PathBuf,
    models: Models,
    battery_warning: f64,
    has_warned: bool,
    speed: f64,
    /// The world, and how fast time passes in it.
    running: Option<(Simulation, Pace)>,
    clock: ClockOutput,
}

/// The time as it was said last.
#[derive(Default)]
struct ClockOutput {
    said_s: Option<f64>,
    /// Somebody's time follows it.
    is_followed: bool,
    has_warned: bool,
}

impl Component for Simulator {
    const KIND: &'static str = "simulator";
    const SUMMARY: &'static str = "Simulates a robot with a laser, wheels and a battery in a world \
                                   drawn as SVG.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::path("world").doc("SVG drawing of the world, 1 user unit = 1 m"),
        Parameter::integer("seed").default("1").range(0.0, 9e15).doc("seed of all noise"),
        Parameter::integer("beams").default("271").range(2.0, 10_000.0).doc("beams of a scan"),
        Parameter::number("field_of_view", "deg")
            .default("270deg")
            .range(0.01, 6.284)
            .doc("angle from the first to the last beam"),
        Parameter::number("range", "m").default("10m").range(0.1, 500.0).doc("farthest range"),
        Parameter::number("laser_sigma", "m")
            .default("0.01m")
            .range(0.0, 10.0)
            .doc("standard deviation of a range"),
        Parameter::number("laser_dropout", "")
            .default("0.002")
            .range(0.0, 1.0)
            .doc("share of beams that are lost"),
        Parameter::number("laser_x", "m")
            .default("0.08m")
            .range(-10.0, 10.0)
            .doc("laser ahead of the middle of the base"),
        Parameter::number("laser_y", "m")
            .default("0m")
            .range(-10.0, 10.0)
            .doc("laser left of the middle of the base"),
        Parameter::number("laser_theta", "deg")
            .default("0deg")
            .range(-3.15, 3.15)
            .doc("direction of the laser, anticlockwise from ahead"),
        Parameter::number("scan_rate", "Hz").default("10Hz").range(0.1, 100.0).doc("scans"),
        Parameter::number("odometry_rate", "Hz")
            .default("20Hz")
            .range(0.1, 100.0)
            .doc("odometry and truth"),
        Parameter::number("radius", "m")
            .default("0.18m")
            .range(0.02, 5.0)
            .doc("radius of the round base"),
        Parameter::number("max_speed", "m/s").default("1m/s").range(0.0, 20.0).doc("fastest speed"),
        Parameter::number("max_turn", "rad/s")
            .default("2rad/s")
            .range(0.0, 50.0)
            .doc("fastest turn"),
        Parameter::number("acceleration", "m/s2")
            .default("1.5m/s2")
            .range(0.01, 1000.0)
            .doc("largest change of speed"),
        Parameter::number("turn_acceleration", "rad/s2")
            .default("6rad/s2")
            .range(0.01, 1000.0)
            .doc("largest change of turn rate"),
        Parameter::number("command_timeout", "s")
            .default("0.5s")
            .range(0.05, 10.0)
            .doc("age from which a velocity no longer counts and the base brakes"),
        Parameter::number("alpha1", "")
            .default("0.002")
            .range(0.0, 10.0)
            .doc("odometry: variance of rotation per rotation squared"),
        Parameter::number("alpha2", "")
            .default("0.0005")
            .range(0.0, 10.0)
            .doc("odometry: variance of rotation per metre squared, rad2/m2"),
        Parameter::number("alpha3", "")
            .default("0.002")
            .range(0.0, 10.0)
            .doc("odometry: variance of length per metre squared"),
        Parameter::number("alpha4", "")
            .default("0.0002")
            .range(0.0, 10.0)
            .doc("odometry: variance of length per rotation squared, m2/rad2"),
        Parameter::number("odometry_scale", "")
            .default("1.01")
            .range(0.5, 2.0)
            .doc("odometry: measured length per true length"),
        Parameter::number("odometry_bias", "deg")
            .default("0.2deg")
            .range(-1.0, 1.0)
            .doc("odometry: turn to the left believed in per metre driven"),
        Parameter::number("battery_level", "")
            .default("1")
            .range(0.0, 1.0)
            .doc("charge at the start, 0 to 1"),
        Parameter::number("battery_endurance", "s")
            .default("2h")
            .range(1.0, 1e7)
            .doc("time from full to empty standing still"),
        Parameter::number("battery_range", "m")
            .default("5km")
            .range(1.0, 1e7)
            .doc("way from full to empty, were driving all that drains it"),
        Parameter::number("battery_warning", "")
            .default("0.2")
            .range(0.0, 1.0)
            .doc("level below which battery_low is reported, once"),
        Parameter::number("speed", "")
            .default("1")
            .range(0.0, 100.0)
            .live()
            .doc("times real time, 0: time stands; other than 1 only if <clock> follows this"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("scan", "ranges from right to left in the frame laser; inf: nothing in range, NaN: lost"),
        ("odometry", "what the wheels believe, odom to base_link, drifting"),
        ("truth", "where the base really is, map to base_link; the map begins at the start"),
        ("battery", "charge, 0 to 1 of the capacity"),
        ("collisions", "how often the base has run into something"),
        ("clock", "simulated time, for <clock>; at most one step of 10 ms old"),
        ("velocity", "speed and turn rate for the base"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<LaserScan>("scan")?;
        armor.provide::<Odometry>("odometry")?;
        armor.provide::<Odometry>("truth")?;
        armor.provide::<BatteryState>("battery")?;
        armor.provide::<Latched<Count>>("collisions")?;
        armor.provide::<Latched<Clock>>("clock")?;
        armor.subscribe::<Optional<Twist>>("velocity")?;
        for name in PARAMETER_NAMES {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        Ok(Self {
            armor,
            world: PathBuf::new(),
            models: Models::default(),
            battery_warning: 0.2,
            has_warned: false,
            speed: 1.0,
            running: None,
            clock: ClockOutput::default(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "world" => self.world = value.path()?,
            "seed" => self.models.seed = u64::try_from(value.integer()?)?,
            "beams" => self.models.laser.beams = u32::try_from(value.integer()?)?,
            "battery_warning" => self.battery_warning = value.number()?,
            "speed" => {
                self.speed = value.number()?;
                if let Some((_, pace)) = &mut self.running {
                    pace.set_speed(self.speed, self.armor.timestamp());
                }
            }
            _ => {
                if let Some(setting) = setting(&mut self.models, name) {
                    *setting = value.number()?;
                }
            }
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if let ("velocity", Some((simulation, pace))) = (header.id(), &mut self.running) {
            let twist: Twist = data.decode()?;
            let now_s = pace.time_s(self.armor.timestamp());
            simulation.command(twist.linear.x, twist.angular.z, header.stamp_s, now_s);
            self.clock.warn_if_unfollowed(pace.speed(), &self.armor);
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let host_s = self.armor.timestamp();
        let (mut simulation, mut pace) = match self.running.take() {
            Some(running) => running,
            // The world could not be read, and that has been said.
            None if call == Call::Stopping => return Ok(Outcome::CarryOn),
            None => {
                let world = World::read(&self.world)?;
                (Simulation::new(world, self.models, host_s)?, Pace::new(self.speed, host_s))
            }
        };
        match call {
            Call::Stopping => simulation.halt(),
            // While the world was frozen no time has passed in it.
            Call::Started if self.clock.is_followed => {
                pace.set_time(simulation.time_s(), host_s);
            }
            _ => {}
        }
        let mut readings = Vec::new();
        self.clock.advance(&mut simulation, &mut pace, host_s, &mut readings);
        self.clock.say(simulation.time_s(), &self.armor)?;
        self.running = Some((simulation, pace));
        self.publish_all(readings)
    }
}

impl ClockOutput {
    /// Catches up with the time. If others follow it, none is left out: where the machine is too slow
    /// for it, time passes more slowly.
    fn advance(
        &self,
        simulation: &mut Simulation,
        pace: &mut Pace,
        host_s: f64,
        readings: &mut Vec<Stamped>,
    ) {
        let now_s = pace.time_s(host_s);
        if !self.is_followed {
            return simulation.advance_to(now_s, readings);
        }
        let latest_s = simulation.time_s() + CATCH_UP_S * pace.speed().max(1.0);
        if now_s > latest_s {
            pace.set_time(latest_s, host_s);
        }
        let end_s = now_s.min(latest_s);
        while simulation.time_s() + STEP_S <= end_s + 1e-6 {
            simulation.step(readings);
        }
    }

    /// Publishes the time, before what was measured until then.
    fn say(&mut self, time_s: f64, armor: &Armor) -> Result<(), Fault> {
        if self.said_s != Some(time_s) {
            self.said_s = Some(time_s);
            self.is_followed = armor.send_data("clock", &Clock { clock: time_s })?.to > 0;
        }
        Ok(())
    }

    /// Commands stamped with another time than the world's would never count, or for too long.
    fn warn_if_unfollowed(&mut self, speed: f64, armor: &Armor) {
        if speed != 1.0 && !self.is_followed && !std::mem::replace(&mut self.has_warned, true) {
            let clock = armor.provided_data("clock").unwrap_or_default();
            tracing::warn!(
                "commands are stamped with the host's time, and this world's passes {speed} times \
                 as fast: write <clock source=\"{clock}\"/> into the system, or leave speed at 1"
            );
        }
    }
}

/// Every parameter asked for: all that are declared.
const PARAMETER_NAMES: [&str; 29] = [
    "world",
    "seed",
    "beams",
    "field_of_view",
    "range",
    "laser_sigma",
    "laser_dropout",
    "laser_x",
    "laser_y",
    "laser_theta",
    "scan_rate",
    "odometry_rate",
    "radius",
    "max_speed",
    "max_turn",
    "acceleration",
    "turn_acceleration",
    "command_timeout",
    "alpha1",
    "alpha2",
    "alpha3",
    "alpha4",
    "odometry_scale",
    "odometry_bias",
    "battery_level",
    "battery_endurance",
    "battery_range",
    "battery_warning",
    "speed",
];

/// The number in the models that a parameter sets.
fn setting<'a>(models: &'a mut Models, name: &str) -> Option<&'a mut f64> {
    let Models { laser, drive, odometry, battery, rates, .. } = models;
    Some(match name {
        "field_of_view" => &mut laser.field_of_view_rad,
        "range" => &mut laser.range_max_m,
        "laser_sigma" => &mut laser.sigma_m,
        "laser_dropout" => &mut laser.dropout,
        "laser_x" => &mut laser.mount.x_m,
        "laser_y" => &mut laser.mount.y_m,
        "laser_theta" => &mut laser.mount.yaw_rad,
        "scan_rate" => &mut rates.scan_hz,
        "odometry_rate" => &mut rates.odometry_hz,
        "radius" => &mut drive.radius_m,
        "max_speed" => &mut drive.max_speed_mps,
        "max_turn" => &mut drive.max_turn_radps,
        "acceleration" => &mut drive.acceleration_mps2,
        "turn_acceleration" => &mut drive.turn_acceleration_radps2,
        "command_timeout" => &mut drive.command_timeout_s,
        "alpha1" => &mut odometry.alpha1,
        "alpha2" => &mut odometry.alpha2,
        "alpha3" => &mut odometry.alpha3,
        "alpha4" => &mut odometry.alpha4,
        "odometry_scale" => &mut odometry.scale,
        "odometry_bias" => &mut odometry.bias_rad_per_m,
        "battery_level" => &mut battery.initial_level,
        "battery_endurance" => &mut battery.endurance_s,
        "battery_range" => &mut battery.range_m,
        _ => return None,
    })
}

impl Simulator {
    fn publish_all(&mut self, readings: Vec<Stamped>) -> Result<Outcome, Fault> {
        let mut level = 1.0;
        for stamped in readings {
            if let Reading::Battery { battery, .. } = &stamped.reading {
                level = battery.level();
            }
            self.publish(stamped)?;
        }
        if level < self.battery_warning && !self.has_warned {
            self.has_warned = true;
            return Ok(Outcome::event("battery_low", level));
        }
        Ok(Outcome::CarryOn)
    }

    fn publish(&self, Stamped { time_s, reading }: Stamped) -> Result<(), Fault> {
        let armor = &self.armor;
        match reading {
            Reading::Odometry(motion) => {
                armor.send_data("odometry", &odometry(time_s, "odom", motion))?
            }
            Reading::Truth(motion) => armor.send_data("truth", &odometry(time_s, "map", motion))?,
            Reading::Scan(ranges) => {
                let scan = scan(time_s, &self.models.laser, self.models.rates.scan_hz, ranges);
                armor.send_data("scan", &scan)?
            }
            Reading::Battery { battery, current_a } => {
                armor.send_data("battery", &battery_state(time_s, &battery, current_a))?
            }
            Reading::Collisions(count) => armor.send_data("collisions", &Count { count })?,
        };
        Ok(())
    }
}

fn odometry(stamp: f64, frame: &str, motion: Motion) -> Odometry {
    let Pose2 { x_m, y_m, yaw_rad } = motion.pose;
    let pose = Pose2D { x: x_m, y: y_m, theta: yaw_rad };
    let twist = Twist::planar(motion.speed_mps, motion.turn_radps);
    Odometry::planar(stamp, frame, "base_link", pose, twist)
}

fn scan(stamp: f64, laser: &LaserModel, rate_hz: f64, ranges: Vec<f32>) -> LaserScan {
    let (first_rad, increment_rad) = (laser.angle_min_rad(), laser.angle_increment_rad());
    let last = f64::from(laser.beams.saturating_sub(1));
    LaserScan {
        stamp,
        frame: "laser".into(),
        angle_min: first_rad as f32,
        angle_max: (first_rad + last * increment_rad) as f32,
        angle_increment: increment_rad as f32,
        time_increment: 0.0,
        scan_time: (1.0 / rate_hz).max(STEP_S) as f32,
        range_min: RANGE_MIN_M as f32,
        range_max: laser.range_max_m as f32,
        ranges: Array::from(ranges),
        intensities: Array::from(Vec::new()),
    }
}

fn battery_state(stamp: f64, battery: &Battery, current_a: f64) -> BatteryState {
    BatteryState {
        stamp,
        frame: "base_link".into(),
        voltage: battery.voltage_v() as f32,
        temperature: f32::NAN,
        current: current_a as f32,
        charge: (Battery::CAPACITY_AH * battery.level()) as f32,
        capacity: Battery::CAPACITY_AH as f32,
        design_capacity: Battery::CAPACITY_AH as f32,
        percentage: battery.level() as f32,
        power_supply_status: PowerSupplyStatus::Discharging,
        present: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_declared_parameter_is_asked_for_and_has_the_default_of_its_model() {
        let manifest = armor_sdk::manifest_of::<Simulator>().expect("a manifest");
        let declared: Vec<&str> = manifest.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(declared, PARAMETER_NAMES);
        let mut models = Models::default();
        for parameter in &manifest.parameters {
            if let Some(default) = &parameter.default
                && let Some(value) = setting(&mut models, &parameter.name)
            {
                let declared = armor_sdk::wire::quantity::parse(default).expect("a quantity").si;
                assert!((declared - *value).abs() < 1e-12, "{}", parameter.name);
            }
        }
    }

    #[test]
    fn a_scan_says_where_its_beams_are() {
        let laser = LaserModel::default();
        let scan = scan(5.0, &laser, 10.0, vec![1.0; laser.beams as usize]);
        let last = scan.angle_min + (scan.ranges.len() - 1) as f32 * scan.angle_increment;
        assert!((last - scan.angle_max).abs() < 1e-5);
        assert!((scan.angle_max + scan.angle_min).abs() < 1e-6, "the middle beam looks ahead");
        assert_eq!((scan.stamp, scan.frame.as_str()), (5.0, "laser"));
    }

    #[test]
    fn a_motion_becomes_odometry_in_its_frame() {
        let motion = Motion { pose: Pose2::new(1.0, 2.0, 0.5), speed_mps: 0.3, turn_radps: -0.2 };
        let said = odometry(7.0, "map", motion);
        let pose = said.pose.pose.to_planar();
        assert!((pose.x - 1.0).abs() + (pose.y - 2.0).abs() + (pose.theta - 0.5).abs() < 1e-9);
        assert_eq!(said.twist.twist, Twist::planar(0.3, -0.2));
        assert_eq!((said.frame.as_str(), said.child_frame.as_str()), ("map", "base_link"));
    }
}
