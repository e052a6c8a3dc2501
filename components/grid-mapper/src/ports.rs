//! The mapper as a component: scans and odometry in, poses and the map out.

use armor_sdk::prelude::*;

use crate::mapper::{Config, Estimate, Mapper};
use crate::pairing::Pairing;
use crate::pose::Pose as Pose2;
use crate::scan::Scan;

/// Frame of the map (REP-105).
const MAP: &str = "map";

/// Draws a map while the robot drives, and tells where on it the robot is.
pub struct GridMapper {
    armor: Armor,
    config: Config,
    map_period_s: f64,
    pairing: Pairing,
    mapper: Mapper,
    /// The map has changed since it was published.
    is_new: bool,
    published_s: f64,
    stamp_s: f64,
    dropped: u64,
}

const PARAMETER_NAMES: [&str; 7] = [
    "resolution",
    "laser_x",
    "laser_y",
    "laser_yaw",
    "map_period",
    "keyframe_distance",
    "keyframe_turn",
];

impl Component for GridMapper {
    const KIND: &'static str = "grid-mapper";
    const SUMMARY: &'static str = "Draws an occupancy grid from scans and odometry by scan matching, and places the robot on it.";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::number("resolution", "m")
            .default("0.05m")
            .range(0.01, 1.0)
            .doc("side of a map cell"),
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
        Parameter::number("map_period", "s")
            .default("1s")
            .range(0.05, 3600.0)
            .doc("the map is published this often, if it has changed"),
        Parameter::number("keyframe_distance", "m")
            .default("0.2m")
            .range(0.01, 10.0)
            .doc("the map is drawn on after moving this far"),
        Parameter::number("keyframe_turn", "deg")
            .default("10deg")
            .range(0.01, 3.2)
            .doc("or after turning this far"),
    ];
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("scan", "what the laser sees"),
        ("odometry", "where the wheels believe the robot is"),
        ("map", "what is known of the world; the frame map begins where the robot stood first"),
        ("pose", "where the robot was at each scan, one per scan"),
        ("correction", "map_from_odom: brings the odometry into the map"),
    ];

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<LaserScan>("scan")?;
        armor.subscribe::<Odometry>("odometry")?;
        armor.provide::<Latched<OccupancyGrid>>("map")?;
        armor.provide::<PoseWithCovarianceStamped>("pose")?;
        armor.provide::<PoseStamped>("correction")?;
        for name in PARAMETER_NAMES {
            armor.get_parameter(name)?;
        }
        armor.synchronize()?;
        let config = Config::default();
        Ok(Self {
            armor,
            config,
            map_period_s: 1.0,
            pairing: Pairing::default(),
            mapper: Mapper::new(config),
            is_new: false,
            published_s: f64::NEG_INFINITY,
            stamp_s: 0.0,
            dropped: 0,
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let number = value.number()?;
        let laser = &mut self.config.robot_from_laser;
        match name {
            "resolution" => self.config.resolution_m = number,
            "laser_x" => laser.x_m = number,
            "laser_y" => laser.y_m = number,
            "laser_yaw" => laser.yaw_rad = number,
            "map_period" => self.map_period_s = number,
            "keyframe_distance" => self.config.keyframe_m = number,
            "keyframe_turn" => self.config.keyframe_rad = number,
            _ => {}
        }
        // All of them arrive before the first scan.
        self.mapper = Mapper::new(self.config);
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        match header.id() {
            "scan" => self.pairing.scan_seen(as_scan(&data.decode()?)),
            "odometry" => {
                let odometry: Odometry = data.decode()?;
                let Pose2D { x, y, theta } = odometry.pose.pose.to_planar();
                self.pairing.odometry_seen(odometry.stamp, Pose2::new(x, y, theta));
            }
            _ => {}
        }
        while let Some((odometry, scan)) = self.pairing.next_pair() {
            let estimate = self.mapper.add(odometry, &scan);
            self.is_new |= estimate.drawn;
            self.stamp_s = scan.stamp_s;
            self.publish_pose(scan.stamp_s, &estimate)?;
        }
        if self.dropped != self.pairing.dropped() {
            self.dropped = self.pairing.dropped();
            // The first, and then ever more rarely: a log is not to be filled with it.
            if self.dropped.is_power_of_two() {
                tracing::warn!(dropped = self.dropped, "scans without odometry were dropped");
            }
        }
        Ok(())
    }

    /// Publishes the map when it has changed and its period is over. At the end of a log no scan
    /// follows, so it is the tick, not the scan, that looks.
    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        let now_s = self.armor.timestamp();
        if self.is_new && now_s - self.published_s >= self.map_period_s {
            self.armor.send_data("map", &self.map())?;
            (self.is_new, self.published_s) = (false, now_s);
        }
        Ok(Outcome::CarryOn)
    }
}

impl GridMapper {
    fn map(&self) -> OccupancyGrid {
        let snapshot = self.mapper.snapshot();
        OccupancyGrid {
            stamp: self.stamp_s,
            frame: MAP.into(),
            info: MapMetaData {
                map_load_time: self.stamp_s,
                resolution: snapshot.resolution_m as f32,
                width: snapshot.width as u32,
                height: snapshot.height as u32,
                origin: Pose::planar(as_message(&snapshot.origin)),
            },
            data: snapshot.cells.into(),
        }
    }

    fn publish_pose(&self, stamp: f64, estimate: &Estimate) -> Result<(), Fault> {
        let mut covariance = [0.0; 36];
        for (row, from) in [0, 1, 5].into_iter().enumerate() {
            for (column, to) in [0, 1, 5].into_iter().enumerate() {
                covariance[from * 6 + to] = estimate.covariance[(row, column)];
            }
        }
        let pose = Pose::planar(as_message(&estimate.pose));
        let pose = PoseWithCovariance { pose, covariance };
        self.armor
            .send_data("pose", &PoseWithCovarianceStamped { stamp, frame: MAP.into(), pose })?;
        let pose = Pose::planar(as_message(&estimate.map_from_odom));
        self.armor.send_data("correction", &PoseStamped { stamp, frame: MAP.into(), pose })?;
        Ok(())
    }
}

fn as_message(pose: &Pose2) -> Pose2D {
    Pose2D { x: pose.x_m, y: pose.y_m, theta: pose.yaw_rad }
}

fn as_scan(scan: &LaserScan) -> Scan {
    Scan {
        stamp_s: scan.stamp,
        angle_min_rad: f64::from(scan.angle_min),
        increment_rad: f64::from(scan.angle_increment),
        range_min_m: f64::from(scan.range_min),
        range_max_m: f64::from(scan.range_max),
        ranges_m: scan.ranges.to_vec(),
    }
}
