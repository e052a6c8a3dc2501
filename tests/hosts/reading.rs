//! What the processes of a host may read: what the file leads to its components, and nothing else.

use std::collections::BTreeMap;
use std::fs;
use std::process::Command;

use armor_keys::HostKeys;
use armor_keys::connect::GateClient;
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::{HandshakeError, Hello, LinkRequest, Purpose, RefusalCode, read_answer};
use armor_wire::keep::{Keep, Wake};
use armor_wire::remote_process::HostAddress;
use armor_wire::shared_memory::MemoryUse;
use rustix::process::Signal;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::Hosts;
use crate::fixture::{Run, run_to_end, send_signal, wait_for};

/// The link that the test removes and adds, to what is one line of the file.
const LINK: &str = r#"    <link from="near.presence" to="far.other1"/>
"#;

/// A tool on the host arm: it has the environment of the component there, and so its rights.
fn tool_on_arm(hosts: &Hosts, far: i32, tool: &[&str]) -> (i32, String, String) {
    let bytes = fs::read(format!("/proc/{far}/environ")).expect("it runs");
    let pairs = bytes.split(|byte| *byte == 0).filter_map(|pair| {
        let (name, value) = str::from_utf8(pair).ok()?.split_once('=')?;
        Some((name.to_owned(), value.to_owned()))
    });
    let environment: BTreeMap<_, _> = pairs.collect();
    let mut command = Command::new(env!("CARGO_BIN_EXE_armor"));
    command.current_dir(hosts.folder.path()).env_clear().envs(environment);
    run_to_end(command.args(tool).args(["--registry", "robot:0"]))
}

/// Asks the provider itself, with the key of arm and past the registry, for its odometry.
fn ask_provider(hosts: &Hosts, run: &Run) -> Result<(), HandshakeError> {
    let near = hosts.lines(run, &["ps"]);
    let near = near.iter().find(|one| one["name"] == "near").expect("near").clone();
    let address = near["endpoint"].as_str().expect("an address").to_owned();
    let link = LinkRequest {
        data: "near.odometry".into(),
        instance: 0,
        schema: String::new(),
        schema_hash: 0,
        keep: Keep::Latest,
        wake: Wake::Sleep,
        paused: false,
        history: 1,
        memory: MemoryUse::Never,
        datagrams: false,
    };
    let hello = Hello::new("far", 1, Purpose::Link { link });
    let hello = frame::to_bytes(FrameKind::Hello, &hello).expect("it is short");
    let keys = HostKeys::read(&hosts.folder.path().join("arm")).expect("its keys");
    let addresses = vec![format!("127.0.0.1:{}", hosts.gate)];
    let gate = GateClient::of_host(&HostAddress { host: "robot".into(), addresses }, keys);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.expect("an event loop").block_on(async {
        let request = GateRequest::Connect { address, acts_for: None };
        let (mut stream, reply) = gate.request(request).await.expect("the gate answers");
        assert!(matches!(reply, GateReply::Connected), "{reply:?}");
        stream.write_all(&hello).await.expect("it is sent");
        stream.flush().await.expect("it is sent");
        let mut reader = FrameReader::new();
        loop {
            if let Some(frame) = reader.next_frame().expect("it is well-formed") {
                return read_answer(&frame).map(drop);
            }
            let len = stream.read(reader.space()).await.expect("an answer");
            assert!(len > 0, "it was closed without an answer");
            reader.filled(len);
        }
    })
}

#[test]
fn a_host_reads_what_the_file_leads_to_its_components_and_nothing_else() {
    let hosts = Hosts::new("hosts-reading", "");
    let _agent = hosts.start_agent("robot");
    let run = hosts.run(&[]);
    let far = hosts.wait_for_far(&run, &[]);
    hosts.wait_for_data(&run, "near.presence");
    let echo = |far: i32, data: &str| tool_on_arm(&hosts, far, &["echo", data, "--once"]);
    // A link of the file, its own data, and what the mission does.
    for data in ["near.presence", "far.odometry", "executive.marking"] {
        let (code, out, err) = echo(far, data);
        assert!(code == 0 && !out.is_empty(), "{data}: {code} {out} {err}");
    }
    let (code, out, err) = tool_on_arm(&hosts, far, &["ps"]);
    assert!(code == 0 && out.contains("near"), "{code} {out} {err}");
    // What no link leads there, by the registry and by the provider.
    let refused = "reading `near.odometry` is not for the host arm: no link of the file leads it to a \
                   component there (far)";
    for _ in 0..3 {
        let (code, out, err) = echo(far, "near.odometry");
        assert!(code == 1 && out.is_empty() && err.contains(refused), "{code} {out} {err}");
    }
    let granted_none = "the registry has not granted it";
    for _ in 0..3 {
        let refusal = match ask_provider(&hosts, &run) {
            Err(HandshakeError::Refused(refusal)) => refusal,
            other => panic!("{other:?}"),
        };
        assert_eq!(refusal.code, RefusalCode::Role);
        assert!(refusal.text.contains(granted_none), "{refusal}");
    }
    for text in [refused, granted_none] {
        run.wait_for_log(text, 1);
        assert_eq!(run.log().matches(text).count(), 1, "{text}\n{}", run.log());
    }
    // Its links are back when the registry was replaced, and knows the links again.
    send_signal(run.daemon("registry").expect("it runs"), Signal::KILL);
    run.wait_for_log("the registry listens", 2);
    send_signal(far, Signal::KILL);
    let far = hosts.wait_for_far(&run, &[far]);
    hosts.wait_for_data(&run, "near.presence");
    // The file changes while the system runs.
    let file = hosts.folder.path().join("robots.xml");
    let text = fs::read_to_string(&file).expect("it is ours");
    assert!(text.contains(LINK), "{text}");
    fs::write(&file, text.replace(LINK, "")).expect("it is ours");
    run.wait_for_log("version 2 of the file is valid", 1);
    // The component has its links until it is started again; another process of the host has none.
    wait_for("the link to be refused to others", || {
        let (code, _, err) = echo(far, "near.presence");
        (code == 1 && err.contains("reading `near.presence` is not for the host arm")).then_some(())
    });
    hosts.wait_for_data(&run, "near.presence");
    fs::write(&file, text).expect("it is ours");
    run.wait_for_log("version 3 of the file is valid", 1);
    wait_for("the link to be granted again", || (echo(far, "near.presence").0 == 0).then_some(()));
}
