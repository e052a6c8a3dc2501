//! The layout that is shipped fits what this component serves: topics, services, and a rate with which
//! the robot drives without a break.

use armor_inspect::DEAD_MAN;
use serde_json::Value;

use super::mission_services::MissionService;
use super::published_message::PublishedChannel;
use crate::viewer_protocol::{ClientChannel, JSON};

/// The settings of all panels, by their names, of which the part before `!` is the kind.
fn read_panels() -> Vec<(String, Value)> {
    let layout: Value = serde_json::from_str(include_str!("../../layout.json")).expect("JSON");
    let panels = layout["configById"].as_object().expect("panels");
    panels.iter().map(|(name, panel)| (name.clone(), panel.clone())).collect()
}

fn find_panel(name: &str) -> Value {
    read_panels().into_iter().find(|(it, _)| it == name).expect(name).1
}

#[test]
fn what_the_layout_publishes_is_taken() {
    let topics = [
        (find_panel("Teleop!drive")["topic"].clone(), "geometry_msgs/msg/Twist"),
        (find_panel("3D!robot")["publish"]["poseTopic"].clone(), "geometry_msgs/PoseStamped"),
        (find_panel("Publish!stop")["topicName"].clone(), "std_msgs/msg/Bool"),
        (find_panel("Publish!release")["topicName"].clone(), "std_msgs/msg/Bool"),
    ];
    for (topic, schema) in topics {
        let topic = topic.as_str().expect("a topic").to_owned();
        let (encoding, schema_name) = (JSON.to_owned(), schema.to_owned());
        let channel = ClientChannel { id: 1, topic, encoding, schema_name };
        PublishedChannel::accept(&channel).expect("it is taken");
    }
    let services = read_panels().into_iter().filter(|(name, _)| name.starts_with("CallService!"));
    for (panel, settings) in services {
        let called = settings["serviceName"].as_str().expect("a service").to_owned();
        assert!(MissionService::names().any(|name| name == called), "{panel}: {called}");
    }
}

#[test]
fn the_pad_sends_often_enough_for_the_dead_man() {
    let rate_hz = find_panel("Teleop!drive")["publishRate"].as_f64().expect("a rate");
    assert!(rate_hz * DEAD_MAN.as_secs_f64() > 2.0, "{rate_hz} Hz");
}

#[test]
fn what_the_layout_shows_is_in_the_mission() {
    let mission = include_str!("../../../../missions/foxglove.xml");
    let mut topics: Vec<String> = Vec::new();
    for (_, panel) in read_panels() {
        topics.extend(
            panel["topics"].as_object().into_iter().flatten().map(|(name, _)| name.clone()),
        );
        topics.extend(panel["imageMode"]["imageTopic"].as_str().map(str::to_owned));
        // A name with a point is quoted in a message path.
        let paths = panel["paths"].as_array().into_iter().flatten().map(|path| &path["value"]);
        for path in paths.chain([&panel["topicPath"]]).filter_map(Value::as_str) {
            topics.push(path.split('"').nth(1).expect("a quoted name").to_owned());
        }
    }
    assert!(topics.len() > 10, "{topics:?}");
    for topic in topics {
        let (component, _) = topic.split_once('.').expect("COMPONENT.OUTPUT");
        let is_there = mission.contains(&format!("<component name=\"{component}\""));
        assert!(is_there || component == "executive", "{topic}");
    }
}
