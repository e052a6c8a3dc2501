//! The simulator as a component: its ports, and how time passes in it.

mod clock;
mod messages;
mod parameters;

use std::collections::BTreeSet;

use armor_sdk::prelude::*;

use crate::pace::SimulationPace;
use crate::pose::Pose2;
use crate::simulation::{Models, OTHERS, SensorReading, Simulation, Stamped};
use crate::world::World;
use clock::ClockOutput;
use messages::{Bumper, Heading, Presence};
use parameters::SimulatorParameters;

/// The inputs for other robots in the same world.
const OTHER_NAMES: [&str; OTHERS] = ["other1", "other2", "other3", "other4"];

/// What it reports to the mission.
#[derive(Events)]
enum SimulatorEvent {
    /// the charge has fallen below `battery_warning`, once; its value is the level, 0 to 1
    BatteryLow(f64),
}

/// Simulates a robot with its sensors in a drawn world.
pub struct Simulator {
    armor: Armor,
    parameters: SimulatorParameters,
    /// As the parameters have them.
    models: Models,
    has_warned: bool,
    /// The world, and how fast time passes in it.
    running: Option<(Simulation, SimulationPace)>,
    clock: ClockOutput,
    /// Whether anything subscribes to the pictures.
    is_watched: bool,
    /// The sensors whose missing frame was logged.
    unplaced: BTreeSet<&'static str>,
}

impl Component for Simulator {
    const KIND: &'static str = "simulator";
    const SUMMARY: &'static str = "Simulates a robot with its sensors in a drawn world, among people \
                                   and other robots.";
    const REPORTS_DONE: bool = false;
    const STALE_AFTER: &'static [(&'static str, &'static str)] = &[("velocity", "command_timeout")];
    const NEEDS_RATE: bool = true;
    const VALUE_EFFECTS: &'static [(&'static str, ParameterEffect)] =
        &[("speed", ParameterEffect::Idle("0")), ("max_speed", ParameterEffect::Idle("0m/s"))];
    const FRAMES: &'static [(&'static str, &'static str)] =
        &[("scan", "laser_frame"), ("camera", "camera_frame")];
    const PARAMETERS: &'static [Parameter] = SimulatorParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        (
            "scan",
            "ranges from right to left in the laser's frame; inf: nothing in range, NaN: lost",
        ),
        ("odometry", "what the wheels believe, odom to base_link, drifting"),
        ("transforms", "where base_link is in odom, as the odometry has it"),
        ("truth", "where the base really is, map to base_link; the map begins at the start"),
        ("presence", "the base as other robots in the same world meet it, on the sheet"),
        ("imu", "turn rate by a gyroscope whose bias walks"),
        ("compass", "heading against magnetic east, anticlockwise"),
        ("gps", "position on the earth; no number if it failed"),
        ("camera", "what is ahead, rgb8; one a second without a subscriber"),
        ("bumper", "whether something touches the base, and on which side"),
        ("battery", "charge, 0 to 1 of the capacity"),
        ("collisions", "number of times the base has run into something"),
        ("clock", "simulated time, for <clock>; at most one step of 10 ms old"),
        ("velocity", "speed and turn rate for the base"),
        ("other1", "presence of another robot in the same world"),
        ("other2", "presence of another robot in the same world"),
        ("other3", "presence of another robot in the same world"),
        ("other4", "presence of another robot in the same world"),
    ];

    const EVENTS: &'static [DeclaredEvent] = SimulatorEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<LaserScan>("scan")?;
        armor.provide::<Odometry>("odometry")?;
        armor.provide::<FrameTransforms>("transforms")?;
        armor.provide::<Odometry>("truth")?;
        armor.provide::<Presence>("presence")?;
        armor.provide::<Imu>("imu")?;
        armor.provide::<Heading>("compass")?;
        armor.provide::<NavSatFix>("gps")?;
        armor.provide::<Image>("camera")?;
        armor.provide::<Latched<Bumper>>("bumper")?;
        armor.provide::<BatteryState>("battery")?;
        armor.provide::<Latched<Count>>("collisions")?;
        armor.provide::<Latched<Clock>>("clock")?;
        armor.subscribe::<Optional<Twist>>("velocity")?;
        for other in OTHER_NAMES {
            armor.subscribe::<Optional<Presence>>(other)?;
        }
        let parameters = SimulatorParameters::request(&armor)?;
        Ok(Self {
            armor,
            models: parameters.models(),
            parameters,
            has_warned: false,
            running: None,
            clock: ClockOutput::default(),
            is_watched: false,
            unplaced: BTreeSet::new(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        self.models = self.parameters.models();
        if let ("speed", Some((_, pace))) = (name, &mut self.running) {
            pace.set_speed(self.parameters.speed, self.armor.timestamp());
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let Some((simulation, pace)) = &mut self.running else { return Ok(()) };
        if header.id() == "velocity" {
            let twist: Twist = data.decode()?;
            let now_s = pace.time_s(self.armor.timestamp());
            simulation.command(twist.linear.x, twist.angular.z, header.stamp_s, now_s);
            self.clock.warn_if_unfollowed(pace.speed(), &self.armor);
        } else if let Some(index) = OTHER_NAMES.iter().position(|other| *other == header.id()) {
            let Presence { pose, radius, .. } = data.decode()?;
            simulation.other_seen(index, Pose2::new(pose.x, pose.y, pose.theta), radius);
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let host_s = self.armor.timestamp();
        let (mut simulation, mut pace) = match self.running.take() {
            Some(running) => running,
            // The world could not be read, which has been reported.
            None if call == Call::Stopping => return Ok(Outcome::CarryOn),
            None => {
                let world = World::read_from(&self.parameters.world, &self.parameters.start())?;
                let simulation = Simulation::new(world, self.models, host_s)?;
                (simulation, SimulationPace::new(self.parameters.speed, host_s))
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
        simulation.watch(self.is_watched);
        let mut readings = Vec::new();
        self.clock.advance(&mut simulation, &mut pace, host_s, &mut readings);
        self.clock.publish_time(simulation.time_s(), &self.armor)?;
        self.running = Some((simulation, pace));
        self.publish_all(readings)
    }
}

impl Simulator {
    fn publish_all(&mut self, readings: Vec<Stamped>) -> Result<Outcome, Fault> {
        let mut level = 1.0;
        for stamped in readings {
            if let SensorReading::Battery { battery, .. } = &stamped.reading {
                level = battery.level();
            }
            if self.is_placed(&stamped.reading) {
                self.publish_reading(stamped)?;
            }
        }
        if level < self.parameters.battery_warning && !self.has_warned {
            self.has_warned = true;
            return Ok(SimulatorEvent::BatteryLow(level).into());
        }
        Ok(Outcome::CarryOn)
    }

    /// Returns whether the file places the sensor on the robot; the first time that it does not is
    /// logged. Nothing is published that was measured at a place which is not known.
    fn is_placed(&mut self, reading: &SensorReading) -> bool {
        let (sensor, placed) = match reading {
            SensorReading::Scan(_) => ("scan", self.parameters.laser_mount().map(drop)),
            SensorReading::Picture(_) => ("camera", self.parameters.camera_mount().map(drop)),
            _ => return true,
        };
        if let Err(why) = &placed
            && self.unplaced.insert(sensor)
        {
            tracing::info!("nothing is published on {sensor}: {why}");
        }
        placed.is_ok()
    }

    fn publish_reading(&mut self, Stamped { time_s, reading }: Stamped) -> Result<(), Fault> {
        let armor = &self.armor;
        match reading {
            SensorReading::Odometry(motion) => {
                let odometry = messages::build_odometry(time_s, "odom", motion);
                armor.send_data("transforms", &FrameTransforms::from_odometry(&odometry))?;
                armor.send_data("odometry", &odometry)?
            }
            SensorReading::Presence(pose) => {
                let radius_m = self.models.drive.radius_m;
                armor.send_data("presence", &messages::build_presence(time_s, pose, radius_m))?
            }
            SensorReading::Turn(turn_radps) => {
                let imu = messages::build_imu(time_s, turn_radps, self.models.imu.sigma_radps);
                armor.send_data("imu", &imu)?
            }
            SensorReading::Heading(heading_rad) => {
                armor.send_data("compass", &messages::build_heading(time_s, heading_rad))?
            }
            SensorReading::Position(fix) => {
                armor.send_data("gps", &messages::build_fix(time_s, fix))?
            }
            SensorReading::Picture(rgb) => {
                let frame = &self.parameters.camera_frame;
                let image = messages::build_image(time_s, frame, &self.models.camera, rgb);
                let sent = armor.send_data("camera", &image)?;
                self.is_watched = sent.to > 0;
                sent
            }
            SensorReading::Bumper(side) => {
                armor.send_data("bumper", &messages::build_bumper(time_s, side))?
            }
            SensorReading::Truth(motion) => {
                armor.send_data("truth", &messages::build_odometry(time_s, "map", motion))?
            }
            SensorReading::Scan(ranges) => {
                let scan = messages::build_scan(
                    time_s,
                    &self.parameters.laser_frame,
                    &self.models.laser,
                    self.models.rates.scan_hz,
                    ranges,
                );
                armor.send_data("scan", &scan)?
            }
            SensorReading::Battery { battery, current_a } => {
                armor.send_data("battery", &messages::battery_state(time_s, &battery, current_a))?
            }
            SensorReading::Collisions(count) => armor.send_data("collisions", &Count { count })?,
        };
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_sdk::testing::{TestError, TestedComponent};

    use super::*;

    #[test]
    fn a_sensor_is_where_the_file_places_it_or_publishes_nothing() -> Result<(), TestError> {
        let world = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/two-rooms.svg");
        let frames = ("frames", "front,base_link,0.08,0,0.2,0,0,0");
        let parameters = [("world", world), frames, ("laser_frame", "front")];
        let mut simulator = TestedComponent::build::<Simulator>(&parameters)?;
        simulator.start()?;
        for _ in 0..30 {
            simulator.tick_after(Duration::from_millis(50))?;
        }
        assert_eq!(simulator.last_output::<LaserScan>("scan")?.frame, "front");
        assert!(simulator.outputs::<Image>("camera")?.is_empty(), "its frame is missing");
        let odometry: Odometry = simulator.last_output("odometry")?;
        let transforms: FrameTransforms = simulator.last_output("transforms")?;
        assert_eq!(transforms, FrameTransforms::from_odometry(&odometry));
        let [moved] = &transforms.transforms[..] else { panic!("one frame moves") };
        assert_eq!((moved.parent.as_str(), moved.child.as_str()), ("odom", "base_link"));
        Ok(())
    }
}
