//! The standard messages that ROS has, too, and their fields in its order.

use std::sync::OnceLock;

use armor_sdk::messages::{
    BatteryState, CompressedImage, Count, Flag, FrameTransform, FrameTransforms, Image, Imu,
    LaserScan, Log, MapMetaData, NavSatFix, Number, OccupancyGrid, OccupancyGridUpdate, Odometry,
    Path, Point, Pose, Pose2D, PoseArray, PoseStamped, PoseWithCovariance,
    PoseWithCovarianceStamped, Quaternion, Text, Twist, TwistWithCovariance, Vector3,
};
use armor_wire::message::WireType;
use armor_wire::schema::Schema;

/// A message of ROS: its name, and its fields as [`STANDARD_FIELDS`] writes them.
pub(super) struct StandardMessage {
    schema: Schema,
    pub name: &'static str,
    pub fields: &'static str,
}

#[cfg(test)]
impl StandardMessage {
    pub fn schema(&self) -> &Schema {
        &self.schema
    }
}

/// Returns the message of ROS that is meant by a type of Armor: by one of the SDK, and not by another
/// one of its name.
pub(super) fn find_standard(schema: &Schema) -> Option<&'static StandardMessage> {
    list_all().iter().find(|standard| standard.schema == *schema)
}

/// Returns the type of Armor that a message of ROS means, by its name: `sensor_msgs/msg/LaserScan`.
pub(super) fn find_by_ros_name(name: &str) -> Option<&'static Schema> {
    let name = name.replace("/msg/", "/");
    list_all().iter().find(|standard| standard.name == name).map(|standard| &standard.schema)
}

fn list_all() -> &'static [StandardMessage] {
    static TABLE: OnceLock<Vec<StandardMessage>> = OnceLock::new();
    TABLE.get_or_init(list_standard)
}

/// The fields are separated by spaces. `header` is `stamp` and `frame`, `header<parent` the stamp of
/// the message around this one and the field `parent`; `name=field` is a field under another name,
/// `name:time` one that is a time, `name:TYPE` one that only ROS has, with its default;
/// `name:PACKAGE/TYPE{a,b}` a type of ROS around fields.
pub(super) fn list_standard() -> Vec<StandardMessage> {
    vec![
        of::<Point>("geometry_msgs/Point", "x y z"),
        of::<Vector3>("geometry_msgs/Vector3", "x y z"),
        of::<Quaternion>("geometry_msgs/Quaternion", "x y z w"),
        of::<Pose>("geometry_msgs/Pose", "position orientation"),
        of::<Pose2D>("geometry_msgs/Pose2D", "x y theta"),
        of::<PoseStamped>("geometry_msgs/PoseStamped", "header pose"),
        of::<PoseArray>("geometry_msgs/PoseArray", "header poses"),
        of::<PoseWithCovariance>("geometry_msgs/PoseWithCovariance", "pose covariance"),
        of::<PoseWithCovarianceStamped>("geometry_msgs/PoseWithCovarianceStamped", "header pose"),
        of::<Twist>("geometry_msgs/Twist", "linear angular"),
        of::<TwistWithCovariance>("geometry_msgs/TwistWithCovariance", "twist covariance"),
        of::<FrameTransform>(
            "geometry_msgs/TransformStamped",
            "header<parent child_frame_id=child transform:geometry_msgs/Transform{translation,rotation}",
        ),
        of::<FrameTransforms>("tf2_msgs/TFMessage", "transforms"),
        of::<MapMetaData>(
            "nav_msgs/MapMetaData",
            "map_load_time:time resolution width height origin",
        ),
        of::<OccupancyGrid>("nav_msgs/OccupancyGrid", "header info data"),
        of::<OccupancyGridUpdate>("map_msgs/OccupancyGridUpdate", "header x y width height data"),
        of::<Path>("nav_msgs/Path", "header poses"),
        of::<Odometry>("nav_msgs/Odometry", "header child_frame_id=child_frame pose twist"),
        of::<LaserScan>(
            "sensor_msgs/LaserScan",
            "header angle_min angle_max angle_increment time_increment scan_time range_min range_max \
             ranges intensities",
        ),
        of::<Image>("sensor_msgs/Image", "header height width encoding is_bigendian step data"),
        of::<CompressedImage>("sensor_msgs/CompressedImage", "header format data"),
        of::<Imu>(
            "sensor_msgs/Imu",
            "header orientation orientation_covariance angular_velocity angular_velocity_covariance \
             linear_acceleration linear_acceleration_covariance",
        ),
        of::<NavSatFix>(
            "sensor_msgs/NavSatFix",
            "header status:sensor_msgs/NavSatStatus{status,service} latitude longitude altitude \
             position_covariance position_covariance_type",
        ),
        of::<BatteryState>(
            "sensor_msgs/BatteryState",
            "header voltage temperature current charge capacity design_capacity percentage \
             power_supply_status power_supply_health:uint8 power_supply_technology:uint8 present \
             cell_voltage:float32[] cell_temperature:float32[] location:string serial_number:string",
        ),
        of::<Flag>("std_msgs/Bool", "data"),
        of::<Number>("std_msgs/Float64", "data"),
        of::<Text>("std_msgs/String", "data"),
        of::<Count>("std_msgs/UInt64", "data=count"),
        of::<Log>("rcl_interfaces/Log", "stamp:time level name msg file function line"),
    ]
}

fn of<T: WireType>(name: &'static str, fields: &'static str) -> StandardMessage {
    StandardMessage { schema: T::schema(), name, fields }
}

/// How an enum of the SDK is a small number in ROS.
pub(super) struct SmallNumber {
    /// The number of its first variant.
    pub first: i8,
    /// The type in ROS.
    pub type_name: &'static str,
}

/// Returns it for the enums of the standard messages.
pub(super) fn find_small_number(enum_name: &str, variants: usize) -> Option<SmallNumber> {
    match (enum_name, variants) {
        ("NavSatStatus", 4) => Some(SmallNumber { first: -1, type_name: "int8" }),
        ("PowerSupplyStatus", 5) => Some(SmallNumber { first: 0, type_name: "uint8" }),
        _ => None,
    }
}

/// Whether a struct of one number is that number in ROS.
pub(super) fn is_plain_number(struct_name: &str) -> bool {
    struct_name == "NavSatService"
}
