//! The program itself, with viewers over real connections: data, driving and STOP, a viewer that reads
//! nothing, and requests that make no sense.

#![allow(clippy::unwrap_used, reason = "all of it is a test")]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_recording::ros::RosMessage;
use armor_registry::{BackgroundRegistry, RegistryOptions};
use armor_sdk::directory::Directory;
use armor_sdk::prelude::*;
use armor_sdk::tap::Tap;
use armor_sdk::wire::WireType;
use armor_sdk::wire::codec;
use armor_sdk::wire::keep::Keep;
use armor_sdk::wire::schema::to_json;
use parking_lot::Mutex;
use serde_json::{Value as Json, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::{HandshakeError, Message as Frame, WebSocket};

/// Only a hang takes this long.
const DEADLINE: Duration = Duration::from_secs(60);
const PROGRAM: &str = env!("CARGO_BIN_EXE_armor-foxglove");

/// Publishes odometry, a map once, and much that is long.
struct Robot {
    armor: Armor,
    ticks: u32,
}

impl Component for Robot {
    const KIND: &'static str = "robot";
    const SUMMARY: &'static str = "Publishes data and takes commands.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<Odometry>("odometry")?;
        armor.provide::<Latched<OccupancyGrid>>("map")?;
        armor.provide::<CompressedImage>("image")?;
        armor.subscribe::<Optional<Twist>>("velocity")?;
        armor.subscribe::<Optional<Flag>>("stop")?;
        Ok(Self { armor, ticks: 0 })
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        if header.id() == "stop" {
            COMMANDS.lock().push(format!("stop {}", data.decode::<Flag>()?.data));
        } else {
            let twist: Twist = data.decode()?;
            COMMANDS.lock().push(format!("{} {}", twist.linear.x, twist.angular.z));
        }
        Ok(())
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.ticks += 1;
        if self.ticks == 1 {
            self.armor.send_data("map", &make_map())?;
        }
        let pose = Pose2D { x: 1.5, ..Pose2D::default() };
        let odometry = Odometry::planar(2.5, "odom", "base_link", pose, Twist::default());
        self.armor.send_data("odometry", &odometry)?;
        let data = Array::from(vec![7_u8; 300_000]);
        let image = CompressedImage { format: "jpeg".into(), data, ..CompressedImage::default() };
        self.armor.send_data("image", &image)?;
        Ok(Outcome::CarryOn)
    }
}

/// What the one robot of this process has received that is linked to its program.
static COMMANDS: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn make_map() -> OccupancyGrid {
    let info = MapMetaData { width: 2, height: 1, resolution: 0.1, ..MapMetaData::default() };
    let data = Array::from(vec![0_i8, 100]);
    OccupancyGrid { stamp: 1.5, frame: "map".into(), info, data }
}

/// A registry, a robot, and the program.
struct Scene {
    address: String,
    registry: BackgroundRegistry,
    child: Child,
    log: Arc<Mutex<String>>,
}

impl Scene {
    fn begin(settings: &[&str]) -> Self {
        Self::begin_linked(settings, &[])
    }

    fn begin_linked(settings: &[&str], links: &[&str]) -> Self {
        let listen = "127.0.0.1:0".parse().unwrap();
        let options = RegistryOptions { listen, ..RegistryOptions::default() };
        let registry = BackgroundRegistry::start(options).unwrap();
        let at = registry.address().to_string();
        let arguments = ["--alone", "--registry", &at, "--rate", "50Hz"];
        let arguments: Vec<_> = arguments.iter().chain(links).map(Into::into).collect();
        // It ends with the test's process.
        std::thread::spawn(move || armor_sdk::run_with::<Robot>(arguments));
        let mut command = Command::new(PROGRAM);
        command.args(["--alone", "--name", "view", "--registry", &at, "--rate", "20Hz"]);
        let listen = format!("listen=127.0.0.1:{}", free_port());
        command.args(["--set", &listen]).stderr(Stdio::piped());
        for setting in settings {
            command.args(["--set", setting]);
        }
        let mut child = command.env_remove("ARMOR_LOG").spawn().unwrap();
        let log = Arc::<Mutex<String>>::default();
        let (heard, stderr) = (Arc::clone(&log), child.stderr.take().unwrap());
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                *heard.lock() += &(line + "\n");
            }
        });
        let address = wait_for("the server", || {
            let text = log.lock();
            let rest = text.split("viewers connect to ws://").nth(1)?;
            rest.lines().next().filter(|_| rest.contains('\n')).map(str::to_owned)
        });
        Self { address, registry, child, log }
    }

    fn viewer(&self) -> Viewer {
        let mut viewer = Viewer::connect(&self.address, None).unwrap();
        viewer.wait_for("the channels", |it| it.channels.contains_key("robot.map").then_some(()));
        viewer
    }

    /// The program's own numbers of its first client that has subscribed to something.
    fn read_client(&self, tap: &mut Option<Tap>) -> Option<Json> {
        let directory = Directory::observer(&self.registry.address().to_string(), "test");
        if tap.is_none() {
            *tap = Tap::open(&directory, "view.clients", Keep::Latest, DEADLINE).ok();
        }
        let tap = tap.as_mut()?;
        let data = tap.next(Duration::from_secs(2)).unwrap()?;
        let clients = to_json(tap.schema(), &data.payload).unwrap();
        let mut clients = clients["clients"].as_array()?.clone();
        clients.retain(|client| client["subscriptions"] != 0);
        clients.first().cloned()
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let log = self.log.lock();
        assert!(!log.contains("panicked"), "{log}");
    }
}

/// A port that is free now; if another program takes it meanwhile, the component waits for it.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

#[track_caller]
fn wait_for<T>(what: &str, mut find: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = find() {
            return found;
        }
        assert!(begin.elapsed() < DEADLINE, "never: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A viewer, and what it has received.
struct Viewer {
    socket: WebSocket<TcpStream>,
    channels: BTreeMap<String, Json>,
    texts: Vec<Json>,
    /// Payloads by subscription.
    data: BTreeMap<u32, Vec<Vec<u8>>>,
}

impl Viewer {
    /// Connects, or returns the status of the refusal.
    fn connect(address: &str, origin: Option<&str>) -> Result<Self, u16> {
        let mut request = format!("ws://{address}/").into_client_request().unwrap();
        let headers = request.headers_mut();
        headers.insert("Sec-WebSocket-Protocol", "foxglove.sdk.v1".parse().unwrap());
        if let Some(origin) = origin {
            headers.insert("Origin", origin.parse().unwrap());
        }
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => {
                let (channels, data) = (BTreeMap::new(), BTreeMap::new());
                Ok(Self { socket, channels, texts: Vec::new(), data })
            }
            Err(HandshakeError::Failure(tungstenite::Error::Http(response))) => {
                Err(response.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn read(&mut self) {
        match self.socket.read().unwrap() {
            Frame::Text(text) => {
                let text: Json = serde_json::from_str(&text).unwrap();
                for channel in text["channels"].as_array().into_iter().flatten() {
                    let topic = channel["topic"].as_str().unwrap().to_owned();
                    self.channels.insert(topic, channel.clone());
                }
                self.texts.push(text);
            }
            Frame::Binary(bytes) if bytes[0] == 1 => {
                let subscription = u32::from_le_bytes([bytes[1], bytes[2], bytes[3], bytes[4]]);
                self.data.entry(subscription).or_default().push(bytes[13..].to_vec());
            }
            _ => {}
        }
    }

    #[track_caller]
    fn wait_for<T>(&mut self, what: &str, mut find: impl FnMut(&Self) -> Option<T>) -> T {
        let begin = Instant::now();
        loop {
            if let Some(found) = find(self) {
                return found;
            }
            assert!(begin.elapsed() < DEADLINE, "never: {what}; {:?}", self.texts.last());
            self.read();
        }
    }

    fn wait_for_status(&mut self, part: &str) {
        self.wait_for(part, |it| {
            let is_it = |text: &&Json| text["message"].as_str().is_some_and(|it| it.contains(part));
            it.texts.iter().rev().find(is_it).map(drop)
        });
    }

    fn send(&mut self, request: &Json) {
        self.socket.send(Frame::text(request.to_string())).unwrap();
    }

    fn subscribe(&mut self, id: u32, topic: &str) {
        let channel = self.channels[topic]["id"].clone();
        let subscriptions = json!([{"id": id, "channelId": channel}]);
        self.send(&json!({"op": "subscribe", "subscriptions": subscriptions}));
    }

    fn advertise(&mut self, id: u32, topic: &str) {
        let channels = json!([{"id": id, "topic": topic, "encoding": "cdr", "schemaName": ""}]);
        self.send(&json!({"op": "advertise", "channels": channels}));
    }

    fn publish<T: Message>(&mut self, id: u32, message: &T) {
        let bytes = codec::encode(message).unwrap();
        let payload = RosMessage::new(&T::schema()).encode(&bytes).unwrap().bytes;
        let mut frame = vec![1];
        frame.extend_from_slice(&id.to_le_bytes());
        frame.extend_from_slice(&payload);
        self.socket.send(Frame::binary(frame)).unwrap();
    }

    /// The first message of a subscription, as Armor has it.
    fn first<T: Message>(&mut self, id: u32) -> T {
        let payload = self.wait_for("data", |it| it.data.get(&id)?.first().cloned());
        codec::decode(&RosMessage::new(&T::schema()).decode(&payload, &[]).unwrap()).unwrap()
    }
}

#[test]
fn data_arrive_as_they_were_published_also_what_was_published_before() {
    let scene = Scene::begin(&["hidden=robot.image"]);
    let mut viewer = scene.viewer();
    assert!(viewer.texts.iter().any(|text| text["op"] == "serverInfo"), "{:?}", viewer.texts);
    assert!(!viewer.channels.contains_key("robot.image"), "it is hidden");
    let map = &viewer.channels["robot.map"];
    assert_eq!(map["schemaName"], "nav_msgs/msg/OccupancyGrid");
    assert_eq!(map["schema"], RosMessage::new(&OccupancyGrid::schema()).definition());
    viewer.subscribe(1, "robot.odometry");
    viewer.subscribe(2, "robot.map");
    let odometry: Odometry = viewer.first(1);
    assert_eq!((odometry.stamp, odometry.pose.pose.position.x), (2.5, 1.5));
    assert_eq!(viewer.first::<OccupancyGrid>(2), make_map());
    let mut late = scene.viewer();
    late.subscribe(9, "robot.map");
    assert_eq!(late.first::<OccupancyGrid>(9), make_map(), "for a late viewer, too");
    viewer.subscribe(1, "robot.map");
    viewer.wait_for_status("the subscription 1 exists already");
    viewer.send(&json!({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 9999}]}));
    viewer.wait_for_status("there is no channel 9999");
}

#[test]
fn one_viewer_drives_and_the_robot_stops_when_it_is_gone_or_silent() {
    let links = ["--link=velocity=view.velocity,keep=50", "--link=stop=view.stop"];
    let scene = Scene::begin_linked(&["speed=0.5m/s"], &links);
    let commands = || COMMANDS.lock().clone();
    let last = |expected: &str| commands().last().is_some_and(|last| last == expected);
    let mut viewer = scene.viewer();
    viewer.advertise(1, "/cmd_vel");
    viewer.advertise(2, "/stop");
    // Until the links are up, a command reaches no component.
    wait_for("a velocity", || {
        viewer.publish(1, &Twist::planar(2.0, 0.25));
        commands().contains(&"0.5 0.25".to_owned()).then_some(())
    });
    wait_for("zero after silence", || last("0 0").then_some(()));
    let mut other = scene.viewer();
    other.advertise(1, "/cmd_vel");
    other.publish(1, &Twist::planar(0.1, 0.0));
    other.wait_for_status("another client drives");
    viewer.publish(1, &Twist::planar(0.25, 0.0));
    wait_for("the next velocity", || last("0.25 0").then_some(()));
    drop(viewer);
    wait_for("zero after the end", || last("0 0").then_some(()));
    wait_for("another viewer", || {
        other.publish(1, &Twist::planar(0.125, 0.0));
        commands().contains(&"0.125 0".to_owned()).then_some(())
    });
    other.advertise(2, "/stop");
    other.publish(2, &Flag { data: true });
    wait_for("STOP", || commands().contains(&"stop true".to_owned()).then_some(()));
    other.publish(1, &Twist::planar(0.1, 0.0));
    other.wait_for_status("STOP is in force");
    other.publish(2, &Flag { data: false });
    wait_for("its release", || last("stop false").then_some(()));
    other.advertise(3, "/clicked_point");
    other.publish(3, &Flag::default());
    other.wait_for_status("is not taken from viewers");
    let moved = commands();
    let moving: Vec<_> = moved.iter().filter(|it| it.as_str() == "0.1 0").collect();
    assert!(moving.is_empty(), "refused velocities moved it: {moved:?}");
}

#[test]
fn a_viewer_that_reads_nothing_loses_its_own_messages_and_costs_bounded_memory() {
    let scene = Scene::begin(&[]);
    let mut idle = scene.viewer();
    idle.subscribe(1, "robot.image");
    let mut tap = None;
    let client = wait_for("dropped messages", || {
        scene.read_client(&mut tap).filter(|client| client["dropped"].as_u64() > Some(20))
    });
    let waiting = client["waiting_bytes"].as_u64().unwrap();
    assert!(waiting <= 4 << 20, "{client}");
    let mut other = scene.viewer();
    other.subscribe(1, "robot.image");
    other.subscribe(2, "robot.odometry");
    other.wait_for("data of both", |it| {
        let count = |id| it.data.get(&id).map_or(0, Vec::len);
        (count(1) >= 20 && count(2) >= 20).then_some(())
    });
    // When it reads again, it learns how many it has missed.
    idle.wait_for_status("reads too slowly");
}

#[test]
fn requests_that_make_no_sense_end_nothing() {
    let scene = Scene::begin(&[]);
    let seed = fastrand::u64(..);
    println!("seed {seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    let requests = [
        r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]}"#,
        r#"{"op":"advertise","channels":[{"id":1,"topic":"/cmd_vel","encoding":"json"}]}"#,
        r#"{"op":"getParameters","parameterNames":[],"id":"x"}"#,
        r#"{"op":"setParameters","parameters":[{"name":"a.b","value":[{}]}]}"#,
        r#"{"op":"subscribeConnectionGraph"}"#,
        r#"{"op":"fetchAsset","uri":"file:///etc/passwd","requestId":1}"#,
        "\u{1}\u{1}\0\0\0\0\u{1}\0\0",
        "\u{2}\u{3}\0\0\0\u{9}\0\0\0\u{4}\0\0\0json{}",
    ];
    let mut viewer = scene.viewer();
    for _ in 0..3000 {
        let mut bytes = requests[dice.usize(..requests.len())].as_bytes().to_vec();
        for _ in 0..dice.usize(..4) {
            let at = dice.usize(..bytes.len());
            bytes[at] = dice.u8(..);
        }
        bytes.truncate(dice.usize(1..=bytes.len() * 4));
        let frame = match String::from_utf8(bytes) {
            Ok(text) if dice.bool() => Frame::text(text),
            Ok(text) => Frame::binary(text.into_bytes()),
            Err(error) => Frame::binary(error.into_bytes()),
        };
        viewer.socket.send(frame).unwrap();
    }
    viewer.wait_for_status("not understood");
    for origin in ["https://evil.example", "null"] {
        assert_eq!(Viewer::connect(&scene.address, Some(origin)).err(), Some(403), "{origin}");
    }
    assert!(Viewer::connect(&scene.address, Some("https://app.foxglove.dev")).is_ok());
    let mut other = scene.viewer();
    other.subscribe(1, "robot.odometry");
    assert_eq!(other.first::<Odometry>(1).stamp, 2.5);
}

#[test]
fn a_viewer_that_has_left_before_it_is_accepted_is_not_logged_as_refused() {
    let scene = Scene::begin(&[]);
    let send_signal = |signal: &str| {
        let mut kill = Command::new("kill");
        assert!(kill.arg(signal).arg(scene.child.id().to_string()).status().unwrap().success());
    };
    send_signal("-STOP");
    drop(TcpStream::connect(&scene.address).unwrap());
    send_signal("-CONT");
    // A later one is refused, and that is logged.
    assert_eq!(Viewer::connect(&scene.address, Some("https://evil.example")).err(), Some(403));
    let log = wait_for("its line in the log", || {
        Some(scene.log.lock().clone()).filter(|log| log.contains("evil.example"))
    });
    assert!(!log.contains("closed the connection"), "{log}");
}

#[test]
fn an_observer_may_stop_the_robot_and_nothing_else() {
    let scene = Scene::begin(&["role=observer"]);
    let mut viewer = scene.viewer();
    viewer.advertise(1, "/cmd_vel");
    viewer.publish(1, &Twist::planar(0.75, 0.0));
    viewer.wait_for_status("driving by hand needs the role operator");
    viewer.advertise(2, "/goal_pose");
    viewer.publish(2, &PoseStamped { frame: "map".into(), ..PoseStamped::default() });
    viewer.wait_for_status("setting a goal needs the role operator");
    let change = json!([{"name": "robot.x", "value": 1}]);
    viewer.send(&json!({"op": "setParameters", "parameters": change}));
    viewer.wait_for_status("setting a parameter needs the role engineer");
    viewer.advertise(3, "/stop");
    viewer.publish(3, &Flag { data: true });
    // Nothing is linked in this test, so it is carried out and reaches no component.
    viewer.wait_for_status("STOP is not delivered: no component takes it");
    viewer.publish(3, &Flag { data: false });
    viewer.wait_for_status("releasing STOP needs the role operator");
}
