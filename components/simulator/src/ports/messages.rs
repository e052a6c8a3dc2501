//! Readings as messages.

use armor_sdk::prelude::*;

use crate::battery::Battery;
use crate::camera::CameraModel;
use crate::contact::ContactSide;
use crate::gps::Fix;
use crate::laser::LaserModel;
use crate::pose::Pose2;
use crate::simulation::{BaseMotion, STEP_S};

/// A heading, as a compass gives it.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct Heading {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the compass.
    pub frame: String,
    /// Anticlockwise from magnetic east.
    #[message(unit = "rad")]
    pub heading: f64,
}

/// The side of a base that touches something, a quarter of it each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
pub enum BumperSide {
    /// Nothing touches it.
    #[default]
    None,
    /// Within 45° of ahead.
    Front,
    /// Within 45° of the left.
    Left,
    /// Within 45° of backwards.
    Rear,
    /// Within 45° of the right.
    Right,
}

/// What a bumper feels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
pub struct Bumper {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Whether something touches it.
    pub contact: bool,
    /// Where.
    pub side: BumperSide,
}

/// A robot as others in the same world meet it: a round body on the sheet that all have drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
pub struct Presence {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Its pose on the sheet, y up.
    pub pose: Pose2D,
    /// Its radius.
    #[message(unit = "m")]
    pub radius: f64,
}

/// A covariance that marks its quantity as not measured.
const NOT_MEASURED: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

pub(super) fn build_odometry(stamp: f64, frame: &str, motion: BaseMotion) -> Odometry {
    let Pose2 { x_m, y_m, yaw_rad } = motion.pose;
    let pose = Pose2D { x: x_m, y: y_m, theta: yaw_rad };
    let twist = Twist::planar(motion.speed_mps, motion.turn_radps);
    Odometry::planar(stamp, frame, "base_link", pose, twist)
}

pub(super) fn build_scan(
    stamp: f64,
    frame: &str,
    laser: &LaserModel,
    rate_hz: f64,
    ranges: Vec<f32>,
) -> LaserScan {
    let (first_rad, increment_rad) = (laser.angle_min_rad(), laser.angle_increment_rad());
    let last = f64::from(laser.beam_count().saturating_sub(1));
    LaserScan {
        stamp,
        frame: frame.into(),
        angle_min: first_rad as f32,
        angle_max: (first_rad + last * increment_rad) as f32,
        angle_increment: increment_rad as f32,
        time_increment: 0.0,
        scan_time: (1.0 / rate_hz).max(STEP_S) as f32,
        range_min: laser.range_min_m as f32,
        range_max: laser.range_max_m as f32,
        ranges: Array::from(ranges),
        intensities: Array::from(Vec::new()),
    }
}

pub(super) fn battery_state(stamp: f64, battery: &Battery, current_a: f64) -> BatteryState {
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

pub(super) fn build_presence(stamp: f64, sheet_from_base: Pose2, radius: f64) -> Presence {
    let Pose2 { x_m: x, y_m: y, yaw_rad: theta } = sheet_from_base;
    Presence { stamp, pose: Pose2D { x, y, theta }, radius }
}

/// A turn rate; orientation and acceleration are not measured.
pub(super) fn build_imu(stamp: f64, turn_radps: f64, sigma_radps: f64) -> Imu {
    let mut angular_velocity_covariance = [0.0; 9];
    angular_velocity_covariance[8] = sigma_radps * sigma_radps;
    Imu {
        stamp,
        frame: "base_link".into(),
        orientation_covariance: NOT_MEASURED,
        angular_velocity: Vector3 { z: turn_radps, ..Vector3::default() },
        angular_velocity_covariance,
        linear_acceleration_covariance: NOT_MEASURED,
        ..Imu::default()
    }
}

pub(super) fn build_heading(stamp: f64, heading: f64) -> Heading {
    Heading { stamp, frame: "base_link".into(), heading }
}

/// A position; one that failed is not a number.
pub(super) fn build_fix(stamp: f64, fix: Option<Fix>) -> NavSatFix {
    let mut position_covariance = [0.0; 9];
    let variance_m2 = fix.map_or(0.0, |fix| fix.variance_m2);
    (position_covariance[0], position_covariance[4]) = (variance_m2, variance_m2);
    NavSatFix {
        stamp,
        frame: "base_link".into(),
        status: if fix.is_some() { NavSatStatus::Fix } else { NavSatStatus::NoFix },
        service: NavSatService { bits: 1 },
        latitude: fix.map_or(f64::NAN, |fix| fix.latitude_rad.to_degrees()),
        longitude: fix.map_or(f64::NAN, |fix| fix.longitude_rad.to_degrees()),
        altitude: fix.map_or(f64::NAN, |fix| fix.altitude_m),
        position_covariance,
        position_covariance_type: if fix.is_some() { 2 } else { 0 },
    }
}

pub(super) fn build_image(stamp: f64, frame: &str, camera: &CameraModel, rgb: Vec<u8>) -> Image {
    Image {
        stamp,
        frame: frame.into(),
        height: camera.height,
        width: camera.width,
        encoding: "rgb8".into(),
        is_bigendian: 0,
        step: 3 * camera.width,
        data: Array::from(rgb),
    }
}

pub(super) fn build_bumper(stamp: f64, contact: Option<ContactSide>) -> Bumper {
    let side = match contact {
        None => BumperSide::None,
        Some(ContactSide::Front) => BumperSide::Front,
        Some(ContactSide::Left) => BumperSide::Left,
        Some(ContactSide::Rear) => BumperSide::Rear,
        Some(ContactSide::Right) => BumperSide::Right,
    };
    Bumper { stamp, contact: contact.is_some(), side }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_in_degrees_and_a_failed_one_is_no_number() {
        let found =
            Fix { latitude_rad: 0.5, longitude_rad: -1.0, altitude_m: 3.0, variance_m2: 4.0 };
        let message = build_fix(1.0, Some(found));
        assert_eq!(
            (message.latitude, message.longitude),
            (0.5f64.to_degrees(), -1f64.to_degrees())
        );
        assert_eq!((message.position_covariance[4], message.status), (4.0, NavSatStatus::Fix));
        let failed = build_fix(1.0, None);
        assert!(failed.latitude.is_nan() && failed.status == NavSatStatus::NoFix);
    }

    #[test]
    fn a_picture_has_the_size_that_it_states() {
        let camera = CameraModel::default();
        let message = build_image(1.0, "camera", &camera, vec![7; 160 * 120 * 3]);
        assert_eq!(message.data.len(), (message.step * message.height) as usize);
    }

    #[test]
    fn a_scan_states_where_its_beams_are() {
        let laser = LaserModel::default();
        let scan = build_scan(5.0, "laser", &laser, 10.0, vec![1.0; laser.beam_count() as usize]);
        let last = scan.angle_min + (scan.ranges.len() - 1) as f32 * scan.angle_increment;
        assert!((last - scan.angle_max).abs() < 1e-5);
        assert!((scan.angle_max + scan.angle_min).abs() < 1e-6, "the middle beam looks ahead");
        assert_eq!((scan.stamp, scan.frame.as_str()), (5.0, "laser"));
    }

    #[test]
    fn a_motion_becomes_odometry_in_its_frame() {
        let motion =
            BaseMotion { pose: Pose2::new(1.0, 2.0, 0.5), speed_mps: 0.3, turn_radps: -0.2 };
        let message = build_odometry(7.0, "map", motion);
        let pose = message.pose.pose.to_planar();
        assert!((pose.x - 1.0).abs() + (pose.y - 2.0).abs() + (pose.theta - 0.5).abs() < 1e-9);
        assert_eq!(message.twist.twist, Twist::planar(0.3, -0.2));
        assert_eq!((message.frame.as_str(), message.child_frame.as_str()), ("map", "base_link"));
    }
}
