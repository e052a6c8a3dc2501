use super::*;
use crate::frame::{FrameError, PREFIX_LEN, to_bytes};
use crate::registry::ComponentEntry;
use crate::shared_memory::MemoryUse;

fn link(keep: Keep, wake: Wake) -> Purpose {
    let (data, schema) = ("laser.scan".into(), String::new());
    let (instance, schema_hash, paused) = (0, 0, false);
    let link = LinkRequest {
        data,
        instance,
        schema,
        schema_hash,
        keep,
        wake,
        paused,
        history: 1,
        memory: MemoryUse::Never,
        datagrams: false,
    };
    Purpose::Link { link }
}

fn entry() -> ComponentEntry {
    ComponentEntry {
        name: "laser".into(),
        kind: "laser".into(),
        instance: 3,
        pid: 1,
        host: "robot".into(),
        endpoint: "127.0.0.1:20001".into(),
    }
}

fn order(order: Order, take: bool) -> Command {
    Command::Order { request: 1, author: "x".into(), take, order }
}

/// Checks for each role whether it may, and that a refusal names the role that is needed.
fn check(request: &impl NeedsRole, least: Option<KeyRole>) {
    for role in KeyRole::ALL {
        let result = Preface::of_person("alice", role).check(request);
        assert_eq!(result.is_ok(), least.is_some_and(|least| role >= least), "{role} {result:?}");
        let Err(refusal) = result else { continue };
        assert_eq!(refusal.code, RefusalCode::Role);
        let named = match least {
            Some(least) => format!("needs the role {least}, and the key of alice has"),
            None => {
                "only for processes on the hosts of the system, not for the key of alice".into()
            }
        };
        assert!(refusal.text.contains(&named), "{refusal}");
    }
}

#[test]
fn every_role_may_read_and_none_may_take_the_place_of_a_process() {
    use KeyRole::Observer;
    for (purpose, least) in [
        (Purpose::Registry { entry: None }, Some(Observer)),
        (Purpose::Registry { entry: Some(entry()) }, None),
        (Purpose::Config, Some(Observer)),
        (link(Keep::Latest, Wake::Sleep), Some(Observer)),
        (link(Keep::Last { count: 9 }, Wake::Sleep), Some(Observer)),
        (link(Keep::ALL, Wake::Sleep), None),
        (link(Keep::Latest, Wake::Spin), None),
        (Purpose::Control { role: Role::Observer }, Some(Observer)),
        (Purpose::Control { role: Role::Operator }, Some(Observer)),
        (Purpose::Control { role: Role::Executive }, None),
        (Purpose::Control { role: Role::Launcher }, None),
    ] {
        check(&purpose, least);
    }
}

#[test]
fn any_role_may_bring_the_robot_to_rest_and_operators_command() {
    use KeyRole::{Engineer, Observer, Operator};
    let transition = || "go".to_owned();
    for (command, least) in [
        (Command::Status { request: 1 }, Some(Observer)),
        (Command::Beat, Some(Observer)),
        (order(Order::Pause, false), Some(Observer)),
        (order(Order::Safe, false), Some(Observer)),
        (order(Order::Pause, true), Some(Operator)),
        (order(Order::Safe, true), Some(Operator)),
        (order(Order::Lease, false), Some(Operator)),
        (order(Order::Release, false), Some(Operator)),
        (order(Order::Rejoin, false), Some(Operator)),
        (order(Order::Resume, false), Some(Operator)),
        (order(Order::Fire { transition: transition() }, false), Some(Operator)),
        (order(Order::Confirm { transition: transition() }, false), Some(Operator)),
        (order(Order::Decline { transition: transition() }, false), Some(Operator)),
        (order(Order::Move { moves: Vec::new() }, false), Some(Operator)),
        (Command::SetLogFilter { request: 1, filter: "debug".into() }, Some(Engineer)),
        (Command::Activate { activation: 1, parameters: Vec::new() }, None),
        (Command::Freeze { activation: 1 }, None),
        (Command::Terminate, None),
        (Command::Acknowledge { report: 1 }, None),
    ] {
        check(&command, least);
    }
}

#[test]
fn only_an_engineer_sets_parameters() {
    use KeyRole::{Engineer, Observer};
    let (component, parameter) = ("driver".to_owned(), "speed".to_owned());
    for (request, least) in [
        (ConfigRequest::Settings { request: 1 }, Observer),
        (ConfigRequest::Parameter { request: 1, name: "speed".into() }, Observer),
        (ConfigRequest::List { request: 1, component: None, from: 0 }, Observer),
        (ConfigRequest::Diff { request: 1, from: None, to: None }, Observer),
        (ConfigRequest::Beat, Observer),
        (ConfigRequest::Set { request: 1, component, parameter, value: None }, Engineer),
    ] {
        check(&request, Some(least));
    }
}

#[test]
fn a_host_acts_for_the_components_that_the_file_places_there() {
    let rights = Rights::Host { components: vec!["laser".into()] };
    let arm = Preface { name: "robot".into(), rights };
    let check = |request: &dyn Fn(&Preface) -> Result<(), Refusal>, is_open: bool| {
        let result = request(&arm);
        assert_eq!(result.is_ok(), is_open, "{result:?}");
        let launcher = Preface { name: "base".into(), rights: Rights::Launcher };
        assert_eq!(request(&launcher), Ok(()));
    };
    let there = |name: &str, host: &str| {
        let endpoint = format!("{host}:20001");
        let (name, host) = (name.into(), host.into());
        Purpose::Registry { entry: Some(ComponentEntry { name, host, endpoint, ..entry() }) }
    };
    for (purpose, is_open) in [
        (there("laser", "robot"), true),
        (there("mapper", "robot"), false),
        (there("executive", "robot"), false),
        (there("laser", "base"), false),
        (Purpose::Registry { entry: Some(entry()) }, false),
        (Purpose::Registry { entry: None }, true),
        (Purpose::Config, true),
        (link(Keep::ALL, Wake::Spin), true),
        (Purpose::Control { role: Role::Observer }, true),
        (Purpose::Control { role: Role::Operator }, true),
        (Purpose::Control { role: Role::Executive }, false),
        (Purpose::Control { role: Role::Launcher }, false),
    ] {
        check(&|preface| preface.check(&purpose), is_open);
    }
    for (command, is_open) in [
        (order(Order::Resume, true), true),
        (Command::Activate { activation: 1, parameters: Vec::new() }, false),
        (Command::Terminate, false),
        (Command::SetLogFilter { request: 1, filter: "debug".into() }, false),
    ] {
        check(&|preface| preface.check(&command), is_open);
    }
    let (component, parameter) = ("driver".to_owned(), "speed".to_owned());
    let set = ConfigRequest::Set { request: 1, component, parameter, value: None };
    check(&|preface| preface.check(&set), false);
    assert_eq!(arm.name_author("root"), "root at robot");
    assert_eq!(Preface::of_person("alice", KeyRole::Operator).name_author("root"), "alice");
}

#[test]
fn a_role_is_known_by_its_name() {
    for role in KeyRole::ALL {
        assert_eq!(role.name().parse(), Ok(role));
    }
    assert!("Operator".parse::<KeyRole>().unwrap_err().contains("engineer"));
}

fn read_all(frames: &[(FrameKind, Vec<u8>)]) -> Result<(Hello, Option<Preface>), HandshakeError> {
    let mut opening = Opening::default();
    for (kind, bytes) in frames {
        let frame = Frame { kind: *kind, flags: 0, body: &bytes[PREFIX_LEN..] };
        if let Some(hello) = opening.read_frame(&frame)? {
            return Ok((hello, opening.into_preface()));
        }
    }
    panic!("no hello among the frames");
}

fn preface(name: &str, role: KeyRole) -> (FrameKind, Vec<u8>) {
    let preface = Preface::of_person(name, role);
    (FrameKind::Preface, to_bytes(FrameKind::Preface, &preface).unwrap())
}

fn hello(purpose: Purpose) -> (FrameKind, Vec<u8>) {
    let hello = Hello::new("tool-1", 5, purpose);
    (FrameKind::Hello, to_bytes(FrameKind::Hello, &hello).unwrap())
}

#[test]
fn a_connection_acts_for_itself_or_for_the_one_that_the_first_frame_names() {
    let (_, own) = read_all(&[hello(Purpose::Config)]).unwrap();
    assert_eq!(own, None);
    let frames = [preface("alice", KeyRole::Observer), hello(Purpose::Config)];
    let (_, alice) = read_all(&frames).unwrap();
    assert_eq!(alice, Some(Preface::of_person("alice", KeyRole::Observer)));
}

#[test]
fn rights_cannot_be_raised_by_a_second_preface_or_a_forged_name() {
    let twice = [preface("alice", KeyRole::Observer), preface("alice", KeyRole::Engineer)];
    let error = read_all(&twice).unwrap_err();
    assert!(matches!(error, HandshakeError::Frame(FrameError::Unexpected { .. })), "{error:?}");
    for name in ["", "a b", "\u{1b}[2J", &"x".repeat(65)] {
        let error = read_all(&[preface(name, KeyRole::Observer)]).unwrap_err();
        assert!(matches!(error, HandshakeError::Refused(_)), "{error:?}");
    }
    let role = Role::Executive;
    let forged = [preface("alice", KeyRole::Engineer), hello(Purpose::Control { role })];
    let error = read_all(&forged).unwrap_err();
    assert!(error.to_string().contains("Executive is only for"), "{error}");
}
