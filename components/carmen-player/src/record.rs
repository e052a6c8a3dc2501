//! The contents of a CARMEN log line once it is parsed: a scan, an odometry reading, a parameter.

use std::f64::consts::{FRAC_PI_2, PI};

/// A position and heading in the plane, in metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RecordedPose {
    /// Metres along x.
    pub x_m: f64,
    /// Metres along y.
    pub y_m: f64,
    /// Heading in radians, counter-clockwise from x.
    pub yaw_rad: f64,
}

/// Which of the robot's two lasers a scan is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mount {
    /// FLASER, ROBOTLASER1.
    Front,
    /// RLASER, ROBOTLASER2.
    Rear,
}

/// How the beams of a scan are laid out and how far they reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beams {
    /// Direction of the first (rightmost) beam in the laser's frame, radians.
    pub angle_min_rad: f64,
    /// Angle from one beam to the next, radians, positive to the left.
    pub increment_rad: f64,
    /// Largest range the line itself declares, metres; old lines declare none.
    pub range_max_m: Option<f64>,
}

impl Beams {
    /// Lays `count` beams over the half circle ahead, the first one to the right.
    ///
    /// The SICK scanners behind FLASER and RLASER measure every half, whole or quarter degree from
    /// -90°. An odd count (181, 361) includes +90°; an even one (180, 360) stops one beam short.
    pub fn half_circle(count: usize) -> Self {
        let steps = if count % 2 == 1 { count.max(2) - 1 } else { count.max(1) };
        Self { angle_min_rad: -FRAC_PI_2, increment_rad: PI / steps as f64, range_max_m: None }
    }

    /// Direction of beam `index` in the laser's frame, radians.
    pub fn angle_rad(&self, index: usize) -> f64 {
        self.angle_min_rad + self.increment_rad * index as f64
    }
}

/// One sweep of a laser, with the odometry its line carries.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedScan {
    /// Time of the measurement (the log's ipc_timestamp), seconds.
    pub stamp_s: f64,
    /// The laser it is from.
    pub mount: Mount,
    /// Where the beams point.
    pub beams: Beams,
    /// Ranges in metres as logged, first beam to the right.
    pub ranges_m: Vec<f32>,
    /// Pose of the laser as logged, in the odometry's frame.
    pub laser: RecordedPose,
    /// Pose of the robot by its odometry.
    pub odometry: RecordedPose,
}

impl RecordedScan {
    /// Returns the ranges with everything at or above `range_max_m` turned into +infinity.
    pub fn ranges_within(&self, range_max_m: f32) -> Vec<f32> {
        let seen = |&range: &f32| if range >= range_max_m { f32::INFINITY } else { range };
        self.ranges_m.iter().map(seen).collect()
    }
}

/// One reading of the wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedOdometry {
    /// Time of the reading (the log's ipc_timestamp), seconds.
    pub stamp_s: f64,
    /// Pose of the robot by its odometry.
    pub pose: RecordedPose,
    /// Forward speed, metres per second.
    pub speed_mps: f64,
    /// Turning speed, radians per second.
    pub turn_radps: f64,
}

/// A line that means something here.
#[derive(Clone, Debug, PartialEq)]
pub enum LogRecord {
    /// FLASER, RLASER, ROBOTLASER1 or ROBOTLASER2.
    Scan(RecordedScan),
    /// ODOM.
    Odometry(RecordedOdometry),
    /// PARAM, as name and value.
    Parameter(String, String),
}
