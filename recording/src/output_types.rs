//! The output of a channel and its type, from what Armor or ROS 2 has written about it.

use std::collections::BTreeMap;

use armor_wire::schema::{Schema, parse};
use mcap::Channel;

use crate::head::{HEADS, HeadCodec};
use crate::ros::{RosMessage, find_standard_type, read_definition};
use crate::writer::OutputType;
use crate::{CDR, DATA_KEY, LATCHED_KEY, ROS_QOS, ROS2MSG, SCHEMA_KEY, TYPE_KEY};

/// The component of a topic of ROS without one.
const ROS_COMPONENT: &str = "ros";

/// What a file states about a channel.
#[derive(Clone, Copy)]
pub(crate) struct DescribedChannel<'a> {
    pub topic: &'a str,
    /// How its messages are encoded.
    pub encoding: &'a str,
    pub metadata: &'a BTreeMap<String, String>,
    pub definition: Option<&'a TypeDefinition>,
}

/// The definition of a type in a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct TypeDefinition {
    /// `PACKAGE/msg/TYPE`.
    pub name: String,
    /// The language of the text, such as `ros2msg`.
    pub encoding: String,
    pub text: Vec<u8>,
}

/// The output of a channel.
#[derive(Debug)]
pub(crate) struct ChannelOutput {
    /// Its unique name.
    pub data: String,
    pub output_type: OutputType,
    /// How its messages are read, or why they cannot be read.
    pub message: Result<RosMessage, String>,
}

/// The output of a channel. What Armor has written names its type; of others the standard messages are
/// those of Armor, and any other type is that of its definition.
pub(crate) fn identify_output(channel: DescribedChannel<'_>) -> ChannelOutput {
    let DescribedChannel { topic, encoding, metadata, definition } = channel;
    let own_type = read_type(metadata);
    let is_own = !own_type.schema.is_empty();
    let data = match metadata.get(DATA_KEY) {
        Some(data) if is_own => data.clone(),
        _ if is_own => topic.into(),
        _ => String::new(),
    };
    if topic == HEADS {
        let message = check_form(HeadCodec::new().message, definition);
        return ChannelOutput { data: topic.into(), output_type: own_type, message };
    }
    if encoding != CDR {
        let data = if is_own { data } else { topic.into() };
        let message = Err(format!("its messages are in the encoding `{encoding}`, not in CDR"));
        return ChannelOutput { data, output_type: own_type, message };
    }
    if is_own {
        let message = parse(&own_type.schema)
            .map_err(|error| format!("its type cannot be read: {error}"))
            .and_then(|schema| check_form(RosMessage::new(&schema), definition));
        return ChannelOutput { data, output_type: own_type, message };
    }
    let latched = metadata.get(ROS_QOS).is_some_and(|qos| is_transient_local(qos));
    match definition.map(find_type) {
        Some(Ok(schema)) => {
            let output_type = standard_output(&schema, latched);
            let message = Ok(RosMessage::new(&schema));
            ChannelOutput { data: name_topic(topic), output_type, message }
        }
        failed => {
            let reason = failed.and_then(Result::err);
            let reason = reason.unwrap_or_else(|| "the file has no definition of its type".into());
            ChannelOutput { data: topic.into(), output_type: own_type, message: Err(reason) }
        }
    }
}

/// Returns the form of an own type, if the file describes the same one. The form of a standard message
/// follows from a table of this version; another version may have written the type in another form.
fn check_form(
    message: RosMessage,
    definition: Option<&TypeDefinition>,
) -> Result<RosMessage, String> {
    let Some(definition) = definition else { return Ok(message) };
    let recorded = String::from_utf8_lossy(&definition.text);
    if definition.name == message.name()
        && list_fields(&recorded).eq(list_fields(message.definition()))
    {
        return Ok(message);
    }
    Err(format!(
        "another version of Armor has written its type as {} with other fields than this one, which \
         has {}; read it with that version",
        definition.name,
        message.name()
    ))
}

/// The lines of a definition, without comments.
fn list_fields(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    lines.filter(|line| !line.is_empty())
}

/// The name of the output of a channel of a file's summary.
pub(crate) fn name_output(channel: &Channel) -> String {
    identify_channel(channel).data
}

/// As [`identify_output`], of a channel of a file's summary.
pub(crate) fn identify_channel(channel: &Channel) -> ChannelOutput {
    let definition = channel.schema.as_ref().map(|schema| TypeDefinition {
        name: schema.name.clone(),
        encoding: schema.encoding.clone(),
        text: schema.data.to_vec(),
    });
    identify_output(DescribedChannel {
        topic: &channel.topic,
        encoding: &channel.message_encoding,
        metadata: &channel.metadata,
        definition: definition.as_ref(),
    })
}

/// The type of Armor that a type of ROS means, or why there is none.
fn find_type(definition: &TypeDefinition) -> Result<Schema, String> {
    let TypeDefinition { name, encoding, text } = definition;
    if let Some(standard) = find_standard_type(name) {
        return Ok(standard.clone());
    }
    if encoding != ROS2MSG {
        return Err(format!("its type {name} is defined in `{encoding}`, not in `{ROS2MSG}`"));
    }
    let fail = |reason: String| format!("its type {name} cannot be read: {reason}");
    let text = std::str::from_utf8(text).map_err(|error| fail(error.to_string()))?;
    let schema = read_definition(name, text).map_err(|error| fail(error.to_string()))?;
    // The limits of types are those of their text.
    parse(&schema.to_string()).map_err(|error| fail(error.to_string()))
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
