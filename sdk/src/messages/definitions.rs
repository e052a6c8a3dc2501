//! The list of the standard messages, for tools that show them and write them in other languages.

use armor_wire::codec;
use armor_wire::message::WireType;
use armor_wire::schema::{Schema, to_json};
use serde_json::Value;

/// The sources of the standard messages, which have their documentation.
pub const DEFINITION_SOURCES: [&str; 4] = [
    include_str!("geometry.rs"),
    include_str!("navigation.rs"),
    include_str!("sensing.rs"),
    include_str!("standard.rs"),
];

/// A standard message as data.
#[derive(Clone, Debug)]
pub struct StandardDefinition {
    /// Its layout, which has its name.
    pub schema: Schema,
    /// Its default as JSON; a number that is NaN is the text `NaN`.
    pub default: Value,
}

/// The default of a message as JSON.
fn default_of<M: WireType + Default>() -> Value {
    let bytes = codec::encode(&M::default()).unwrap_or_default();
    to_json(&M::schema(), &bytes).unwrap_or_default()
}

macro_rules! definitions_of {
    ($($name:ident)*) => {
        vec![$(StandardDefinition {
            schema: <super::$name as WireType>::schema(),
            default: default_of::<super::$name>(),
        },)*]
    };
}

/// Returns every standard message, each after those that it contains.
pub fn standard_definitions() -> Vec<StandardDefinition> {
    definitions_of![
        Point Vector3 Quaternion Pose Pose2D PoseStamped PoseArray PoseWithCovariance
        PoseWithCovarianceStamped Twist TwistWithCovariance FrameTransform FrameTransforms
        MapMetaData OccupancyGrid OccupancyGridUpdate Path SlamDiagnostics ZoneRule Zone Zones
        TrackedObject Tracks
        Odometry
        LaserScan Image CompressedImage Detection2D Detection2DArray Imu NavSatStatus NavSatService NavSatFix
        PowerSupplyStatus BatteryState
        Flag Number Text Count Log Progress
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_messages() {
        let definitions = standard_definitions();
        let default = |name: &str| {
            let is_it =
                |it: &&StandardDefinition| it.schema.to_string().starts_with(&format!("{name}{{"));
            definitions.iter().find(is_it).map(|it| it.default.clone()).unwrap_or_default()
        };
        assert_eq!(default("Quaternion")["w"], 1.0);
        assert_eq!(default("Progress")["fraction"], "NaN");
        assert_eq!(default("NavSatFix")["status"], "NoFix");
    }
}
