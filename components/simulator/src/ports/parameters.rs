//! What can be set about a simulated robot, and which number of its models each parameter is.

use std::f64::consts::PI;
use std::path::PathBuf;

use armor_convert::{locate_level, locate_on_base};
use armor_sdk::prelude::*;

use crate::battery::BatteryModel;
use crate::camera::CameraModel;
use crate::compass::CompassModel;
use crate::drive::{DriveKind, DriveModel};
use crate::gps::GpsModel;
use crate::imu::ImuModel;
use crate::laser::LaserModel;
use crate::odometry::OdometryModel;
use crate::people::Manners;
use crate::pose::Pose2;
use crate::reading::Rates;
use crate::simulation::Models;
use crate::slip::SlipModel;
use crate::steering::SteeringModel;
use crate::world::WorldStart;

/// An angle of one degree, in radians.
const DEG: f64 = PI / 180.0;
/// How high a camera is at least: lower, it sees nothing but the floor.
const LOWEST_CAMERA_M: f64 = 0.01;

/// What can be set in the file.
#[derive(Clone, Debug, Parameters)]
pub(super) struct SimulatorParameters {
    /// drawing of the world, SVG, 1 user unit = 1 m; or the YAML file of a grid map
    #[parameter(format = "file")]
    pub(super) world: PathBuf,
    /// id of the circle where the robot begins
    #[parameter(default = "start")]
    start: String,
    /// where it begins if no circle is drawn: right on the sheet, or x in the grid map
    #[parameter(unit = "m", default = "0m", range = -1000.0..=1000.0)]
    start_x_m: f64,
    /// down on the sheet, or y in the grid map
    #[parameter(unit = "m", default = "0m", range = -1000.0..=1000.0)]
    start_y_m: f64,
    /// heading then, anticlockwise from x
    #[parameter(unit = "deg", default = "0deg", range = -360.0 * DEG..=360.0 * DEG)]
    start_heading_rad: f64,
    /// seed of all noise
    #[parameter(default = 1, range = 0.0..=9e15)]
    seed: u64,
    /// beams of a scan
    #[parameter(default = 271, range = 2.0..=10_000.0)]
    beams: u32,
    /// angle from beam to beam instead of a number of beams; 0deg: by the number
    #[parameter(unit = "deg", default = "0deg", range = 0.0..=60.0 * DEG)]
    laser_resolution_rad: f64,
    /// angle from the first to the last beam
    #[parameter(unit = "deg", default = "270deg", range = 0.5 * DEG..=360.0 * DEG)]
    field_of_view_rad: f64,
    /// farthest range
    #[parameter(unit = "m", default = "10m", range = 0.1..=500.0)]
    range_m: f64,
    /// nearest range; what is nearer is lost
    #[parameter(unit = "m", default = "0.02m", range = 0.0..=100.0)]
    range_min_m: f64,
    /// standard deviation of a range
    #[parameter(unit = "m", default = "0.01m", range = 0.0..=10.0)]
    laser_sigma_m: f64,
    /// share of beams that are lost, of those that something is in the way of
    #[parameter(default = 0.002, range = 0.0..=1.0)]
    laser_dropout: f64,
    /// share of beams stopped by something that is not in the world
    #[parameter(default = 0, range = 0.0..=1.0)]
    laser_short: f64,
    /// how much more often near than far, per metre
    #[parameter(default = 0.5, range = 0.001..=100.0)]
    laser_short_rate: f64,
    /// share of beams that return anything up to the farthest range
    #[parameter(default = 0, range = 0.0..=1.0)]
    laser_random: f64,
    /// the frames of the file: where laser and camera are on the robot
    #[parameter(default = "", format = "frames")]
    pub(super) frames: Vec<FixedFrame>,
    /// the laser's frame; without it there are no scans
    #[parameter(default = "laser", format = "frame")]
    pub(super) laser_frame: String,
    /// the camera's frame; without it there are no pictures
    #[parameter(default = "camera", format = "frame")]
    pub(super) camera_frame: String,
    /// scans
    #[parameter(unit = "Hz", default = "10Hz", range = 0.1..=100.0)]
    scan_rate_hz: f64,
    /// odometry and truth
    #[parameter(unit = "Hz", default = "20Hz", range = 0.1..=100.0)]
    odometry_rate_hz: f64,
    /// radius of the round base
    #[parameter(unit = "m", default = "0.18m", range = 0.02..=5.0)]
    radius_m: f64,
    /// two driven wheels, or steered like a car
    #[parameter(
        default = "differential",
        choices("differential" = DriveKind::Differential, "ackermann" = DriveKind::Ackermann),
    )]
    drive: DriveKind,
    /// fastest speed
    #[parameter(unit = "m/s", default = "1m/s", range = 0.0..=20.0)]
    max_speed_mps: f64,
    /// fastest turn
    #[parameter(unit = "rad/s", default = "2rad/s", range = 0.0..=50.0)]
    max_turn_radps: f64,
    /// largest change of speed
    #[parameter(unit = "m/s2", default = "1.5m/s2", range = 0.01..=1000.0)]
    acceleration_mps2: f64,
    /// largest change of turn rate
    #[parameter(unit = "rad/s2", default = "6rad/s2", range = 0.01..=1000.0)]
    turn_acceleration_radps2: f64,
    /// ackermann: from the rear axle, where the base has its middle, to the front one
    #[parameter(unit = "m", default = "0.3m", range = 0.01..=20.0)]
    wheelbase_m: f64,
    /// ackermann: largest angle of the front wheels
    #[parameter(unit = "deg", default = "35deg", range = 0.5 * DEG..=85.0 * DEG)]
    max_steering_rad: f64,
    /// ackermann: largest change of that angle
    #[parameter(unit = "rad/s", default = "2rad/s", range = 0.01..=50.0)]
    steering_rate_radps: f64,
    /// age from which a velocity no longer counts and the base brakes
    #[parameter(unit = "s", default = "0.5s", range = 0.05..=10.0)]
    command_timeout_s: f64,
    /// odometry: variance of rotation per rotation squared
    #[parameter(default = 0.002, range = 0.0..=10.0)]
    alpha1: f64,
    /// odometry: variance of rotation per metre squared, rad2/m2
    #[parameter(default = 0.0005, range = 0.0..=10.0)]
    alpha2: f64,
    /// odometry: variance of length per metre squared
    #[parameter(default = 0.002, range = 0.0..=10.0)]
    alpha3: f64,
    /// odometry: variance of length per rotation squared, m2/rad2
    #[parameter(default = 0.0002, range = 0.0..=10.0)]
    alpha4: f64,
    /// odometry: measured length per true length
    #[parameter(default = 1.01, range = 0.5..=2.0)]
    odometry_scale: f64,
    /// odometry: turn to the left believed in per metre driven
    #[parameter(unit = "deg", default = "0.2deg", range = -60.0 * DEG..=60.0 * DEG)]
    odometry_bias_rad: f64,
    /// share of the turning of the wheels that moves nothing, always
    #[parameter(default = 0, range = 0.0..=0.95)]
    slip: f64,
    /// slippery moments, per second of driving
    #[parameter(unit = "Hz", default = "0Hz", range = 0.0..=100.0)]
    slip_rate_hz: f64,
    /// how long such a moment lasts
    #[parameter(unit = "s", default = "0.3s", range = 0.0..=60.0)]
    slip_duration_s: f64,
    /// share that moves nothing in such a moment
    #[parameter(default = 0.5, range = 0.0..=0.95)]
    slip_share: f64,
    /// readings of the gyroscope
    #[parameter(unit = "Hz", default = "50Hz", range = 0.1..=100.0)]
    imu_rate_hz: f64,
    /// standard deviation of a turn rate
    #[parameter(unit = "rad/s", default = "0.002rad/s", range = 0.0..=10.0)]
    gyro_sigma_radps: f64,
    /// bias at the start
    #[parameter(unit = "rad/s", default = "0rad/s", range = -1.0..=1.0)]
    gyro_bias_radps: f64,
    /// how far the bias walks in a second, standard deviation
    #[parameter(unit = "rad/s", default = "0.0001rad/s", range = 0.0..=1.0)]
    gyro_walk_radps: f64,
    /// readings of the compass
    #[parameter(unit = "Hz", default = "10Hz", range = 0.1..=100.0)]
    compass_rate_hz: f64,
    /// standard deviation of a heading
    #[parameter(unit = "deg", default = "2deg", range = 0.0..=180.0 * DEG)]
    compass_sigma_rad: f64,
    /// how far magnetic north lies east of true north
    #[parameter(unit = "deg", default = "0deg", range = -180.0 * DEG..=180.0 * DEG)]
    declination_rad: f64,
    /// satellite positions
    #[parameter(unit = "Hz", default = "1Hz", range = 0.1..=100.0)]
    gps_rate_hz: f64,
    /// standard deviation of what is new in each position, along each axis
    #[parameter(unit = "m", default = "0.5m", range = 0.0..=100.0)]
    gps_sigma_m: f64,
    /// standard deviation of its slow error, along each axis
    #[parameter(unit = "m", default = "1.5m", range = 0.0..=100.0)]
    gps_wander_m: f64,
    /// how long that takes to change
    #[parameter(unit = "s", default = "60s", range = 0.1..=1e6)]
    gps_wander_time_s: f64,
    /// share of positions that fail
    #[parameter(default = 0.01, range = 0.0..=1.0)]
    gps_dropout: f64,
    /// where the origin of the drawing is on the earth, whose x points east
    #[parameter(unit = "deg", default = "50deg", range = -85.0 * DEG..=85.0 * DEG)]
    datum_latitude_rad: f64,
    /// where the origin of the drawing is on the earth
    #[parameter(unit = "deg", default = "10deg", range = -180.0 * DEG..=180.0 * DEG)]
    datum_longitude_rad: f64,
    /// height of the floor above the ellipsoid
    #[parameter(unit = "m", default = "100m", range = -1000.0..=10000.0)]
    datum_altitude_m: f64,
    /// columns of a picture
    #[parameter(default = 160, range = 1.0..=4096.0)]
    camera_width: u32,
    /// rows of a picture
    #[parameter(default = 120, range = 1.0..=4096.0)]
    camera_height: u32,
    /// angle from the left to the right edge of a picture
    #[parameter(unit = "deg", default = "70deg", range = 0.5 * DEG..=170.0 * DEG)]
    camera_field_of_view_rad: f64,
    /// pictures, with a subscriber; one a second without
    #[parameter(unit = "Hz", default = "10Hz", range = 0.1..=100.0)]
    camera_rate_hz: f64,
    /// drawn people stop before a robot, walk into it, or are left out
    #[parameter(
        default = "stop",
        choices("stop" = Manners::Stop, "bump" = Manners::Bump, "none" = Manners::Absent),
    )]
    people: Manners,
    /// charge at the start, 0 to 1
    #[parameter(default = 1, range = 0.0..=1.0)]
    battery_level: f64,
    /// time from full to empty standing still
    #[parameter(unit = "s", default = "2h", range = 1.0..=1e7)]
    battery_endurance_s: f64,
    /// distance from full to empty, were driving all that drains it
    #[parameter(unit = "m", default = "5km", range = 1.0..=1e7)]
    battery_range_m: f64,
    /// level below which battery_low is reported, once
    #[parameter(default = 0.2, range = 0.0..=1.0)]
    pub(super) battery_warning: f64,
    /// times real time, 0: time stands; other than 1 only if <clock> follows this
    #[parameter(default = 1, range = 0.0..=100.0, live)]
    pub(super) speed: f64,
}

impl SimulatorParameters {
    /// Where to begin; no pose is given if all of it is zero, where no start could be.
    pub(super) fn start(&self) -> WorldStart {
        let pose = Pose2::new(self.start_x_m, self.start_y_m, self.start_heading_rad);
        let is_given = pose != Pose2::default();
        WorldStart { id: self.start.clone(), otherwise: is_given.then_some(pose) }
    }

    /// Where the laser is on the robot.
    pub(super) fn laser_mount(&self) -> Result<Pose2, String> {
        locate_level(&self.frames, &self.laser_frame).map_err(|why| why.to_string())
    }

    /// Where the camera is on the robot, and how high above the floor, in metres.
    pub(super) fn camera_mount(&self) -> Result<(Pose2, f64), String> {
        let mount = locate_level(&self.frames, &self.camera_frame);
        let placed = locate_on_base(&self.frames, &self.camera_frame);
        let (mount, placed) =
            mount.and_then(|mount| Ok((mount, placed?))).map_err(|why| why.to_string())?;
        let above_m = placed.translation.z;
        if above_m >= LOWEST_CAMERA_M {
            Ok((mount, above_m))
        } else {
            let frame = &self.camera_frame;
            Err(format!(
                "the frame `{frame}` is {above_m} m above the floor; give it a z above 1 cm"
            ))
        }
    }

    pub(super) fn models(&self) -> Models {
        // Without its frame no picture is published.
        let (mount, above_m) = self.camera_mount().unwrap_or((Pose2::IDENTITY, LOWEST_CAMERA_M));
        Models {
            laser: self.laser_model(),
            drive: self.drive_model(),
            odometry: OdometryModel {
                alpha1: self.alpha1,
                alpha2: self.alpha2,
                alpha3: self.alpha3,
                alpha4: self.alpha4,
                scale: self.odometry_scale,
                bias_rad_per_m: self.odometry_bias_rad,
            },
            imu: ImuModel {
                sigma_radps: self.gyro_sigma_radps,
                bias_radps: self.gyro_bias_radps,
                walk_radps: self.gyro_walk_radps,
            },
            compass: CompassModel {
                sigma_rad: self.compass_sigma_rad,
                declination_rad: self.declination_rad,
            },
            gps: GpsModel {
                latitude_rad: self.datum_latitude_rad,
                longitude_rad: self.datum_longitude_rad,
                altitude_m: self.datum_altitude_m,
                sigma_m: self.gps_sigma_m,
                wander_m: self.gps_wander_m,
                wander_time_s: self.gps_wander_time_s,
                dropout: self.gps_dropout,
            },
            camera: CameraModel {
                width: self.camera_width,
                height: self.camera_height,
                field_of_view_rad: self.camera_field_of_view_rad,
                mount,
                above_m,
            },
            battery: BatteryModel {
                initial_level: self.battery_level,
                endurance_s: self.battery_endurance_s,
                range_m: self.battery_range_m,
            },
            people: self.people,
            rates: Rates {
                scan_hz: self.scan_rate_hz,
                odometry_hz: self.odometry_rate_hz,
                imu_hz: self.imu_rate_hz,
                compass_hz: self.compass_rate_hz,
                gps_hz: self.gps_rate_hz,
                camera_hz: self.camera_rate_hz,
            },
            seed: self.seed,
        }
    }

    fn laser_model(&self) -> LaserModel {
        LaserModel {
            beams: self.beams,
            resolution_rad: self.laser_resolution_rad,
            field_of_view_rad: self.field_of_view_rad,
            range_min_m: self.range_min_m,
            range_max_m: self.range_m,
            sigma_m: self.laser_sigma_m,
            dropout: self.laser_dropout,
            short: self.laser_short,
            short_per_m: self.laser_short_rate,
            random: self.laser_random,
            // Without its frame no scan is published.
            mount: self.laser_mount().unwrap_or_default(),
        }
    }

    fn drive_model(&self) -> DriveModel {
        DriveModel {
            radius_m: self.radius_m,
            max_speed_mps: self.max_speed_mps,
            max_turn_radps: self.max_turn_radps,
            acceleration_mps2: self.acceleration_mps2,
            turn_acceleration_radps2: self.turn_acceleration_radps2,
            command_timeout_s: self.command_timeout_s,
            kind: self.drive,
            steering: SteeringModel {
                wheelbase_m: self.wheelbase_m,
                limit_rad: self.max_steering_rad,
                rate_radps: self.steering_rate_radps,
            },
            slip: SlipModel {
                share: self.slip,
                events_hz: self.slip_rate_hz,
                event_s: self.slip_duration_s,
                event_share: self.slip_share,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use armor_sdk::wire::manifest::ParameterValue;
    use armor_sdk::wire::text_format::parse_frames;

    use super::*;

    #[test]
    fn the_declared_defaults_and_the_usual_frames_are_those_of_the_models() {
        let expected = Models { seed: 1, ..Models::default() };
        let mut parameters = SimulatorParameters::defaults();
        let frames = "laser,base_link,0.08,0,0.2,0,0,0 camera,base_link,0.1,0,0.4,0,0,0";
        parameters.frames = parse_frames(frames).expect("two frames");
        assert_eq!(parameters.models(), expected);
    }

    #[test]
    fn a_sensor_without_a_place_has_none() {
        let mut parameters = SimulatorParameters::defaults();
        assert!(parameters.laser_mount().is_err() && parameters.camera_mount().is_err());
        let frames = "laser,base_link,0.3,0.1,0.2,0,0,1 camera,base_link,0.1,0,0,0,0,0";
        parameters.frames = parse_frames(frames).expect("two frames");
        assert_eq!(parameters.laser_mount(), Ok(Pose2::new(0.3, 0.1, 1.0)));
        let low = parameters.camera_mount().expect_err("it is on the floor");
        assert_eq!(low, "the frame `camera` is 0 m above the floor; give it a z above 1 cm");
    }

    #[test]
    fn choices_and_whole_numbers_reach_the_models() {
        let mut parameters = SimulatorParameters::defaults();
        let mut set = |name: &str, value: ParameterValue| {
            let value = Value::new(value, std::path::Path::new(""));
            parameters.set(name, &value).expect("a value that fits");
        };
        set("drive", ParameterValue::Text("ackermann".into()));
        set("people", ParameterValue::Text("bump".into()));
        set("camera_width", ParameterValue::Integer(320));
        let models = parameters.models();
        assert_eq!((models.drive.kind, models.people), (DriveKind::Ackermann, Manners::Bump));
        assert_eq!(models.camera.width, 320);
    }

    #[test]
    fn a_start_without_a_pose_is_the_drawn_one() {
        let mut parameters = SimulatorParameters::defaults();
        assert_eq!(parameters.start(), WorldStart { id: "start".into(), otherwise: None });
        parameters.start_y_m = 2.0;
        assert_eq!(parameters.start().otherwise, Some(Pose2::new(0.0, 2.0, 0.0)));
    }
}
