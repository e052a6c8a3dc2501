//! The driver as a component: path, pose, scan and odometry in, or a hand; velocities out.

use armor_grid::{Geometry, Grid, Occupancy, Pose2};
use armor_sdk::prelude::*;

use crate::driver::{Driving, Settings};
use crate::limits::Velocity;
use crate::surroundings::Scan;

/// Drives a differential-drive robot along paths without touching anything.
pub struct Driver {
    armor: Armor,
    settings: Settings,
    robot_from_laser: Pose2,
    driving: Driving,
}

const PARAMETER_NAMES: [&str; 12] = [
    "radius",
    "margin",
    "speed",
    "turn",
    "acceleration",
    "turn_acceleration",
    "tolerance",
    "timeout",
    "guarded",
    "laser_x",
    "laser_y",
    "laser_yaw",
];

impl Component for Driver {
    const KIND: &'static str = "driver";
    const SUMMARY: &'static str =
        "Drives a differential-drive robot along paths without touching anything.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::number("radius", "m")
            .default("0.18m")
            .range(0.02, 5.0)
            .doc("circle around the robot's centre that holds all of it"),
        Parameter::number("margin", "m")
            .default("0.05m")
            .range(0.0, 1.0)
            .doc("kept free around it"),
        Parameter::number("speed", "m/s").default("0.6m/s").range(0.05, 5.0).doc("fastest speed"),
        Parameter::number("turn", "rad/s").default("1.2rad/s").range(0.1, 10.0).doc("fastest turn"),
        Parameter::number("acceleration", "m/s2")
            .default("0.8m/s2")
            .range(0.05, 20.0)
            .doc("largest change of speed"),
        Parameter::number("turn_acceleration", "rad/s2")
            .default("3rad/s2")
            .range(0.1, 100.0)
            .doc("largest change of turn rate"),
        Parameter::number("tolerance", "m")
            .default("0.12m")
            .range(0.02, 2.0)
            .doc("the end of a path is reached within this"),
        Parameter::number("timeout", "s")
            .default("0.5s")
            .range(0.05, 10.0)
            .doc("without a path, scan and odometry younger than this the robot stands"),
        Parameter::flag("guarded")
            .default("true")
            .doc("who drives by hand is slowed down and stopped before what the laser sees"),
        Parameter::number("laser_x", "m")
            .default("0m")
            .range(-10.0, 10.0)
            .doc("laser ahead of the middle of the base"),
        Parameter::number("laser_y", "m")
            .default("0m")
            .range(-10.0, 10.0)
            .doc("laser left of the middle of the base"),
        Parameter::number("laser_yaw", "deg")
            .default("0deg")
            .range(-std::f64::consts::PI, std::f64::consts::PI)
            .doc("direction of the laser, anticlockwise from ahead"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("path", "where to drive; must be said again within the timeout, empty if there is no way"),
        ("pose", "where the robot was on the map when a scan was taken"),
        ("scan", "what is around the robot now"),
        ("odometry", "carries the pose on until the next one"),
        ("map", "what is where the laser does not look"),
        ("manual", "somebody's hand: holds before the path while it is fresh"),
        ("stop", "true: stands, whatever else is said, until false"),
        ("velocity", "speed and turn rate, at every tick"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Path>("path")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.subscribe::<LaserScan>("scan")?;
        armor.subscribe::<Odometry>("odometry")?;
        armor.subscribe::<Optional<OccupancyGrid>>("map")?;
        armor.subscribe::<Optional<Twist>>("manual")?;
        armor.subscribe::<Optional<Flag>>("stop")?;
        armor.provide::<Twist>("velocity")?;
        for name in PARAMETER_NAMES {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        let settings = Settings::default();
        let driving = Driving::new(settings);
        Ok(Self { armor, settings, robot_from_laser: Pose2::IDENTITY, driving })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        if name == "guarded" {
            self.settings.guarded = value.flag()?;
            return Ok(());
        }
        let number = value.number()?;
        let limits = &mut self.settings.limits;
        match name {
            "radius" => self.settings.radius_m = number,
            "margin" => self.settings.margin_m = number,
            "speed" => limits.speed_mps = number,
            "turn" => limits.turn_radps = number,
            "acceleration" => limits.acceleration_mps2 = number,
            "turn_acceleration" => limits.turn_acceleration_radps2 = number,
            "tolerance" => self.settings.tolerance_m = number,
            "timeout" => self.settings.timeout_s = number,
            "laser_x" => self.robot_from_laser.x_m = number,
            "laser_y" => self.robot_from_laser.y_m = number,
            "laser_yaw" => self.robot_from_laser.yaw_rad = number,
            _ => {}
        }
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let now_s = self.armor.timestamp();
        match header.id() {
            "path" => {
                let path: Path = data.decode()?;
                let poses = path.poses.iter().map(|stamped| planar(&stamped.pose)).collect();
                self.driving.path_seen(now_s, poses);
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.driving.pose_seen(pose.stamp, planar(&pose.pose.pose));
            }
            "scan" => {
                let scan: LaserScan = data.decode()?;
                self.driving.scan_seen(now_s, as_scan(&scan, self.robot_from_laser));
            }
            "odometry" => {
                let odometry: Odometry = data.decode()?;
                self.driving.odometry_seen(now_s, odometry.stamp, planar(&odometry.pose.pose));
            }
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.driving.map_seen(grid(&map)?);
            }
            "manual" => {
                let Twist { linear, angular } = data.decode()?;
                let wanted = Velocity { speed_mps: linear.x, turn_radps: angular.z };
                self.driving.hand_seen(now_s, wanted);
            }
            "stop" => {
                let Flag { data: is_stopped } = data.decode()?;
                self.driving.stop_seen(is_stopped);
            }
            _ => {}
        }
        Ok(())
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        match call {
            Call::Started => self.driving.begin_anew(self.settings),
            Call::Stopping => self.driving.forget(),
            _ => {}
        }
        let Velocity { speed_mps, turn_radps } = self.driving.step(self.armor.timestamp());
        self.armor.send_data("velocity", &Twist::planar(speed_mps, turn_radps))?;
        Ok(Outcome::CarryOn)
    }
}

fn planar(pose: &Pose) -> Pose2 {
    let Pose2D { x, y, theta } = pose.to_planar();
    Pose2::new(x, y, theta)
}

fn grid(map: &OccupancyGrid) -> Result<Grid<Occupancy>, Fault> {
    let geometry = Geometry {
        origin: planar(&map.info.origin).point(),
        resolution_m: f64::from(map.info.resolution),
        width: map.info.width as usize,
        height: map.info.height as usize,
    };
    Grid::classified(geometry, &map.data).ok_or_else(|| {
        "the map has not as many cells as its width and height say, or they have no size".into()
    })
}

fn as_scan(scan: &LaserScan, robot_from_laser: Pose2) -> Scan {
    let seen = scan.range_min..=scan.range_max;
    let range_m = |range: &f32| match range {
        range if seen.contains(range) => f64::from(*range),
        range if *range > scan.range_max => f64::INFINITY,
        _ => f64::NAN,
    };
    Scan {
        stamp_s: scan.stamp,
        robot_from_laser,
        first_rad: f64::from(scan.angle_min),
        step_rad: f64::from(scan.angle_increment),
        ranges_m: scan.ranges.iter().map(range_m).collect(),
    }
}
