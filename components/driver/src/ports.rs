//! The driver as a component: path, pose, scan and odometry in, or a manual velocity; velocities out.

use armor_convert::{
    FrameNews, FrameWatch, MountError, ZoneWatch, locate_level, read_occupancy, read_odometry_pose,
    read_path, read_robot_pose,
};
use armor_grid::{Pose2, Thresholds};
use armor_sdk::prelude::*;

use crate::driver::{DriverSettings, Driving};
use crate::limits::{DriveLimits, Velocity};
use crate::phase::DrivingPhase;
use crate::surroundings::DriverScan;

/// What can be set in the file.
#[derive(Debug, Parameters)]
struct DriverParameters {
    /// circle around the robot's centre that encloses it
    #[parameter(unit = "m", default = "0.18m", range = 0.02..=5.0)]
    radius_m: f64,
    /// kept free around it
    #[parameter(unit = "m", default = "0.05m", range = 0.0..=1.0)]
    margin_m: f64,
    /// fastest speed
    #[parameter(unit = "m/s", default = "0.6m/s", range = 0.05..=5.0)]
    speed_mps: f64,
    /// fastest turn
    #[parameter(unit = "rad/s", default = "1.2rad/s", range = 0.1..=10.0)]
    turn_radps: f64,
    /// largest change of speed
    #[parameter(unit = "m/s2", default = "0.8m/s2", range = 0.05..=20.0)]
    acceleration_mps2: f64,
    /// largest change of turn rate
    #[parameter(unit = "rad/s2", default = "3rad/s2", range = 0.1..=100.0)]
    turn_acceleration_radps2: f64,
    /// the end of a path is reached within this
    #[parameter(unit = "m", default = "0.12m", range = 0.02..=2.0)]
    tolerance_m: f64,
    /// without a path, scan and odometry younger than this the robot stands
    #[parameter(unit = "s", default = "0.5s", range = 0.05..=10.0)]
    timeout_s: f64,
    /// manual velocities are limited so that the robot stops before what the laser sees
    #[parameter(default = true)]
    guarded: bool,
    /// the frames of the file: where the laser is on the robot
    #[parameter(default = "", format = "frames", live)]
    frames: Vec<FixedFrame>,
    /// the laser's frame
    #[parameter(default = "laser", format = "frame", live)]
    laser_frame: String,
}

impl DriverParameters {
    fn settings(&self) -> DriverSettings {
        DriverSettings {
            limits: DriveLimits {
                speed_mps: self.speed_mps,
                turn_radps: self.turn_radps,
                acceleration_mps2: self.acceleration_mps2,
                turn_acceleration_radps2: self.turn_acceleration_radps2,
            },
            radius_m: self.radius_m,
            margin_m: self.margin_m,
            tolerance_m: self.tolerance_m,
            timeout_s: self.timeout_s,
            guarded: self.guarded,
        }
    }
}

impl Default for DriverSettings {
    fn default() -> Self {
        DriverParameters::defaults().settings()
    }
}

/// Drives a differential-drive robot along paths without touching anything.
pub struct Driver {
    armor: Armor,
    parameters: DriverParameters,
    /// Where the laser is, or why that is not known.
    robot_from_laser: Result<Pose2, MountError>,
    driving: Driving,
    frames: FrameWatch,
    zones: ZoneWatch,
    /// Why the zones are not known, as logged last.
    zone_fault: Option<String>,
    pace: ProgressPace,
}

/// What it reports to the mission.
#[derive(Debug, Events)]
enum DriverEvent {
    /// the map frame has another origin: the robot stands until a path in it arrives
    FrameChanged,
}

impl Component for Driver {
    const KIND: &'static str = "driver";
    const SUMMARY: &'static str =
        "Drives a differential-drive robot along paths without touching anything.";
    const REPORTS_DONE: bool = false;
    const STALE_AFTER: &'static [(&'static str, &'static str)] =
        &[("path", "timeout"), ("scan", "timeout"), ("odometry", "timeout")];
    const FRAMES: &'static [(&'static str, &'static str)] = &[("scan", "laser_frame")];
    const PARAMETERS: &'static [Parameter] = DriverParameters::DECLARED;
    const PORTS: &'static [(&'static str, &'static str)] = &[
        ("path", "where to drive; must be sent again within the timeout, empty if no path exists"),
        ("pose", "where the robot was on the map when a scan was taken"),
        ("scan", "what is around the robot now"),
        ("odometry", "extrapolates the pose until the next one"),
        ("map", "what is where the laser does not look"),
        (
            "zones",
            "where the robot may be, and how fast; if it is linked, no path is followed without zones \
             of the map's frame",
        ),
        ("manual", "manual velocity: has priority over the path while it is fresh"),
        ("stop", "true: stands, whatever the other inputs, until false"),
        ("velocity", "speed and turn rate, at every tick"),
        ("progress", "what the robot is doing, and the rest of its path, once per second"),
    ];

    const EVENTS: &'static [DeclaredEvent] = DriverEvent::DECLARED;

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<Path>("path")?;
        armor.subscribe::<PoseWithCovarianceStamped>("pose")?;
        armor.subscribe::<LaserScan>("scan")?;
        armor.subscribe::<Odometry>("odometry")?;
        armor.subscribe::<Optional<OccupancyGrid>>("map")?;
        armor.subscribe::<Optional<Zones>>("zones")?;
        armor.subscribe::<Optional<Twist>>("manual")?;
        armor.subscribe::<Optional<Flag>>("stop")?;
        armor.provide::<Twist>("velocity")?;
        armor.provide::<Progress>("progress")?;
        let parameters = DriverParameters::request(&armor)?;
        let driving = Driving::new(parameters.settings());
        let robot_from_laser = locate_level(&parameters.frames, &parameters.laser_frame);
        Ok(Self {
            armor,
            parameters,
            robot_from_laser,
            driving,
            frames: FrameWatch::default(),
            zones: ZoneWatch::default(),
            zone_fault: None,
            pace: ProgressPace::default(),
        })
    }

    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        self.parameters.set(name, value)?;
        let DriverParameters { frames, laser_frame, .. } = &self.parameters;
        self.robot_from_laser = locate_level(frames, laser_frame);
        Ok(())
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let now_s = self.armor.timestamp();
        match header.id() {
            "path" => {
                let path: Path = data.decode()?;
                if self.frames.is_usable(&path.frame) {
                    self.driving.path_seen(now_s, read_path(&path));
                } else {
                    // The robot must not continue an older path instead.
                    self.driving.forget_path();
                }
            }
            "pose" => {
                let pose: PoseWithCovarianceStamped = data.decode()?;
                self.frame_seen(&pose.frame);
                self.driving.pose_seen(pose.stamp, read_robot_pose(&pose));
            }
            "scan" => {
                let scan: LaserScan = data.decode()?;
                let robot_from_laser = self.robot_from_laser.clone()?;
                self.driving.scan_seen(now_s, as_scan(&scan, robot_from_laser));
            }
            "odometry" => {
                let odometry: Odometry = data.decode()?;
                let pose = read_odometry_pose(&odometry);
                self.driving.odometry_seen(now_s, odometry.stamp, pose);
            }
            "map" => {
                let map: OccupancyGrid = data.decode()?;
                self.frame_seen(&map.frame);
                self.driving.map_seen(read_occupancy(&map, Thresholds::default())?);
            }
            "zones" => {
                if let Some(zones) = self.zones.zones_seen(&data.decode()?) {
                    self.driving.zones_seen(zones);
                }
            }
            "manual" => {
                let Twist { linear, angular } = data.decode()?;
                let wanted = Velocity { speed_mps: linear.x, turn_radps: angular.z };
                self.driving.manual_seen(now_s, wanted);
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
            Call::Started => {
                self.zones.expect_zones(self.armor.subscribed_data("zones").is_some());
                self.driving.reset_state(self.parameters.settings());
            }
            Call::Stopping => self.driving.forget_orders(),
            _ => {}
        }
        self.check_zones();
        let now_s = self.armor.timestamp();
        let Velocity { speed_mps, turn_radps } = self.driving.step(now_s);
        self.armor.send_data("velocity", &Twist::planar(speed_mps, turn_radps))?;
        // A frozen driver has no task, even if it stands for another reason.
        let phase = if call == Call::Stopping { DrivingPhase::Idle } else { self.driving.phase() };
        let zone_ahead = self.driving.zone_ahead();
        let describe = || (None, zone_ahead.map_or_else(|| phase.detail(), str::to_owned));
        if let Some(progress) = self.pace.next_progress(now_s, phase.task(), describe) {
            self.armor.send_data("progress", &progress)?;
        }
        let has_changed = self.frames.take_change();
        Ok(if has_changed { DriverEvent::FrameChanged.into() } else { Outcome::CarryOn })
    }
}

impl Driver {
    /// Follows no path while it is not known where the robot may be.
    fn check_zones(&mut self) {
        let fault = self.zones.fault(&self.frames);
        self.driving.set_zones_known(fault.is_none());
        if fault != self.zone_fault {
            if let Some(fault) = &fault {
                tracing::warn!("no path is followed: {fault}");
            }
            self.zone_fault = fault;
        }
    }

    /// Takes the frame of a pose or a map; what is known of another epoch is dropped.
    fn frame_seen(&mut self, frame: &str) {
        match self.frames.frame_seen(frame) {
            FrameNews::Same => {}
            // A path is sent again; one that came before may be of another epoch.
            FrameNews::First => self.driving.forget_path(),
            FrameNews::Changed => self.driving.forget_frame(),
        }
    }
}

fn as_scan(scan: &LaserScan, robot_from_laser: Pose2) -> DriverScan {
    let seen = scan.range_min..=scan.range_max;
    let range_m = |range: &f32| match range {
        range if seen.contains(range) => f64::from(*range),
        range if *range > scan.range_max => f64::INFINITY,
        _ => f64::NAN,
    };
    DriverScan {
        stamp_s: scan.stamp,
        robot_from_laser,
        first_rad: f64::from(scan.angle_min),
        step_rad: f64::from(scan.angle_increment),
        ranges_m: scan.ranges.iter().map(range_m).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use armor_convert::build_path;
    use armor_sdk::testing::{ReportKind, TestError, TestedComponent};

    use super::*;

    const LASER: (&str, &str) = ("frames", "laser,base_link,0.08,0,0.3,0,0,0");
    const TICK: Duration = Duration::from_millis(100);

    #[test]
    fn manual_velocities_reach_the_base_until_they_are_old_or_stop_is_ordered()
    -> Result<(), TestError> {
        let parameters = [("guarded", "false"), ("acceleration", "20m/s2"), ("speed", "50cm/s")];
        let mut driver = TestedComponent::build::<Driver>(&parameters)?;
        driver.start()?;
        let tick = |driver: &mut TestedComponent| -> Result<f64, TestError> {
            driver.tick_after(TICK)?;
            Ok(driver.last_output::<Twist>("velocity")?.linear.x)
        };
        assert_eq!(tick(&mut driver)?, 0.0, "nothing is ordered");
        driver.send("manual", &Twist::planar(0.4, 0.0))?;
        assert_eq!(tick(&mut driver)?, 0.4);
        driver.send("manual", &Twist::planar(3.0, 0.0))?;
        assert_eq!(tick(&mut driver)?, 0.5, "its fastest speed");
        driver.send("stop", &Flag { data: true })?;
        assert_eq!(tick(&mut driver)?, 0.0);
        driver.send("stop", &Flag { data: false })?;
        assert_eq!(tick(&mut driver)?, 0.5, "the order is still fresh");
        driver.pass_time(Duration::from_millis(500));
        assert_eq!(tick(&mut driver)?, 0.0, "the order is old");
        Ok(())
    }

    #[test]
    fn the_base_is_brought_to_rest_at_the_end() -> Result<(), TestError> {
        let mut driver = TestedComponent::build::<Driver>(&[("guarded", "false")])?;
        driver.start()?;
        driver.send("manual", &Twist::planar(0.3, 0.0))?;
        driver.tick_after(TICK)?;
        assert!(driver.last_output::<Twist>("velocity")?.linear.x > 0.0);
        driver.stop()?;
        assert_eq!(driver.last_output::<Twist>("velocity")?, Twist::default());
        Ok(())
    }

    /// Sends what a robot at the origin sees, no zones, and a path ahead; returns the speed that
    /// follows.
    fn follow(driver: &mut TestedComponent, pose: &str, path: &str) -> Result<f64, TestError> {
        driver.send("zones", &Zones { frame: pose.into(), ..Zones::default() })?;
        follow_among_zones(driver, pose, path)
    }

    fn follow_among_zones(
        driver: &mut TestedComponent,
        pose: &str,
        path: &str,
    ) -> Result<f64, TestError> {
        let stamp = driver.timestamp();
        let odom = Odometry { stamp, ..Odometry::default() };
        driver.send("odometry", &odom)?;
        let (angle_min, angle_increment, range_max) = (-1.0, 0.1, 10.0);
        let ranges = vec![9.0; 21].into();
        let scan = LaserScan {
            stamp,
            angle_min,
            angle_increment,
            range_max,
            ranges,
            ..Default::default()
        };
        driver.send("scan", &scan)?;
        let frame = pose.into();
        let located = PoseWithCovarianceStamped { stamp, frame, ..Default::default() };
        driver.send("pose", &located)?;
        let poses = [0.0, 1.0, 2.0].map(|x_m| Pose2::new(x_m, 0.0, 0.0));
        driver.send("path", &build_path(stamp, path, &poses))?;
        driver.tick_after(TICK)?;
        Ok(driver.last_output::<Twist>("velocity")?.linear.x)
    }

    #[test]
    fn without_the_laser_s_frame_a_scan_is_a_failure() -> Result<(), TestError> {
        let frames = ("frames", "lidar,base_link,0.08,0,0.3,0,0,0");
        let mut driver = TestedComponent::build::<Driver>(&[frames])?;
        driver.start()?;
        let error = driver.send("scan", &LaserScan::default()).expect_err("it fails").to_string();
        assert!(error.contains("where the frame `laser` is on the robot is not known"), "{error}");
        let named = [frames, ("laser_frame", "lidar")];
        let mut driver = TestedComponent::build::<Driver>(&named)?;
        driver.start()?;
        driver.send("scan", &LaserScan::default())?;
        Ok(())
    }

    #[test]
    fn the_robot_stands_until_path_and_pose_are_of_one_epoch() -> Result<(), TestError> {
        let mut driver = TestedComponent::build::<Driver>(&[LASER])?;
        driver.start()?;
        follow(&mut driver, "map", "map")?;
        assert!(follow(&mut driver, "map", "map")? > 0.0);
        assert_eq!(follow(&mut driver, "map#3f2a", "map")?, 0.0, "the planner is still behind");
        let changed = ReportKind::Event { name: "frame_changed".into(), value: 1.0 };
        assert_eq!(driver.reports(), std::slice::from_ref(&changed));
        follow(&mut driver, "map#3f2a", "map#3f2a")?;
        assert!(follow(&mut driver, "map#3f2a", "map#3f2a")? > 0.0);
        assert_eq!(driver.reports(), [changed], "it is reported once");
        Ok(())
    }

    #[test]
    fn the_robot_stands_until_the_zones_of_its_epoch_arrive() -> Result<(), TestError> {
        let mut driver = TestedComponent::build::<Driver>(&[LASER])?;
        driver.start()?;
        let mut speed = |zones: Option<&str>| -> Result<(f64, String), TestError> {
            if let Some(frame) = zones {
                driver.send("zones", &Zones { frame: frame.into(), ..Zones::default() })?;
            }
            follow_among_zones(&mut driver, "map", "map")?;
            let speed_mps = follow_among_zones(&mut driver, "map", "map")?;
            Ok((speed_mps, driver.last_output::<Progress>("progress")?.task))
        };
        assert_eq!(speed(None)?, (0.0, "waiting for the zones".into()));
        assert!(speed(Some("map"))?.0 > 0.0);
        assert_eq!(speed(Some("map#3f2a"))?, (0.0, "waiting for the zones".into()));
        Ok(())
    }

    #[test]
    fn a_path_into_a_no_go_zone_is_not_followed_to_its_end() -> Result<(), TestError> {
        let mut driver = TestedComponent::build::<Driver>(&[LASER])?;
        driver.start()?;
        let centre = Point { x: 0.75, ..Point::default() };
        let pond = Zone { name: "pond".into(), centre, radius: 0.5, ..Zone::default() };
        driver.send("zones", &Zones { frame: "map".into(), zones: vec![pond], stamp: 0.0 })?;
        for _ in 0..10 {
            assert_eq!(follow_among_zones(&mut driver, "map", "map")?, 0.0);
        }
        let progress = driver.last_output::<Progress>("progress")?;
        assert_eq!(progress.task, "standing before a zone");
        assert_eq!(progress.detail, "pond");
        Ok(())
    }

    #[test]
    fn a_map_of_the_wrong_size_is_a_failure() -> Result<(), TestError> {
        let mut driver = TestedComponent::build::<Driver>(&[])?;
        driver.start()?;
        let mut map = OccupancyGrid::default();
        (map.info.width, map.info.height, map.info.resolution) = (3, 2, 0.1);
        let error = driver.send("map", &map).expect_err("it fails").to_string();
        assert!(error.contains("the map's cells"), "{error}");
        Ok(())
    }
}
