//! The output of a channel and its type, from what Armor or ROS 2 has written about it.

use std::collections::BTreeMap;

use armor_wire::schema::Schema;

use crate::ros::find_standard_type;
use crate::writer::OutputType;
use crate::{CDR, LATCHED_KEY, ROS_QOS, SCHEMA_KEY, TYPE_KEY};

/// The component of a topic of ROS without one.
const ROS_COMPONENT: &str = "ros";

/// The output of a channel and its type. Of a recording of ROS 2, the standard messages are those of
/// Armor.
pub(crate) fn identify_output(
    topic: &str,
    ros_type: &str,
    encoding: &str,
    metadata: &BTreeMap<String, String>,
) -> (String, OutputType) {
    let output_type = read_type(metadata);
    let standard = find_standard_type(ros_type).filter(|_| encoding == CDR);
    match standard {
        Some(schema) if output_type.schema.is_empty() => {
            let latched = metadata.get(ROS_QOS).is_some_and(|qos| is_transient_local(qos));
            (name_topic(topic), standard_output(schema, latched))
        }
        _ => (topic.into(), output_type),
    }
}

/// The type of an output with standard messages.
pub(crate) fn standard_output(schema: &Schema, latched: bool) -> OutputType {
    let name = match schema {
        Schema::Struct { name, .. } => name.as_str(),
        _ => "",
    };
    OutputType { name: name.into(), schema: schema.to_string(), latched }
}

/// Whether a publisher of ROS keeps its last message for late subscribers.
fn is_transient_local(qos: &str) -> bool {
    qos.split(['\n', ',']).any(|line| {
        let value = line.trim().trim_start_matches("- ").strip_prefix("durability:");
        matches!(value.map(str::trim), Some("1" | "transient_local"))
    })
}

/// Names the data of a topic: `/robot/base/scan` is `robot.base_scan`, and `/scan` is `ros.scan`.
pub(crate) fn name_topic(topic: &str) -> String {
    let mut parts = topic.split('/').filter(|part| !part.is_empty()).peekable();
    let first = parts.next().unwrap_or(ROS_COMPONENT);
    let rest: Vec<_> = parts.collect();
    match rest.as_slice() {
        [] => format!("{ROS_COMPONENT}.{first}"),
        rest => format!("{first}.{}", rest.join("_")),
    }
}

fn read_type(metadata: &BTreeMap<String, String>) -> OutputType {
    let text = |key: &str| metadata.get(key).cloned().unwrap_or_default();
    OutputType {
        name: text(TYPE_KEY),
        schema: text(SCHEMA_KEY),
        latched: text(LATCHED_KEY) == "true",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_ros_have_names_of_data_and_a_durability() {
        let names = ["/scan", "/robot/scan", "/robot/base/scan", "tf", "/"].map(name_topic);
        assert_eq!(names, ["ros.scan", "robot.scan", "robot.base_scan", "ros.tf", "ros.ros"]);
        assert!(is_transient_local("- history: 1\n  durability: 1\n  depth: 1\n"));
        assert!(is_transient_local("- durability: transient_local"));
        assert!(!is_transient_local("- durability: 2\n") && !is_transient_local(""));
    }
}
