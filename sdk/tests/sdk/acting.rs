//! Connections that a gate forwards: what the role of a key allows at a component.

use std::io::{Read, Write};
use std::net::TcpStream;

use armor_sdk::control::{Answer, Command, Role};
use armor_sdk::prelude::*;
use armor_sdk::wire::acting::{KeyRole, Preface};
use armor_sdk::wire::codec;
use armor_sdk::wire::control::Order;
use armor_sdk::wire::frame::{self, FrameKind, FrameReader};
use armor_sdk::wire::hello::{self, Hello, Purpose};

use crate::bench_system::{DEADLINE, System};

/// The client behind a gate, after the gate has sent its preface.
struct RemoteTool {
    stream: TcpStream,
    frames: FrameReader,
}

impl RemoteTool {
    fn connect(system: &System, component: &str, role: KeyRole) -> Self {
        let stream = TcpStream::connect(system.entry(component).endpoint).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        let mut tool = Self { stream, frames: FrameReader::new() };
        let preface = Preface::of_person("alice", role);
        tool.stream.write_all(&frame::to_bytes(FrameKind::Preface, &preface).unwrap()).unwrap();
        assert_eq!(tool.hear().unwrap().0, FrameKind::Beat, "it is acknowledged");
        tool
    }

    /// Sends a hello; returns why it is refused.
    fn greet(&mut self, purpose: Purpose) -> Result<(), String> {
        let hello = Hello::new("tool-1", 5, purpose);
        self.stream.write_all(&frame::to_bytes(FrameKind::Hello, &hello).unwrap()).unwrap();
        let (kind, body) = self.hear().expect("an answer");
        let answer = frame::Frame { kind, flags: 0, body: &body };
        hello::read_answer(&answer).map(drop).map_err(|error| error.to_string())
    }

    /// Sends a command; returns the answer to it.
    fn ask(&mut self, command: &Command) -> (bool, String) {
        self.stream.write_all(&frame::to_bytes(FrameKind::Control, command).unwrap()).unwrap();
        loop {
            let (kind, body) = self.hear().expect("an answer");
            if kind == FrameKind::Control
                && let Answer::Ordered { accepted, text, .. } =
                    codec::decode_control(&body).unwrap()
            {
                return (accepted, text);
            }
        }
    }

    fn hear(&mut self) -> Option<(FrameKind, Vec<u8>)> {
        loop {
            if let Some(frame) = self.frames.next_frame().unwrap() {
                return Some((frame.kind, frame.body.to_vec()));
            }
            let len = self.stream.read(self.frames.space()).ok().filter(|len| *len > 0)?;
            self.frames.filled(len);
        }
    }
}

fn start_sink() -> System {
    let mut system = System::start();
    system.run("sink", &[], None, |_, _| Ok(Outcome::CarryOn));
    system
}

fn order(order: Order) -> Command {
    Command::Order { request: 7, author: "the president".into(), take: false, order }
}

#[test]
fn an_order_is_refused_below_its_role_and_passed_on_from_there() {
    let system = start_sink();
    let role = Role::Operator;
    for (key, command, needs) in [
        (KeyRole::Observer, order(Order::Resume), Some("operator")),
        (KeyRole::Observer, order(Order::Pause), None),
        (KeyRole::Operator, order(Order::Resume), None),
    ] {
        let mut tool = RemoteTool::connect(&system, "sink", key);
        tool.greet(Purpose::Control { role }).expect("any role may order to stop");
        let (accepted, text) = tool.ask(&command);
        assert!(!accepted, "this process is no executive");
        match needs {
            Some(needs) => assert!(text.contains(&format!("needs the role {needs}")), "{text}"),
            None => assert!(text.contains("takes no orders; the executive does"), "{text}"),
        }
    }
}

#[test]
fn the_log_is_changed_by_an_engineer_only() {
    let system = start_sink();
    let filter = || Command::SetLogFilter { request: 7, filter: "info".into() };
    for key in KeyRole::ALL {
        let mut tool = RemoteTool::connect(&system, "sink", key);
        tool.greet(Purpose::Control { role: Role::Operator }).unwrap();
        let (_, text) = tool.ask(&filter());
        assert_eq!(text.contains("needs the role engineer"), key < KeyRole::Engineer, "{text}");
    }
}

#[test]
fn no_key_takes_the_place_of_executive_or_launcher() {
    let system = start_sink();
    for role in [Role::Executive, Role::Launcher] {
        let mut tool = RemoteTool::connect(&system, "sink", KeyRole::Engineer);
        let why = tool.greet(Purpose::Control { role }).unwrap_err();
        assert!(why.contains("not for the key of alice"), "{why}");
        assert!(tool.hear().is_none(), "it is closed");
    }
}

#[test]
fn a_crowd_of_observers_who_may_stop_ends_no_operators_connection() {
    let system = start_sink();
    let mut operator = RemoteTool::connect(&system, "sink", KeyRole::Operator);
    operator.greet(Purpose::Control { role: Role::Operator }).unwrap();
    let crowd: Vec<_> = (0..40)
        .map(|_| {
            let mut tool = RemoteTool::connect(&system, "sink", KeyRole::Observer);
            tool.greet(Purpose::Control { role: Role::Operator }).unwrap();
            tool
        })
        .collect();
    let (_, text) = operator.ask(&order(Order::Resume));
    assert!(text.contains("takes no orders"), "{text}");
    drop(crowd);
}
