//! The messages that a viewer may publish, in the forms in which viewers write them: those of ROS 2, as
//! CDR or JSON.

use armor_inspect::MessageDraft;
use armor_recording::ros::RosMessage;
use armor_sdk::messages::{Flag, PoseStamped, Twist};
use armor_wire::Message;
use armor_wire::codec;
use serde_json::Value;

use crate::viewer_protocol::{CDR, ClientChannel, JSON};

/// What a client orders with a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum PublishedMessage {
    /// On `/cmd_vel`.
    Velocity { forward_mps: f64, turn_radps: f64 },
    /// On `/stop`.
    Stop(bool),
    /// On `/goal_pose`.
    Goal(PoseStamped),
}

/// A topic that a client may publish on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PublishedTopic {
    Velocity,
    Stop,
    Goal,
}

/// A channel of a client, and how to read it.
#[derive(Debug)]
pub(super) struct PublishedChannel {
    topic: PublishedTopic,
    is_json: bool,
}

impl PublishedChannel {
    /// Accepts a channel of a client.
    ///
    /// # Errors
    /// In words, if its topic or encoding is unknown here.
    pub(super) fn accept(channel: &ClientChannel) -> Result<Self, String> {
        let topic = match channel.topic.trim_start_matches('/') {
            "cmd_vel" => PublishedTopic::Velocity,
            "stop" => PublishedTopic::Stop,
            "goal_pose" | "move_base_simple/goal" => PublishedTopic::Goal,
            other => {
                return Err(format!(
                    "`{}` is not taken from viewers: publish geometry_msgs/msg/Twist on /cmd_vel, \
                     std_msgs/msg/Bool on /stop, or geometry_msgs/msg/PoseStamped on /goal_pose",
                    other.escape_default()
                ));
            }
        };
        let is_json = match channel.encoding.as_str() {
            CDR => false,
            JSON => true,
            other => {
                let encoding = other.escape_default();
                return Err(format!("the encoding `{encoding}` is not taken: use cdr or json"));
            }
        };
        let expected = topic.ros_name();
        let given = channel.schema_name.replace("/msg/", "/");
        if !given.is_empty() && given != expected.replace("/msg/", "/") {
            let (topic, given) = (channel.topic.escape_default(), given.escape_default());
            return Err(format!("`{topic}` takes {expected}, not `{given}`"));
        }
        Ok(Self { topic, is_json })
    }

    /// Reads a message.
    ///
    /// # Errors
    /// In words, if it is none of the topic's type.
    pub(super) fn read(&self, payload: &[u8]) -> Result<PublishedMessage, String> {
        Ok(match self.topic {
            PublishedTopic::Velocity => {
                let twist: Twist = self.decode(payload)?;
                PublishedMessage::Velocity {
                    forward_mps: twist.linear.x,
                    turn_radps: twist.angular.z,
                }
            }
            PublishedTopic::Stop => PublishedMessage::Stop(self.decode::<Flag>(payload)?.data),
            PublishedTopic::Goal => PublishedMessage::Goal(check_goal(self.decode(payload)?)?),
        })
    }

    fn decode<T: Message>(&self, payload: &[u8]) -> Result<T, String> {
        decode_message(self.is_json, payload)
            .map_err(|error| format!("this is no {}: {error}", self.topic.ros_name()))
    }
}

impl PublishedTopic {
    fn ros_name(self) -> &'static str {
        match self {
            Self::Velocity => "geometry_msgs/msg/Twist",
            Self::Stop => "std_msgs/msg/Bool",
            Self::Goal => "geometry_msgs/msg/PoseStamped",
        }
    }
}

/// Reads a message of ROS 2.
///
/// # Errors
/// In words, if it is none of the type.
pub(super) fn decode_message<T: Message>(is_json: bool, payload: &[u8]) -> Result<T, String> {
    let schema = T::schema();
    let bytes = if is_json {
        let value: Value = serde_json::from_slice(payload).map_err(|error| error.to_string())?;
        let text = flatten_header(value)?.to_string();
        let draft = MessageDraft::parse(&schema, &[text]);
        let encoded = draft.and_then(|draft| draft.encode(0.0));
        encoded.map_err(|faults| faults.first().map_or_else(String::new, ToString::to_string))?
    } else {
        RosMessage::new(&schema).decode(payload, &[]).map_err(|error| error.to_string())?
    };
    codec::decode(&bytes).map_err(|error| error.to_string())
}

/// In Armor, the frame of a `std_msgs/Header` is a field of the message. The stamp is set when the
/// message is published.
fn flatten_header(mut value: Value) -> Result<Value, String> {
    let fields = value.as_object_mut().ok_or("it is no JSON object")?;
    if let Some(header) = fields.remove("header") {
        let frame = header.get("frame_id").cloned().unwrap_or_else(|| "".into());
        fields.insert("frame".into(), frame);
    }
    Ok(value)
}

fn check_goal(goal: PoseStamped) -> Result<PoseStamped, String> {
    let (place, turn) = (goal.pose.position, goal.pose.orientation);
    let numbers = [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w];
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err("a goal must consist of finite numbers".into());
    }
    if goal.frame.is_empty() {
        return Err("a goal needs the frame that its place is in, such as `map`".into());
    }
    Ok(goal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(topic: &str, encoding: &str, schema_name: &str) -> ClientChannel {
        let (topic, encoding) = (topic.into(), encoding.into());
        ClientChannel { id: 1, topic, encoding, schema_name: schema_name.into() }
    }

    fn accept(topic: &str, encoding: &str) -> PublishedChannel {
        PublishedChannel::accept(&channel(topic, encoding, "")).expect("accepted")
    }

    fn ros<T: Message>(message: &T) -> Vec<u8> {
        let bytes = codec::encode(message).expect("encoded");
        RosMessage::new(&T::schema()).encode(&bytes).expect("a message of ROS").bytes
    }

    #[test]
    fn both_encodings_of_each_topic_are_read() {
        let velocity = PublishedMessage::Velocity { forward_mps: 0.5, turn_radps: -0.25 };
        let drive = accept("/cmd_vel", CDR).read(&ros(&Twist::planar(0.5, -0.25)));
        assert_eq!(drive, Ok(velocity.clone()));
        let json = br#"{"linear":{"x":0.5,"y":0,"z":0},"angular":{"x":0,"y":0,"z":-0.25}}"#;
        assert_eq!(accept("cmd_vel", JSON).read(json), Ok(velocity));
        let stop = accept("/stop", CDR).read(&ros(&Flag { data: true }));
        assert_eq!(stop, Ok(PublishedMessage::Stop(true)));
        let json = br#"{"data":false}"#;
        assert_eq!(accept("/stop", JSON).read(json), Ok(PublishedMessage::Stop(false)));
        let mut goal = PoseStamped { frame: "map".into(), ..PoseStamped::default() };
        goal.pose.position.x = 2.0;
        let goal = PublishedMessage::Goal(goal);
        let json = br#"{"header":{"stamp":{"sec":5,"nanosec":6},"frame_id":"map"},
            "pose":{"position":{"x":2,"y":0,"z":0},"orientation":{"x":0,"y":0,"z":0,"w":1}}}"#;
        assert_eq!(accept("/goal_pose", JSON).read(json), Ok(goal.clone()));
        let PublishedMessage::Goal(pose) = &goal else { panic!("a goal") };
        assert_eq!(accept("/move_base_simple/goal", CDR).read(&ros(pose)), Ok(goal.clone()));
    }

    #[test]
    fn what_is_no_message_of_the_topic_is_refused() {
        for (topic, encoding, schema) in
            [("/tf", CDR, ""), ("/cmd_vel", "protobuf", ""), ("/cmd_vel", CDR, "std_msgs/msg/Bool")]
        {
            assert!(PublishedChannel::accept(&channel(topic, encoding, schema)).is_err());
        }
        let drive = accept("/cmd_vel", CDR);
        for bytes in [&[][..], &[0, 1, 0, 0], &[1, 1, 0, 0, 5], &[0xff; 100]] {
            assert!(drive.read(bytes).is_err(), "{bytes:?}");
        }
        for text in ["", "3", "{\"linear\":3}", "{\"speed\":1}", "{\"linear\":{\"x\":\"y\"}}"] {
            assert!(accept("/cmd_vel", JSON).read(text.as_bytes()).is_err(), "{text}");
        }
        let nowhere = br#"{"header":{"frame_id":""},"pose":{"position":{"x":1}}}"#;
        assert!(accept("/goal_pose", JSON).read(nowhere).is_err());
    }
}
