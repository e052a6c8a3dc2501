//! Points, poses and velocities (`geometry_msgs`).

use armor_wire::Message;

/// A position in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Point {
    /// Forward, in metres.
    #[message(unit = "m")]
    pub x: f64,
    /// To the left, in metres.
    #[message(unit = "m")]
    pub y: f64,
    /// Up, in metres.
    #[message(unit = "m")]
    pub z: f64,
}

/// A vector; its unit is that of the field it is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Vector3 {
    /// Along or about the forward axis.
    pub x: f64,
    /// Along or about the left axis.
    pub y: f64,
    /// Along or about the up axis.
    pub z: f64,
}

/// A rotation as a unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Quaternion {
    /// Imaginary part along x.
    pub x: f64,
    /// Imaginary part along y.
    pub y: f64,
    /// Imaginary part along z.
    pub z: f64,
    /// Real part.
    pub w: f64,
}

impl Default for Quaternion {
    /// No rotation.
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

impl Quaternion {
    /// A rotation about the up axis, counter-clockwise, in radians.
    pub fn from_yaw(yaw_rad: f64) -> Self {
        let (sin, cos) = (yaw_rad / 2.0).sin_cos();
        Self { x: 0.0, y: 0.0, z: sin, w: cos }
    }

    /// The rotation about the up axis, in radians, in -pi..=pi.
    pub fn yaw_rad(&self) -> f64 {
        let Self { x, y, z, w } = *self;
        (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
    }
}

/// Position and orientation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Pose {
    /// Where.
    pub position: Point,
    /// Orientation.
    pub orientation: Quaternion,
}

/// Position and heading on the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Pose2D {
    /// Forward, in metres.
    #[message(unit = "m")]
    pub x: f64,
    /// To the left, in metres.
    #[message(unit = "m")]
    pub y: f64,
    /// Heading, counter-clockwise from x, in radians.
    #[message(unit = "rad")]
    pub theta: f64,
}

impl Pose {
    /// A pose on the ground plane.
    pub fn planar(pose: Pose2D) -> Self {
        Self {
            position: Point { x: pose.x, y: pose.y, z: 0.0 },
            orientation: Quaternion::from_yaw(pose.theta),
        }
    }

    /// Its projection onto the ground plane.
    pub fn to_planar(&self) -> Pose2D {
        Pose2D { x: self.position.x, y: self.position.y, theta: self.orientation.yaw_rad() }
    }
}

/// A pose in a frame at a time.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct PoseStamped {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame the pose is in.
    pub frame: String,
    /// The pose.
    pub pose: Pose,
}

/// Where a frame is in another one.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct FrameTransform {
    /// The frame that it is in; with its epoch if it has one, such as `map#3f2a`.
    pub parent: String,
    /// The frame.
    pub child: String,
    /// Its origin in the parent, in metres.
    #[message(unit = "m")]
    pub translation: Vector3,
    /// Its axes in the parent.
    pub rotation: Quaternion,
}

/// Where frames are in others at a time, as far as they move (ROS: `tf2_msgs/TFMessage`). A frame has
/// one parent, and one component publishes where it is.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct FrameTransforms {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// The frames.
    pub transforms: Vec<FrameTransform>,
}

/// Poses in one frame at one time, such as the hypotheses of a particle filter.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct PoseArray {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame the poses are in.
    pub frame: String,
    /// The poses.
    pub poses: Vec<Pose>,
}

/// A pose and how sure it is.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Row-major 6x6 over x, y, z, roll, pitch, yaw; m², m·rad, rad².
    pub covariance: [f64; 36],
}

impl Default for PoseWithCovariance {
    fn default() -> Self {
        Self { pose: Pose::default(), covariance: [0.0; 36] }
    }
}

/// A pose, how sure it is, in a frame at a time.
#[derive(Clone, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct PoseWithCovarianceStamped {
    /// System time in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Frame the pose is in.
    pub frame: String,
    /// The pose.
    pub pose: PoseWithCovariance,
}

/// A velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct Twist {
    /// In metres per second.
    #[message(unit = "m/s")]
    pub linear: Vector3,
    /// In radians per second.
    #[message(unit = "rad/s")]
    pub angular: Vector3,
}

impl Twist {
    /// A velocity on the plane: ahead in m/s, counter-clockwise in rad/s.
    pub fn planar(forward_mps: f64, yaw_radps: f64) -> Self {
        Self {
            linear: Vector3 { x: forward_mps, ..Vector3::default() },
            angular: Vector3 { z: yaw_radps, ..Vector3::default() },
        }
    }
}

/// A velocity and how sure it is.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
pub struct TwistWithCovariance {
    /// The velocity.
    pub twist: Twist,
    /// Row-major 6x6 over x, y, z, roll, pitch, yaw.
    pub covariance: [f64; 36],
}

impl Default for TwistWithCovariance {
    fn default() -> Self {
        Self { twist: Twist::default(), covariance: [0.0; 36] }
    }
}
