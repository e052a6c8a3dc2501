//! What the sensors measure, and at which rates.

use crate::battery::Battery;
use crate::contact::ContactSide;
use crate::gps::Fix;
use crate::pose::Pose2;

/// The rates at which the sensors report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Scans per second.
    pub scan_hz: f64,
    /// Odometry, truth and presence per second.
    pub odometry_hz: f64,
    /// Readings of the gyroscope per second.
    pub imu_hz: f64,
    /// Readings of the compass per second.
    pub compass_hz: f64,
    /// Satellite positions per second.
    pub gps_hz: f64,
    /// Pictures per second.
    pub camera_hz: f64,
}

impl Default for Rates {
    fn default() -> Self {
        Self {
            scan_hz: 10.0,
            odometry_hz: 20.0,
            imu_hz: 50.0,
            compass_hz: 10.0,
            gps_hz: 1.0,
            camera_hz: 10.0,
        }
    }
}

/// Where the base is and how it moves, at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseMotion {
    /// The pose, in the frame of the sensor that measured it.
    pub pose: Pose2,
    /// Speed forward, in metres per second.
    pub speed_mps: f64,
    /// Turn rate, in radians per second.
    pub turn_radps: f64,
}

/// What a sensor measured.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorReading {
    /// The wheels: odom_from_base.
    Odometry(BaseMotion),
    /// The exact motion: map_from_base.
    Truth(BaseMotion),
    /// Where the base is for other robots: sheet_from_base.
    Presence(Pose2),
    /// Ranges from right to left, in metres; +∞ and NaN mean nothing seen.
    Scan(Vec<f32>),
    /// Turn rate by the gyroscope, in radians per second.
    Turn(f64),
    /// Heading by the compass, anticlockwise from magnetic east, in radians.
    Heading(f64),
    /// A position on the earth; none if the fix failed.
    Position(Option<Fix>),
    /// A picture, rows from the top, three bytes a pixel.
    Picture(Vec<u8>),
    /// The side that touches something, at the start and when it changes.
    Bumper(Option<ContactSide>),
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

/// A reading and its time, on the clock of the simulation's caller.
#[derive(Clone, Debug, PartialEq)]
pub struct Stamped {
    /// When it was taken, in seconds.
    pub time_s: f64,
    /// The reading.
    pub reading: SensorReading,
}
