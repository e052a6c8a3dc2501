//! A scan of a log as messages.

use armor_sdk::messages::{LaserScan, Odometry, Pose2D, Twist};
use armor_sdk::prelude::Array;

use crate::record::RecordedScan;

/// The scanners of these logs do not measure closer.
const RANGE_MIN_M: f32 = 0.02;

/// The odometry of a scan, with its stamp; in the frames `odom` and `base_link`.
pub fn make_odometry(scan: &RecordedScan) -> Odometry {
    let pose = scan.odometry;
    let planar = Pose2D { x: pose.x_m, y: pose.y_m, theta: pose.yaw_rad };
    Odometry::planar(scan.stamp_s, "odom", "base_link", planar, Twist::default())
}

/// The ranges of a scan, in the frame `laser`; from `range_max_m` on nothing was seen. `scan_time_s`
/// is the time since the scan before.
pub fn make_laser_scan(scan: &RecordedScan, range_max_m: f32, scan_time_s: f64) -> LaserScan {
    let ranges = scan.ranges_within(range_max_m);
    LaserScan {
        stamp: scan.stamp_s,
        frame: "laser".into(),
        angle_min: scan.beams.angle_min_rad as f32,
        angle_max: scan.beams.angle_rad(ranges.len().saturating_sub(1)) as f32,
        angle_increment: scan.beams.increment_rad as f32,
        time_increment: 0.0,
        scan_time: scan_time_s as f32,
        range_min: RANGE_MIN_M,
        range_max: scan.beams.range_max_m.map_or(range_max_m, |max_m| max_m as f32),
        intensities: Array::default(),
        ranges: ranges.into(),
    }
}
