//! The simulator as a component: its ports, and how time passes in it.

mod clock;
mod messages;
mod parameters;

use std::path::PathBuf;

use armor_sdk::prelude::*;

use crate::pace::Pace;
use crate::pose::Pose2;
use crate::simulation::{Models, OTHERS, Reading, Simulation, Stamped};
use crate::world::{Start, World};
use clock::ClockOutput;
use messages::{Bumper, Heading, Presence};

/// The inputs for other robots in the same world.
const OTHER_NAMES: [&str; OTHERS] = ["other1", "other2", "other3", "other4"];

/// Simulates a robot with its sensors in a drawn world.
pub struct Simulator {
    armor: Armor,
    world: PathBuf,
    start: Start,
    /// Where to begin if no start is drawn.
    start_pose: Pose2,
    models: Models,
    battery_warning: f64,
    has_warned: bool,
    speed: f64,
    /// The world, and how fast time passes in it.
    running: Option<(Simulation, Pace)>,
    clock: ClockOutput,
    /// Somebody looks at the pictures.
    is_watched: bool,
}

impl Component for Simulator {
    const KIND: &'static str = "simulator";
    const SUMMARY: &'static str = "Simulates a robot with its sensors in a drawn world, among people \
                                   and other robots.";
    const PARAMETERS: &'static [Parameter] = parameters::PARAMETERS;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("scan", "ranges from right to left in the frame laser; inf: nothing in range, NaN: lost"),
        ("odometry", "what the wheels believe, odom to base_link, drifting"),
        ("truth", "where the base really is, map to base_link; the map begins at the start"),
        ("presence", "the base as other robots in the same world meet it, on the sheet"),
        ("imu", "turn rate by a gyroscope whose bias walks"),
        ("compass", "heading against magnetic east, anticlockwise"),
        ("gps", "position on the earth; no number if it failed"),
        ("camera", "what is ahead, rgb8; one a second if nobody is linked"),
        ("bumper", "whether something touches the base, and on which side"),
        ("battery", "charge, 0 to 1 of the capacity"),
        ("collisions", "how often the base has run into something"),
        ("clock", "simulated time, for <clock>; at most one step of 10 ms old"),
        ("velocity", "speed and turn rate for the base"),
        ("other1", "presence of another robot in the same world"),
        ("other2", "presence of another robot in the same world"),
        ("other3", "presence of another robot in the same world"),
        ("other4", "presence of another robot in the same world"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<LaserScan>("scan")?;
        armor.provide::<Odometry>("odometry")?;
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
        for parameter in Self::PARAMETERS {
            armor.get_parameter(&parameter.manifest().name)?;
        }
        armor.synchronize()?;
        Ok(Self {
            armor,
            world: PathBuf::new(),
            start: Start::default(),
            start_pose: Pose2::default(),
            models: Models::default(),
            battery_warning: 0.2,
            has_warned: false,
            speed: 1.0,
            running: None,
            clock: ClockOutput::default(),
            is_watched: false,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        match name {
            "world" => self.world = value.path()?,
            "start" => self.start.id = value.text()?.to_owned(),
            "start_x" => self.start_pose.x_m = value.number()?,
            "start_y" => self.start_pose.y_m = value.number()?,
            "start_heading" => self.start_pose.yaw_rad = value.number()?,
            "battery_warning" => self.battery_warning = value.number()?,
            "speed" => {
                self.speed = value.number()?;
                if let Some((_, pace)) = &mut self.running {
                    pace.set_speed(self.speed, self.armor.timestamp());
                }
            }
            _ => {
                parameters::set(&mut self.models, name, value)?;
            }
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
            // The world could not be read, and that has been said.
            None if call == Call::Stopping => return Ok(Outcome::CarryOn),
            None => {
                let world = World::read_from(&self.world, &self.start())?;
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
        simulation.watch(self.is_watched);
        let mut readings = Vec::new();
        self.clock.advance(&mut simulation, &mut pace, host_s, &mut readings);
        self.clock.say(simulation.time_s(), &self.armor)?;
        self.running = Some((simulation, pace));
        self.publish_all(readings)
    }
}

impl Simulator {
    /// Where to begin; nothing is given if all of it is zero, where no start could be.
    fn start(&self) -> Start {
        let is_given = self.start_pose != Pose2::default();
        Start { otherwise: is_given.then_some(self.start_pose), ..self.start.clone() }
    }

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

    fn publish(&mut self, Stamped { time_s, reading }: Stamped) -> Result<(), Fault> {
        let armor = &self.armor;
        match reading {
            Reading::Odometry(motion) => {
                armor.send_data("odometry", &messages::odometry(time_s, "odom", motion))?
            }
            Reading::Presence(pose) => {
                let radius_m = self.models.drive.radius_m;
                armor.send_data("presence", &messages::presence(time_s, pose, radius_m))?
            }
            Reading::Turn(turn_radps) => {
                let imu = messages::imu(time_s, turn_radps, self.models.imu.sigma_radps);
                armor.send_data("imu", &imu)?
            }
            Reading::Heading(heading_rad) => {
                armor.send_data("compass", &messages::heading(time_s, heading_rad))?
            }
            Reading::Position(fix) => armor.send_data("gps", &messages::fix(time_s, fix))?,
            Reading::Picture(rgb) => {
                let image = messages::image(time_s, &self.models.camera, rgb);
                let sent = armor.send_data("camera", &image)?;
                self.is_watched = sent.to > 0;
                sent
            }
            Reading::Bumper(side) => armor.send_data("bumper", &messages::bumper(time_s, side))?,
            Reading::Truth(motion) => {
                armor.send_data("truth", &messages::odometry(time_s, "map", motion))?
            }
            Reading::Scan(ranges) => {
                let scan =
                    messages::scan(time_s, &self.models.laser, self.models.rates.scan_hz, ranges);
                armor.send_data("scan", &scan)?
            }
            Reading::Battery { battery, current_a } => {
                armor.send_data("battery", &messages::battery_state(time_s, &battery, current_a))?
            }
            Reading::Collisions(count) => armor.send_data("collisions", &Count { count })?,
        };
        Ok(())
    }
}
