//! The standard messages, named and laid out as in ROS's `geometry_msgs`, `nav_msgs` and
//! `sensor_msgs`; units and axes by REP-103, frames by REP-105.
//!
//! Where ROS has a `std_msgs/Header`, these have `stamp` (system time, seconds since the Unix
//! epoch) and `frame` (the frame's name). The types that end in `View` are those with bulk arrays as
//! [`Data::view`](crate::Data::view) reads them, without a copy.

pub use armor_wire::clock::Clock;
pub use armor_wire::config::ConfigurationState;

pub use crate::progress::ProgressPace;

mod definitions;
mod geometry;
mod navigation;
mod sensing;
mod standard;

pub use definitions::{DEFINITION_SOURCES, StandardDefinition, standard_definitions};
pub use geometry::{
    FrameTransform, FrameTransforms, Point, Pose, Pose2D, PoseArray, PoseStamped,
    PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, Twist, TwistWithCovariance, Vector3,
};
pub use navigation::{
    MapMetaData, OccupancyGrid, OccupancyGridUpdate, OccupancyGridUpdateView, OccupancyGridView,
    Odometry, Path, SlamDiagnostics, TrackedObject, Tracks, Zone, ZoneRule, Zones,
};
pub use sensing::{
    BatteryState, CompressedImage, CompressedImageView, Detection2D, Detection2DArray, Image,
    ImageView, Imu, LaserScan, LaserScanView, NavSatFix, NavSatService, NavSatStatus,
    PowerSupplyStatus,
};
pub use standard::{Count, Flag, Log, Number, Progress, Text};
