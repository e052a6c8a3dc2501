//! STOP, control and driving.

use armor_sdk::control::Order;
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_sdk::orders::{GivenOrder, OrderEvent};

use super::*;

#[test]
fn stop_works_while_every_other_thread_hangs() {
    let scene = Scene::begin();
    let mut ready = scene.open("/api/stop/live").unwrap();
    let hang = scene.server.hang_workers();
    let (status, answer) = scene.send_json("POST", "/api/stop", "");
    assert_eq!((status, answer["stopped"].as_bool()), (200, Some(true)), "{answer}");
    write_json(&mut ready, r#"{"stop":true,"id":3}"#);
    let answer = read_json(&mut ready);
    assert_eq!((answer["stopped"].as_bool(), answer["id"].as_u64()), (Some(true), Some(3)));
    assert_eq!(*scene.robot.stops.lock(), [true, true]);
    drop(hang);
    let (_, system) = scene.get("/api/system");
    assert_eq!(body_json(&system)["stop"]["ordered"], true, "{system}");
}

#[test]
fn stop_gets_through_when_all_places_are_taken() {
    let scene = Scene::begin();
    let mut ready = scene.open("/api/stop/live").unwrap();
    // They send nothing, so they wait where STOP is accepted.
    let idle: Vec<_> = (0..300).map(|_| scene.connect()).collect();
    let (status, _) = scene.send_json("POST", "/api/stop", "");
    assert_eq!((status, &scene.robot.stops.lock()[..]), (200, &[true][..]));
    write_json(&mut ready, r#"{"stop":true}"#);
    assert_eq!(read_json(&mut ready)["stopped"], true, "a page keeps its connection");
    drop(idle);
}

#[test]
fn only_the_client_in_control_may_release_stop() {
    let scene = Scene::begin();
    assert_eq!(scene.send_json("POST", "/api/stop", "").0, 200);
    let (status, answer) = scene.send_json("POST", "/api/stop/release", r#"{"control":"x"}"#);
    assert_eq!(status, 403, "{answer}");
    let mut control = scene.open("/api/control").unwrap();
    let token = read_json(&mut control)["control"].as_str().unwrap().to_owned();
    assert_eq!(scene.open("/api/control").err(), Some(409), "another client");
    let body = format!("{{\"control\":\"{token}\"}}");
    assert_eq!(scene.send_json("POST", "/api/stop/release", &body).0, 200);
    assert_eq!(scene.send_json("POST", "/api/stop", "").0, 200);
    write_json(&mut control, r#"{"release":true}"#);
    assert_eq!(read_json(&mut control)["stopped"], false);
    assert_eq!(*scene.robot.stops.lock(), [true, false, true, false]);
    drop(control);
    wait_for("the seat", || scene.open("/api/control").ok());
    assert_eq!(scene.send_json("POST", "/api/stop/release", &body).0, 403, "an old token");
}

/// An executive that answers when the test does.
struct SlowExecutive {
    node: SystemNode,
    orders: std::sync::mpsc::Receiver<OrderEvent>,
}

impl SlowExecutive {
    fn start(scene: &Scene) -> Self {
        let registry = scene._registry.address().to_string();
        let options = NodeOptions { name: "executive".into(), kind: "executive".into(), registry };
        let node = SystemNode::start(&options, DEADLINE, |_| Ok(())).unwrap();
        let orders = node.orders();
        Self { node, orders }
    }

    fn next_order(&self) -> GivenOrder {
        loop {
            if let OrderEvent::Given(given) = self.orders.recv_timeout(DEADLINE).unwrap() {
                return given;
            }
        }
    }

    fn accept(&self, given: &GivenOrder) {
        self.node.answer(given.connection, given.request, true, "done".into());
    }
}

#[test]
fn a_release_that_is_repeated_while_the_executive_hangs_is_sent_once() {
    let scene = Scene::begin_without_robot();
    let executive = SlowExecutive::start(&scene);
    let stop = || {
        std::thread::scope(|threads| {
            let stopping = threads.spawn(|| scene.send_json("POST", "/api/stop", ""));
            let given = executive.next_order();
            executive.accept(&given);
            let (status, answer) = stopping.join().unwrap();
            assert_eq!((status, answer["means"].as_str()), (200, Some("paused")), "{answer}");
            given.order
        })
    };
    assert_eq!(stop(), Order::Pause);
    let mut control = scene.open("/api/control").unwrap();
    read_json(&mut control);
    write_json(&mut control, r#"{"release":true}"#);
    let given = executive.next_order();
    assert_eq!(given.order, Order::Resume);
    write_json(&mut control, r#"{"release":true}"#);
    // The server answers a ping as soon as it has read what was sent before.
    control.send(tungstenite::Message::Ping(Vec::new().into())).unwrap();
    assert!(matches!(control.read(), Ok(tungstenite::Message::Pong(_))));
    executive.accept(&given);
    assert_eq!(read_json(&mut control)["stopped"], false);
    assert_eq!(stop(), Order::Pause, "no second release");
}

#[test]
fn the_robot_stops_when_messages_end_and_when_the_connection_breaks() {
    let scene = Scene::begin();
    let drive = r#"{"drive":{"forward_mps":9,"turn_radps":0.25}}"#;
    let stands = |count: usize| {
        let velocities = || scene.robot.velocities.lock().clone();
        wait_for("a halt", || (velocities().len() >= count).then_some(()));
        let all = velocities();
        assert_eq!((all.len(), all[count - 2], all[count - 1]), (count, (0.5, 0.25), (0.0, 0.0)));
    };
    let mut control = scene.open("/api/control").unwrap();
    assert_eq!(read_json(&mut control)["drive"]["speed_mps"], 0.5);
    write_json(&mut control, drive);
    stands(2);
    write_json(&mut control, drive);
    drop(control);
    stands(4);
    let mut control = wait_for("the seat", || scene.open("/api/control").ok());
    read_json(&mut control);
    write_json(&mut control, drive);
    wait_for("the drive", || (scene.robot.velocities.lock().len() == 5).then_some(()));
    let mut other = scene.open("/api/control?take=true").unwrap();
    assert!(read_json(&mut other)["control"].is_string());
    stands(6);
    assert!(read_json(&mut control)["lost"].is_string());
}

#[test]
fn no_velocity_is_published_during_stop_and_none_that_is_no_number() {
    let scene = Scene::begin();
    let mut control = scene.open("/api/control").unwrap();
    read_json(&mut control);
    for message in ["{\"drive\":{\"forward_mps\":1e999,\"turn_radps\":0}}", "{\"drive\":1}", "x"] {
        write_json(&mut control, message);
        assert!(read_json(&mut control)["error"]["what"].is_string());
    }
    assert_eq!(scene.send_json("POST", "/api/stop", "").0, 200);
    write_json(&mut control, r#"{"drive":{"forward_mps":0.2,"turn_radps":0}}"#);
    assert_eq!(read_json(&mut control)["error"]["what"], "STOP is in force");
    assert_eq!(*scene.robot.velocities.lock(), []);
}

#[test]
fn a_stop_that_reaches_nothing_is_an_error_that_says_so() {
    struct DeafRobot;
    impl RobotCommands for DeafRobot {
        fn limits(&self) -> DriveLimits {
            DriveLimits { speed_mps: 1.0, turn_radps: 1.0 }
        }
        fn drive(&self, _: f64, _: f64) -> Result<usize, String> {
            Ok(0)
        }
        fn stop(&self, _: bool) -> Result<usize, String> {
            Ok(0)
        }
    }
    let mut scene = Scene::begin();
    let options = WebOptions {
        listen: "127.0.0.1:0".parse().unwrap(),
        keys: None,
        registry: scene._registry.address().to_string(),
        author: "ruth".into(),
    };
    scene.server = WebServer::start(&options, Some(Arc::new(DeafRobot))).unwrap();
    let (status, answer) = scene.send_json("POST", "/api/stop", "");
    let what = answer["error"]["what"].as_str().unwrap_or_default();
    assert!(status == 504 && what.starts_with("STOP is not delivered"), "{status} {answer}");
    // Without a launcher it is not known that no executive will come.
    assert!(what.contains("the mission is not paused"), "{answer}");
}
