//! What can be set about a simulated robot, and which number of its models each parameter is.

use std::f64::consts::TAU;

use armor_sdk::prelude::*;

use crate::drive::DriveKind;
use crate::people::Manners;
use crate::simulation::Models;

/// Every parameter; all are asked for.
pub(super) const PARAMETERS: &[Parameter] = &[
    Parameter::path("world")
        .doc("drawing of the world, SVG, 1 user unit = 1 m; or the YAML file of a grid map"),
    Parameter::text("start").default("start").doc("id of the circle where the robot begins"),
    Parameter::number("start_x", "m")
        .default("0m")
        .range(-1000.0, 1000.0)
        .doc("where it begins if no circle is drawn: right on the sheet, or x in the grid map"),
    Parameter::number("start_y", "m")
        .default("0m")
        .range(-1000.0, 1000.0)
        .doc("down on the sheet, or y in the grid map"),
    Parameter::number("start_heading", "deg")
        .default("0deg")
        .range(-TAU, TAU)
        .doc("heading then, anticlockwise from x"),
    Parameter::integer("seed").default("1").range(0.0, 9e15).doc("seed of all noise"),
    Parameter::integer("beams").default("271").range(2.0, 10_000.0).doc("beams of a scan"),
    Parameter::number("laser_resolution", "deg")
        .default("0deg")
        .range(0.0, 1.0)
        .doc("angle from beam to beam instead of a number of beams; 0deg: by the number"),
    Parameter::number("field_of_view", "deg")
        .default("270deg")
        .range(0.01, TAU)
        .doc("angle from the first to the last beam"),
    Parameter::number("range", "m").default("10m").range(0.1, 500.0).doc("farthest range"),
    Parameter::number("range_min", "m")
        .default("0.02m")
        .range(0.0, 100.0)
        .doc("nearest range; what is nearer is lost"),
    Parameter::number("laser_sigma", "m")
        .default("0.01m")
        .range(0.0, 10.0)
        .doc("standard deviation of a range"),
    Parameter::number("laser_dropout", "")
        .default("0.002")
        .range(0.0, 1.0)
        .doc("share of beams that are lost, of those that something is in the way of"),
    Parameter::number("laser_short", "")
        .default("0")
        .range(0.0, 1.0)
        .doc("share of beams stopped by something that is not in the world"),
    Parameter::number("laser_short_rate", "")
        .default("0.5")
        .range(0.001, 100.0)
        .doc("how much more often near than far, per metre"),
    Parameter::number("laser_random", "")
        .default("0")
        .range(0.0, 1.0)
        .doc("share of beams that return anything up to the farthest range"),
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
    Parameter::choice("drive", &["differential", "ackermann"])
        .default("differential")
        .doc("two driven wheels, or steered like a car"),
    Parameter::number("max_speed", "m/s").default("1m/s").range(0.0, 20.0).doc("fastest speed"),
    Parameter::number("max_turn", "rad/s").default("2rad/s").range(0.0, 50.0).doc("fastest turn"),
    Parameter::number("acceleration", "m/s2")
        .default("1.5m/s2")
        .range(0.01, 1000.0)
        .doc("largest change of speed"),
    Parameter::number("turn_acceleration", "rad/s2")
        .default("6rad/s2")
        .range(0.01, 1000.0)
        .doc("largest change of turn rate"),
    Parameter::number("wheelbase", "m")
        .default("0.3m")
        .range(0.01, 20.0)
        .doc("ackermann: from the rear axle, where the base has its middle, to the front one"),
    Parameter::number("max_steering", "deg")
        .default("35deg")
        .range(0.01, 1.5)
        .doc("ackermann: largest angle of the front wheels"),
    Parameter::number("steering_rate", "rad/s")
        .default("2rad/s")
        .range(0.01, 50.0)
        .doc("ackermann: largest change of that angle"),
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
    Parameter::number("slip", "")
        .default("0")
        .range(0.0, 0.95)
        .doc("share of the turning of the wheels that moves nothing, always"),
    Parameter::number("slip_rate", "Hz")
        .default("0Hz")
        .range(0.0, 100.0)
        .doc("slippery moments, per second of driving"),
    Parameter::number("slip_duration", "s")
        .default("0.3s")
        .range(0.0, 60.0)
        .doc("how long such a moment lasts"),
    Parameter::number("slip_share", "")
        .default("0.5")
        .range(0.0, 0.95)
        .doc("share that moves nothing in such a moment"),
    Parameter::number("imu_rate", "Hz")
        .default("50Hz")
        .range(0.1, 100.0)
        .doc("readings of the gyroscope"),
    Parameter::number("gyro_sigma", "rad/s")
        .default("0.002rad/s")
        .range(0.0, 10.0)
        .doc("standard deviation of a turn rate"),
    Parameter::number("gyro_bias", "rad/s")
        .default("0rad/s")
        .range(-1.0, 1.0)
        .doc("bias at the start"),
    Parameter::number("gyro_walk", "rad/s")
        .default("0.0001rad/s")
        .range(0.0, 1.0)
        .doc("how far the bias walks in a second, standard deviation"),
    Parameter::number("compass_rate", "Hz")
        .default("10Hz")
        .range(0.1, 100.0)
        .doc("readings of the compass"),
    Parameter::number("compass_sigma", "deg")
        .default("2deg")
        .range(0.0, 3.15)
        .doc("standard deviation of a heading"),
    Parameter::number("declination", "deg")
        .default("0deg")
        .range(-3.15, 3.15)
        .doc("how far magnetic north lies east of true north"),
    Parameter::number("gps_rate", "Hz").default("1Hz").range(0.1, 100.0).doc("satellite positions"),
    Parameter::number("gps_sigma", "m")
        .default("0.5m")
        .range(0.0, 100.0)
        .doc("standard deviation of what is new in each position, along each axis"),
    Parameter::number("gps_wander", "m")
        .default("1.5m")
        .range(0.0, 100.0)
        .doc("standard deviation of its slow error, along each axis"),
    Parameter::number("gps_wander_time", "s")
        .default("60s")
        .range(0.1, 1e6)
        .doc("how long that takes to change"),
    Parameter::number("gps_dropout", "")
        .default("0.01")
        .range(0.0, 1.0)
        .doc("share of positions that fail"),
    Parameter::number("datum_latitude", "deg")
        .default("50deg")
        .range(-1.5, 1.5)
        .doc("where the origin of the drawing is on the earth, whose x points east"),
    Parameter::number("datum_longitude", "deg")
        .default("10deg")
        .range(-3.15, 3.15)
        .doc("where the origin of the drawing is on the earth"),
    Parameter::number("datum_altitude", "m")
        .default("100m")
        .range(-1000.0, 10000.0)
        .doc("height of the floor above the ellipsoid"),
    Parameter::integer("camera_width")
        .default("160")
        .range(1.0, 4096.0)
        .doc("columns of a picture"),
    Parameter::integer("camera_height").default("120").range(1.0, 4096.0).doc("rows of a picture"),
    Parameter::number("camera_field_of_view", "deg")
        .default("70deg")
        .range(0.01, 3.0)
        .doc("angle from the left to the right edge of a picture"),
    Parameter::number("camera_above", "m")
        .default("0.4m")
        .range(0.01, 10.0)
        .doc("camera above the floor"),
    Parameter::number("camera_ahead", "m")
        .default("0.1m")
        .range(-10.0, 10.0)
        .doc("camera ahead of the middle of the base"),
    Parameter::number("camera_rate", "Hz")
        .default("10Hz")
        .range(0.1, 100.0)
        .doc("pictures, if somebody is linked; one a second else"),
    Parameter::choice("people", &["stop", "bump", "none"])
        .default("stop")
        .doc("people that are drawn stop before a robot, walk into it, or are not there"),
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

/// Sets what a parameter is about in the models; false if it is about something else.
pub(super) fn set(models: &mut Models, name: &str, value: &Value) -> Result<bool, Fault> {
    match name {
        "seed" => models.seed = u64::try_from(value.integer()?)?,
        "beams" => models.laser.beams = u32::try_from(value.integer()?)?,
        "camera_width" => models.camera.width = u32::try_from(value.integer()?)?,
        "camera_height" => models.camera.height = u32::try_from(value.integer()?)?,
        "drive" => {
            models.drive.kind = match value.text()? {
                "ackermann" => DriveKind::Ackermann,
                _ => DriveKind::Differential,
            };
        }
        "people" => {
            models.people = match value.text()? {
                "bump" => Manners::Bump,
                "none" => Manners::Absent,
                _ => Manners::Stop,
            };
        }
        _ => {
            let Some(setting) = setting(models, name) else { return Ok(false) };
            *setting = value.number()?;
        }
    }
    Ok(true)
}

/// The number in the models that a parameter sets.
fn setting<'a>(models: &'a mut Models, name: &str) -> Option<&'a mut f64> {
    let Models { laser, drive, odometry, imu, compass, gps, camera, battery, rates, .. } = models;
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
        "laser_resolution" => &mut laser.resolution_rad,
        "range_min" => &mut laser.range_min_m,
        "laser_short" => &mut laser.short,
        "laser_short_rate" => &mut laser.short_per_m,
        "laser_random" => &mut laser.random,
        "wheelbase" => &mut drive.steering.wheelbase_m,
        "max_steering" => &mut drive.steering.limit_rad,
        "steering_rate" => &mut drive.steering.rate_radps,
        "slip" => &mut drive.slip.share,
        "slip_rate" => &mut drive.slip.events_hz,
        "slip_duration" => &mut drive.slip.event_s,
        "slip_share" => &mut drive.slip.event_share,
        "imu_rate" => &mut rates.imu_hz,
        "gyro_sigma" => &mut imu.sigma_radps,
        "gyro_bias" => &mut imu.bias_radps,
        "gyro_walk" => &mut imu.walk_radps,
        "compass_rate" => &mut rates.compass_hz,
        "compass_sigma" => &mut compass.sigma_rad,
        "declination" => &mut compass.declination_rad,
        "gps_rate" => &mut rates.gps_hz,
        "gps_sigma" => &mut gps.sigma_m,
        "gps_wander" => &mut gps.wander_m,
        "gps_wander_time" => &mut gps.wander_time_s,
        "gps_dropout" => &mut gps.dropout,
        "datum_latitude" => &mut gps.latitude_rad,
        "datum_longitude" => &mut gps.longitude_rad,
        "datum_altitude" => &mut gps.altitude_m,
        "camera_field_of_view" => &mut camera.field_of_view_rad,
        "camera_above" => &mut camera.above_m,
        "camera_ahead" => &mut camera.ahead_m,
        "camera_rate" => &mut rates.camera_hz,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_the_default_of_its_model() {
        let mut models = Models::default();
        let mut found = 0;
        for parameter in PARAMETERS.iter().map(Parameter::manifest) {
            if let Some(default) = &parameter.default
                && let Some(value) = setting(&mut models, &parameter.name)
            {
                let declared = armor_sdk::wire::quantity::parse(default).expect("a quantity").si;
                assert!((declared - *value).abs() < 1e-12, "{}", parameter.name);
                found += 1;
            }
        }
        // All others are texts, whole numbers, the start, the world, and how fast time passes.
        assert_eq!(PARAMETERS.len() - found, 13);
    }

    #[test]
    fn choices_and_whole_numbers_reach_the_models() {
        use armor_sdk::wire::manifest::ParameterValue;
        let mut models = Models::default();
        let mut set = |name: &str, value: ParameterValue| {
            let value = Value::new(value, std::path::Path::new(""));
            set(&mut models, name, &value).expect("a value that fits")
        };
        let text = |text: &str| ParameterValue::Text(text.into());
        assert!(set("drive", text("ackermann")) && set("people", text("bump")));
        assert!(set("camera_width", ParameterValue::Integer(320)));
        assert!(!set("world", text("office.svg")));
        assert_eq!((models.drive.kind, models.people), (DriveKind::Ackermann, Manners::Bump));
        assert_eq!(models.camera.width, 320);
    }
}
