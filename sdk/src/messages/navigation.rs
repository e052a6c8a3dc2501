//! Maps, paths and odometry (`nav_msgs`).

use armor_wire::{Array, Message};

use super::geometry::{
    FrameTransform, FrameTransforms, Point, Pose, Pose2D, PoseStamped, PoseWithCovariance, Twist,
    TwistWithCovariance, Vector3,
};

/// How a map lies in its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct MapMetaData {
    /// System time in seconds when the map was made.
    #[message(unit = "s")]
    pub map_load_time: f64,
    /// Side of a cell in metres.
    #[message(unit = "m")]
    pub resolution: f32,
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
    /// Pose of the corner of cell (0, 0) in the map's frame.
    pub origin: Pose,
}

/// Which parts of the plane are occupied.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire", view)]
pub struct OccupancyGrid {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the map.
    pub frame: String,
    /// How it lies there.
    pub info: MapMetaData,
    /// Row-major from the origin, x first: -1 unknown, 0 free … 100 occupied.
    pub data: Array<i8>,
}

/// A rectangle of a map that has changed (`map_msgs`).
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire", view)]
pub struct OccupancyGridUpdate {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the map.
    pub frame: String,
    /// First cell along x, of the map published last.
    pub x: i32,
    /// First cell along y.
    pub y: i32,
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
    /// As in the map: row-major, x first.
    pub data: Array<i8>,
}

/// Poses to follow, in order.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Path {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the path.
    pub frame: String,
    /// The poses.
    pub poses: Vec<PoseStamped>,
}

/// Quality of mapping and localising, once per scan (our own; ROS has no such message).
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct SlamDiagnostics {
    /// System time of the scan, in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Number of particles.
    pub particles: u32,
    /// Effective number of particles: few when few carry all the weight.
    pub effective_particles: f64,
    /// Share of the scan's points that lie on surfaces of the map, 0 … 1.
    pub match_score: f64,
    /// Loops closed so far.
    pub closures: u64,
    /// Time the scan took, in seconds.
    #[message(unit = "s")]
    pub update_time: f64,
    /// Scans dropped because no odometry came for them.
    pub dropped: u64,
}

/// What a zone of the map requires of a robot (our own; ROS has no such message).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum ZoneRule {
    /// It must not enter.
    #[default]
    NoGo,
    /// It must not leave. Of several such zones, it must be in one.
    StayIn,
    /// It must not be faster than the zone's speed.
    Speed,
    /// Nothing: that a robot comes near it is reported.
    Observe,
}

/// An area of the map, with its boundary: a polygon or a circle (our own).
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Zone {
    /// Its name, unique among the zones.
    pub name: String,
    /// What it requires.
    pub kind: ZoneRule,
    /// Distance that the robot's outline must keep from it, in metres; from its boundary where the
    /// robot must stay in it.
    #[message(unit = "m")]
    pub margin: f64,
    /// Fastest speed in a `Speed` zone, in metres per second; 0 in the others.
    #[message(unit = "m/s")]
    pub speed: f64,
    /// Corners of the polygon, in either order, the first one not repeated; empty for a circle.
    pub polygon: Vec<Point>,
    /// Centre of the circle, if it is one.
    pub centre: Point,
    /// Radius of the circle, in metres; 0 for a polygon.
    #[message(unit = "m")]
    pub radius: f64,
}

/// All zones of a map; they replace those before (our own).
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Zones {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the map.
    pub frame: String,
    /// The zones.
    pub zones: Vec<Zone>,
}

/// Another vehicle, person or thing at a position, as it was last seen (our own).
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct TrackedObject {
    /// Its name among the tracks of the sender; the same one in each message.
    pub id: String,
    /// Its symbol identification code of APP-6(D): 20 digits, or the older 15 letters.
    pub sidc: String,
    /// Where it is.
    pub position: Point,
    /// Its velocity, in metres per second.
    pub velocity: Vector3,
    /// System time in seconds when it was there.
    #[message(unit = "s")]
    pub stamp: f64,
}

/// Others that are tracked: those of which there is news (our own).
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Tracks {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame of the positions and velocities.
    pub frame: String,
    /// What is tracked.
    pub tracks: Vec<TrackedObject>,
}

/// The robot's pose and velocity, estimated from its own motion.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Odometry {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame the pose is in, usually `odom`.
    pub frame: String,
    /// Frame the velocity is in and whose pose it is, usually `base_link`.
    pub child_frame: String,
    /// Pose of the child frame.
    pub pose: PoseWithCovariance,
    /// Velocity of the child frame, in the child frame.
    pub twist: TwistWithCovariance,
}

impl FrameTransforms {
    /// Where the odometry has its base in its frame.
    pub fn from_odometry(odometry: &Odometry) -> Self {
        let Pose { position: Point { x, y, z }, orientation } = odometry.pose.pose;
        let transform = FrameTransform {
            parent: odometry.frame.clone(),
            child: odometry.child_frame.clone(),
            translation: Vector3 { x, y, z },
            rotation: orientation,
        };
        Self { stamp: odometry.stamp, transforms: vec![transform] }
    }
}

impl Odometry {
    /// Odometry on the plane, with unknown covariances (all zero).
    pub fn planar(stamp: f64, frame: &str, child_frame: &str, pose: Pose2D, twist: Twist) -> Self {
        Self {
            stamp,
            frame: frame.into(),
            child_frame: child_frame.into(),
            pose: PoseWithCovariance { pose: Pose::planar(pose), ..Default::default() },
            twist: TwistWithCovariance { twist, ..Default::default() },
        }
    }
}
