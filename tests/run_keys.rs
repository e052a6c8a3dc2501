//! Names and roles belong to the processes that the launcher has started. This test is a process of
//! the same user that it has not started.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};

use armor_sdk::control::{ControlConnection, Role};
use armor_wire::codec::decode_control;
use armor_wire::frame::{FrameKind, FrameReader, to_bytes};
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode};
use armor_wire::registry::ComponentEntry;

use crate::fixture::{DEADLINE, Folder, Run, run_to_end, wait_for};
use crate::resilience::system::Draft;

/// Registers under a name by hand. Returns the connection, which keeps the name.
fn register(registry: SocketAddr, name: &str) -> Result<TcpStream, Refusal> {
    let entry = ComponentEntry {
        name: name.into(),
        kind: name.into(),
        instance: 7,
        pid: std::process::id(),
        host: "here".into(),
        endpoint: "127.0.0.1:9".into(),
    };
    let mut stream = wait_for("the registry to listen", || TcpStream::connect(registry).ok());
    stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    let hello = Hello::new(name, 7, Purpose::Registry { entry: Some(entry) });
    let hello = to_bytes(FrameKind::Hello, &hello).expect("it fits");
    stream.write_all(&hello).expect("the registry reads");
    let mut reader = FrameReader::new();
    loop {
        if let Some(frame) = reader.next_frame().expect("frames") {
            return match frame.kind {
                FrameKind::Refusal => Err(decode_control(frame.body).expect("a refusal")),
                _ => Ok(stream),
            };
        }
        let len = stream.read(reader.space()).expect("an answer");
        reader.filled(len);
    }
}

fn order(folder: &Folder, run: &Run, arguments: &[&str]) -> (i32, String, String) {
    let registry = run.registry().to_string();
    run_to_end(folder.armor(arguments).args(["--registry", &registry]))
}

#[test]
fn the_name_of_a_component_that_is_started_is_free_only_when_an_operator_has_stopped_it() {
    let folder = Folder::new("names");
    // It never registers, as one that is dead.
    folder.script("sleeper", "exec sleep 600");
    let file = folder.system("names", &["lidar sleeper"]);
    let run = folder.run("out", &[&file, "--headless", "--components", "components"]);
    let registry = run.registry();
    wait_for("the launcher to reserve the name", || {
        let refusal = register(registry, "lidar").err()?;
        assert_eq!(refusal.code, RefusalCode::DuplicateName, "{refusal}");
        refusal.text.contains("`armor stop lidar` gives it free").then_some(())
    });
    for name in ["executive", "configd", "configuration"] {
        let refusal = register(registry, name).expect_err("it belongs to the launcher");
        assert_eq!(refusal.code, RefusalCode::DuplicateName, "{refusal}");
    }
    drop(register(registry, "other").expect("no process of the run has this name"));
    let (code, out, err) = order(&folder, &run, &["stop", "lidar"]);
    assert_eq!(code, 0, "{out}{err}");
    let by_hand = wait_for("the name to be free", || register(registry, "lidar").ok());
    drop(by_hand);
    let (_, out, err) = order(&folder, &run, &["restart", "lidar"]);
    wait_for(&format!("the name to be reserved again\n{out}{err}"), || {
        register(registry, "lidar").err()
    });
}

#[test]
fn only_the_executive_and_the_launcher_of_the_run_have_these_roles() {
    let draft = Draft::default().probe("worker", "rate='50Hz'", "");
    let system = draft.run(Folder::new("roles"));
    let entry = system.directory.find_process("worker", DEADLINE).expect("it registers");
    let connect = |role| ControlConnection::connect(&entry, role, "executive", |_| {});
    for role in [Role::Executive, Role::Launcher] {
        let error = connect(role).err().expect("it is refused").to_string();
        assert!(error.contains("only for the executive and the launcher of the run"), "{error}");
    }
    for role in [Role::Operator, Role::Observer] {
        let connection = connect(role).expect("tools are served");
        connection.status(DEADLINE).expect("it answers");
    }
    system.run.wait_for_log("a control connection as Executive is only for the executive", 1);
    wait_for("the worker to start", || (system.trace("worker").count("started") > 0).then_some(()));
    assert_eq!(system.trace("worker").count("started"), 1, "it was not ended");
}
