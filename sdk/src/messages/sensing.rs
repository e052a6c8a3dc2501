//! Measurements of sensors (`sensor_msgs`).

use armor_wire::{Array, Message};

use super::geometry::{Quaternion, Vector3};

/// One sweep of a planar laser range-finder.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire", view)]
pub struct LaserScan {
    /// System time in seconds of the first ray.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the laser; angles are about its z axis, 0 along x, counter-clockwise.
    pub frame: String,
    /// Angle of the first ray.
    #[message(unit = "rad")]
    pub angle_min: f32,
    /// Angle of the last ray.
    #[message(unit = "rad")]
    pub angle_max: f32,
    /// Angle from one ray to the next.
    #[message(unit = "rad")]
    pub angle_increment: f32,
    /// Time from one ray to the next.
    #[message(unit = "s")]
    pub time_increment: f32,
    /// Time from one sweep to the next.
    #[message(unit = "s")]
    pub scan_time: f32,
    /// Shortest range that can be measured.
    #[message(unit = "m")]
    pub range_min: f32,
    /// Longest range that can be measured.
    #[message(unit = "m")]
    pub range_max: f32,
    /// Strength of the return of each ray; empty if not measured.
    pub intensities: Array<f32>,
    /// Range of each ray; outside of `range_min..=range_max` or not finite: nothing seen.
    #[message(unit = "m")]
    pub ranges: Array<f32>,
}

/// An uncompressed image.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire", view)]
pub struct Image {
    /// System time in seconds of the exposure.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Optical frame of the camera: z ahead, x right, y down.
    pub frame: String,
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
    /// Layout of a pixel: `rgb8`, `bgr8`, `mono8`, `mono16`, …
    pub encoding: String,
    /// 1 if pixels of more than one byte are big-endian.
    pub is_bigendian: u8,
    /// Length of a row in bytes.
    #[message(unit = "B")]
    pub step: u32,
    /// The rows, top first.
    pub data: Array<u8>,
}

/// A compressed image.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire", view)]
pub struct CompressedImage {
    /// System time in seconds of the exposure.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Optical frame of the camera.
    pub frame: String,
    /// `jpeg` or `png`.
    pub format: String,
    /// The file.
    pub data: Array<u8>,
}

/// Something that was recognized in an image: what it is, how sure that is, and where it is in the image,
/// as a rectangle along rows and columns.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Detection2D {
    /// What it is, in the words of the detector: `person`.
    pub label: String,
    /// How sure the detector is; its README states the scale.
    pub score: f64,
    /// Column of the middle, in pixels from the left edge of the image.
    pub center_x: f64,
    /// Row of the middle, in pixels from the upper edge of the image.
    pub center_y: f64,
    /// Width in pixels.
    pub size_x: f64,
    /// Height in pixels.
    pub size_y: f64,
}

/// What was recognized in one image; none if the image was searched and nothing was found.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Detection2DArray {
    /// System time in seconds of the exposure of the image.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Optical frame of the camera.
    pub frame: String,
    /// Rows of the image.
    pub height: u32,
    /// Columns of the image.
    pub width: u32,
    /// The surest first.
    pub detections: Vec<Detection2D>,
}

/// A measurement of an inertial measurement unit.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Imu {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the unit.
    pub frame: String,
    /// Its orientation in the world; the covariance's first element is -1 if it has none.
    pub orientation: Quaternion,
    /// Row-major 3x3 about x, y, z.
    pub orientation_covariance: [f64; 9],
    /// Angular velocity.
    #[message(unit = "rad/s")]
    pub angular_velocity: Vector3,
    /// Row-major 3x3 about x, y, z.
    pub angular_velocity_covariance: [f64; 9],
    /// Linear acceleration, gravity included.
    #[message(unit = "m/s2")]
    pub linear_acceleration: Vector3,
    /// Row-major 3x3 along x, y, z.
    pub linear_acceleration_covariance: [f64; 9],
}

impl Default for Imu {
    fn default() -> Self {
        Self {
            stamp: 0.0,
            frame: String::new(),
            orientation: Quaternion::default(),
            orientation_covariance: [0.0; 9],
            angular_velocity: Vector3::default(),
            angular_velocity_covariance: [0.0; 9],
            linear_acceleration: Vector3::default(),
            linear_acceleration_covariance: [0.0; 9],
        }
    }
}

/// Kind of a satellite fix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum NavSatStatus {
    /// No position.
    #[default]
    NoFix,
    /// An unaugmented position.
    Fix,
    /// With satellite-based augmentation.
    SbasFix,
    /// With ground-based augmentation.
    GbasFix,
}

/// Satellite systems used; the numbers are `sensor_msgs/NavSatStatus`' bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct NavSatService {
    /// 1 GPS, 2 GLONASS, 4 Compass, 8 Galileo, added up.
    pub bits: u16,
}

/// A position from satellites, WGS 84.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct NavSatFix {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the antenna.
    pub frame: String,
    /// Kind of the fix.
    pub status: NavSatStatus,
    /// Systems used.
    pub service: NavSatService,
    /// Degrees, north positive.
    #[message(unit = "deg")]
    pub latitude: f64,
    /// Degrees, east positive.
    #[message(unit = "deg")]
    pub longitude: f64,
    /// Metres above the ellipsoid; NaN if unknown.
    #[message(unit = "m")]
    pub altitude: f64,
    /// Row-major 3x3 over east, north, up, in m².
    pub position_covariance: [f64; 9],
    /// 0 unknown, 1 approximated, 2 diagonal known, 3 known.
    pub position_covariance_type: u8,
}

/// State of the power supply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum PowerSupplyStatus {
    /// Not known.
    #[default]
    Unknown,
    /// It is being charged.
    Charging,
    /// It is being used.
    Discharging,
    /// It is neither charged nor used.
    NotCharging,
    /// It is full.
    Full,
}

/// State of a battery. A number that is not measured is NaN.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct BatteryState {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame, or place, of the battery.
    pub frame: String,
    /// Voltage.
    #[message(unit = "V")]
    pub voltage: f32,
    /// Temperature.
    #[message(unit = "degC")]
    pub temperature: f32,
    /// Current; negative when discharging.
    #[message(unit = "A")]
    pub current: f32,
    /// Current charge.
    #[message(unit = "Ah")]
    pub charge: f32,
    /// Charge when last full.
    #[message(unit = "Ah")]
    pub capacity: f32,
    /// Charge by design.
    #[message(unit = "Ah")]
    pub design_capacity: f32,
    /// 0..=1.
    pub percentage: f32,
    /// State of the power supply.
    pub power_supply_status: PowerSupplyStatus,
    /// Whether there is one.
    pub present: bool,
}
