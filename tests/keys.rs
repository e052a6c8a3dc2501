//! People on another host: keys, the gate, roles, and what strangers can do.

mod accept_loops;

use std::fs::{self, DirBuilder, Permissions};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use armor_keys::connect::{GateClient, GateError};
use armor_keys::{Authority, KeyHolder, Validity};
use armor_wire::hello::RefusalCode;
use rustix::process::Signal;
use serde_json::Value;

use crate::fixture::{
    DEADLINE, Dialogue, Folder, Run, free_port, run_to_end, send_signal, wait_for,
};

const WORLD: &str = r#"<svg><rect x="-3" y="-3" width="6" height="6"/>
    <circle id="start" cx="-1" cy="0.5"/><circle class="start" id="other" cx="1" cy="0.5"/></svg>"#;

const SYSTEM: &str = r#"<armor version="1">
  <system name="guarded">
    <component name="robot" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
    </component>
  </system>
  <mission name="guarded" goal="over" safe="hold">
    <place name="up" initial="true" components="robot"/>
    <place name="down" components="robot"/>
    <place name="over"/>
    <place name="hold"/>
    <transition name="descend" from="up" to="down" operator="true"/>
    <transition name="climb" from="down" to="up" operator="true"/>
    <transition name="leave" from="up" to="over" operator="true"/>
  </mission>
</armor>"#;

/// A folder with an authority in `authority`, and the robot's own keys in `robot`.
struct Site {
    folder: Folder,
    gate: SocketAddr,
}

impl Site {
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.write("room.svg", WORLD);
        folder.write("guarded.xml", SYSTEM);
        let gate = ([127, 0, 0, 1], free_port()).into();
        let site = Self { folder, gate };
        site.keys(&["init"]);
        site.add("robot", "host");
        DirBuilder::new().mode(0o700).create(site.path("robot")).expect("a folder");
        site.copy_to_robot(&["robot.key", "revoked"]);
        site
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn keys(&self, arguments: &[&str]) {
        let mut command = self.folder.armor(&["keys"]);
        let (code, out, err) = run_to_end(command.args(arguments).args(["--keys", "authority"]));
        assert_eq!(code, 0, "{arguments:?} {out} {err}");
    }

    fn add(&self, name: &str, role: &str) {
        self.keys(&["add", name, "--role", role]);
    }

    /// Copies files of the authority as `scp` does: the bytes go into the file that is there.
    fn copy_to_robot(&self, files: &[&str]) {
        for file in files {
            let (from, to) = (format!("authority/{file}"), format!("robot/{file}"));
            fs::copy(self.path(&from), self.path(&to)).expect("it is copied");
        }
    }

    /// Starts the system with its gate.
    fn run(&self) -> Run {
        let gate = self.gate.to_string();
        let run = self
            .folder
            .run("out", &["guarded.xml", "--headless", "--gate", &gate, "--keys", "robot"]);
        run.wait_for_log("the start: nowhere -> up", 1);
        run.wait_for_log("the gate of robot listens", 1);
        run
    }

    fn run_command(&self, key: &str, tool: &[&str]) -> std::process::Command {
        let gate = self.gate.to_string();
        let mut command = self.folder.armor(&["connect", &gate, "--key", key, "--"]);
        command.arg(env!("CARGO_BIN_EXE_armor")).args(tool);
        command
    }

    /// Runs a tool as on another host; returns its exit code, stdout and stderr.
    fn remote(&self, key: &str, tool: &[&str]) -> (i32, String, String) {
        run_to_end(&mut self.run_command(key, tool))
    }

    fn remote_ok(&self, key: &str, tool: &[&str]) -> String {
        let (code, out, err) = self.remote(key, tool);
        assert_eq!(code, 0, "{key} {tool:?} {out} {err}");
        out
    }

    /// What `armor mission show` prints on the robot's host.
    fn mission(&self, run: &Run) -> Value {
        let registry = run.registry().to_string();
        let show = ["mission", "show", "--format", "json", "--registry", &registry];
        let (_, out, _) = run_to_end(&mut self.folder.armor(&show));
        serde_json::from_str(&out).unwrap_or_default()
    }
}

fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64()
}

/// What a role may do, in the order of [`ROLES`].
const REQUESTS: &[(&[&str], [bool; 3], &str)] = &[
    (&["ps"], [true, true, true], ""),
    (&["graph"], [true, true, true], ""),
    (&["echo", "robot.odometry", "--once"], [true, true, true], ""),
    (&["param", "get", "robot.world"], [true, true, true], ""),
    (&["mission", "show"], [true, true, true], ""),
    (&["mission", "fire", "descend"], [false, true, true], "operator"),
    (&["mission", "pause"], [true, true, true], ""),
    (&["mission", "resume"], [false, true, true], "operator"),
    (&["mission", "fire", "climb"], [false, true, true], "operator"),
    (&["mission", "pause", "--take"], [false, true, true], "operator"),
    (&["mission", "move", "up", "down"], [false, true, true], "operator"),
    (&["mission", "move", "down", "up"], [false, true, true], "operator"),
    (&["mission", "resume"], [false, true, true], "operator"),
    (&["param", "set", "robot.start", "other"], [false, false, true], "engineer"),
    (&["log", "robot", "debug"], [false, false, true], "engineer"),
];
const ROLES: [&str; 3] = ["observer", "operator", "engineer"];

#[test]
fn each_role_gets_what_it_may_and_a_refusal_names_the_role_that_is_needed() {
    let site = Site::new("key-roles");
    let run = site.run();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.expect("an event loop");
    for role in ROLES {
        site.add(role, role);
    }
    for (at, role) in ROLES.into_iter().enumerate() {
        let key = format!("authority/{role}.key");
        for (tool, allowed, needed) in REQUESTS {
            let (code, out, err) = site.remote(&key, tool);
            assert_eq!(code == 0, allowed[at], "{role} {tool:?}: {out} {err}\n{}", run.log());
            let refusal =
                format!("needs the role {needed}, and the key of {role} has the role {role}");
            assert!(allowed[at] || err.contains(&refusal), "{role} {tool:?}: {err}");
        }
        // What `armor doctor` finds on the robot's host is for other hosts of the system.
        let client = GateClient::new(&site.gate.to_string(), &site.path(&key)).expect("a key");
        let examined = runtime.block_on(client.examine_host());
        assert!(
            matches!(&examined, Err(GateError::Refused(refusal)) if refusal.code == RefusalCode::Role),
            "{role}: {examined:?}"
        );
        if role == "observer" {
            // An observer may bring the robot to rest; an operator resumes.
            assert_eq!(site.mission(&run)["stage"], "paused");
            site.add("helper", "operator");
            site.remote_ok("authority/helper.key", &["mission", "resume"]);
        }
    }
    let system = fs::read_to_string(site.path("guarded.xml")).expect("readable");
    assert!(system.contains("other"), "the engineer has set it: {system}");
    // Logged once each, with the name.
    run.wait_for_log("engineer has set robot.start", 1);
    for refused in [
        "firing a transition needs the role operator, and the key of observer",
        "setting robot.start needs the role engineer, and the key of operator",
    ] {
        run.wait_for_log(refused, 1);
        assert_eq!(run.log().matches(refused).count(), 1, "{}", run.log());
    }
    // The safe place, for anyone.
    site.remote_ok("authority/observer.key", &["mission", "safe"]);
    run.wait_for_log("hold", 1);
}

#[test]
fn the_author_of_an_order_is_the_name_in_the_key_whatever_the_client_claims() {
    let site = Site::new("key-author");
    let run = site.run();
    site.add("alice", "operator");
    let fire = ["mission", "fire", "descend", "--as", "president"];
    site.remote_ok("authority/alice.key", &fire);
    let journal = fs::read_to_string(run.out().join("executive.journal")).expect("a journal");
    assert!(journal.contains("alice") && !journal.contains("president"), "{journal}");
    let (code, _, err) = site.remote("authority/alice.key", &["stop", "--all"]);
    assert!(code == 1 && err.contains("ARMOR_VIA is set"), "{code} {err}");
}

#[test]
fn wrong_keys_get_nothing_and_a_reason() {
    let site = Site::new("key-wrong");
    let run = site.run();
    site.add("alice", "operator");
    site.add("mallory", "operator");
    site.keys(&["revoke", "mallory"]);
    site.copy_to_robot(&["revoked"]);
    run.wait_for_log("1 more keys are revoked", 1);
    let mut other = site.folder.armor(&["keys", "init", "--keys", "others"]);
    assert_eq!(run_to_end(&mut other).0, 0);
    let mut eve =
        site.folder.armor(&["keys", "add", "eve", "--role", "engineer", "--keys", "others"]);
    assert_eq!(run_to_end(&mut eve).0, 0);
    let now_s = now_s() as i64;
    let text = fs::read_to_string(site.path("authority/authority.key")).expect("readable");
    let authority = Authority::from_text(&text).expect("an authority");
    let make = |name: &str, not_before_s, not_after_s| {
        let purpose = "engineer".parse().expect("a role");
        let holder = KeyHolder { name: name.into(), purpose };
        let validity = Validity { not_before_s, not_after_s };
        let key = authority.issue_key(holder, validity).expect("a key").text;
        let path = site.folder.write(&format!("authority/{name}.key"), &key);
        fs::set_permissions(path, Permissions::from_mode(0o600)).expect("it is ours");
    };
    make("late", now_s - 99_999, now_s - 1);
    make("early", now_s + 99_999, now_s + 199_999);
    for (key, why, logged) in [
        ("authority/mallory.key", "the gate refuses the key: it is revoked", "its key is revoked"),
        ("authority/late.key", "it has expired, or is not valid yet", "its key has expired"),
        ("authority/early.key", "it has expired, or is not valid yet", "its key is not valid yet"),
        (
            "others/eve.key",
            "it is not a gate of the authority that has made the key",
            "does not accept this host's key",
        ),
        ("authority/robot.key", "it is the key of a host", ""),
        ("authority/authority.key", "which `armor keys add` makes", ""),
        ("nothing.key", "nothing.key: No such file", ""),
    ] {
        let (code, out, err) = site.remote(key, &["mission", "fire", "descend"]);
        assert!(code == 1 && out.is_empty() && err.contains(why), "{key}: {code} {out} {err}");
        run.wait_for_log(logged, 1);
    }
    // Neither side sends a secret or an order in the open.
    let mut plain = TcpStream::connect(site.gate).expect("it listens");
    plain.write_all(b"GET / HTTP/1.1\r\n\r\n").expect("sent");
    plain.set_read_timeout(Some(DEADLINE)).expect("a deadline");
    let mut answer = Vec::new();
    let _ = plain.read_to_end(&mut answer);
    assert!(answer.len() < 16, "an alert at most: {answer:?}");
    run.wait_for_log("it does not speak TLS 1.3", 1);
    assert_eq!(site.mission(&run)["fired"], 0, "{}", site.mission(&run));
    site.remote_ok("authority/alice.key", &["mission", "fire", "descend"]);
}

#[test]
fn a_revocation_closes_live_links_and_a_renewal_closes_none() {
    let site = Site::new("key-revoked");
    let run = site.run();
    for name in ["alice", "bob"] {
        site.add(name, "observer");
    }
    let echo = ["echo", "robot.odometry"];
    let start = |key| Dialogue::start(&mut site.run_command(key, &echo));
    let (alice, bob) = (start("authority/alice.key"), start("authority/bob.key"));
    alice.read_line();
    bob.read_line();
    let registry = run.registry().to_string();
    let links = || run_to_end(&mut site.folder.armor(&["graph", "--registry", &registry])).1;
    wait_for("both links in the graph", || {
        let links = links();
        (links.contains("of alice") && links.contains("of bob")).then_some(())
    });
    site.keys(&["revoke", "alice"]);
    site.copy_to_robot(&["revoked"]);
    run.wait_for_log(
        "alice (observer) at 127.0.0.1 is disconnected: the key of alice is revoked",
        1,
    );
    wait_for("the end of alice's link", || (!links().contains("of alice")).then_some(()));
    let (code, _, err) = site.remote("authority/alice.key", &["ps"]);
    assert!(code == 1 && err.contains("it is revoked"), "{code} {err}");
    // An empty list does not undo it: a copy that is being written is incomplete.
    site.folder.write("robot/revoked", "");
    site.keys(&["renew", "robot", "--days", "20"]);
    site.copy_to_robot(&["robot.key"]);
    run.wait_for_log("the gate has a new key: robot (host)", 1);
    run.wait_for_log("the key of robot expires in", 1);
    let (code, _, err) = site.remote("authority/alice.key", &["ps"]);
    assert!(code == 1 && err.contains("it is revoked"), "{code} {err}");
    site.remote_ok("authority/bob.key", &["ps"]);
    // A tool has the environment of its user, without what `armor connect` sets for itself.
    let gate = site.gate.to_string();
    let connect = ["connect", &gate, "--key", "authority/bob.key", "--", "env"];
    let (code, variables, err) = run_to_end(&mut site.folder.armor(&connect));
    assert!(code == 0 && variables.contains("ARMOR_VIA="), "{code} {variables} {err}");
    assert!(!variables.contains("GLIBC_TUNABLES"), "{variables}");
    assert!(links().contains("of bob"), "his link has stayed");
    // Data still arrives over the link that began before.
    for _ in 0..100 {
        bob.read_line();
    }
    run.wait_for_log("bob (observer) at 127.0.0.1 has gone", 2);
    assert_eq!(
        run.log().matches("bob (observer) at 127.0.0.1 has gone").count(),
        2,
        "the ps and the env alone"
    );
}

#[test]
fn idle_strangers_and_garbage_keep_no_one_with_a_key_out() {
    let site = Site::new("key-strangers");
    let run = site.run();
    site.add("alice", "observer");
    let mut idle: Vec<TcpStream> = Vec::new();
    for number in 0..200 {
        let mut stranger = TcpStream::connect(site.gate).expect("it listens");
        if number % 2 == 0 {
            // The first bytes of a handshake that is never completed, or what is none.
            let bytes: &[u8] =
                if number % 4 == 0 { b"\x16\x03\x01\x02\x00\x01" } else { b"garbage!" };
            let _ = stranger.write_all(bytes);
        }
        idle.push(stranger);
    }
    let seen = site.remote_ok("authority/alice.key", &["ps"]);
    assert!(seen.contains("simulator"), "{seen}");
    drop(idle);
    run.wait_for_log("a connection from 127.0.0.1 is refused", 1);
    let refusals = run.log().matches("a connection from 127.0.0.1 is refused").count();
    assert!((1..=4).contains(&refusals), "once for each kind: {}", run.log());
}

#[test]
fn a_killed_gate_comes_back_with_its_links_and_the_mission_does_not_notice() {
    let site = Site::new("key-killed");
    let run = site.run();
    site.add("alice", "observer");
    let echo =
        Dialogue::start(&mut site.run_command("authority/alice.key", &["echo", "robot.odometry"]));
    echo.read_line();
    for round in 1..=3 {
        let gate = wait_for("the gate", || run.daemon("gate"));
        send_signal(gate, Signal::KILL);
        run.wait_for_log("the gate of robot listens", round + 1);
        run.wait_for_log("alice (observer) has connected", round + 1);
        let back_s = now_s();
        wait_for("data that was published after that", || {
            let data: Value = serde_json::from_str(&echo.read_line()).expect("JSON");
            (data["stamp_s"].as_f64()? > back_s).then_some(())
        });
    }
    assert_eq!(run.log().matches("executive  INFO the start").count(), 1, "{}", run.log());
}

#[test]
fn nothing_but_processes_of_the_system_is_reached() {
    let site = Site::new("key-targets");
    let run = site.run();
    site.add("alice", "engineer");
    // Another service of the same user on the robot's host.
    let service = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = service.local_addr().expect("its address");
    let gate = site.gate.to_string();
    let key = ["connect", gate.as_str(), "--key", "authority/alice.key", "--format", "json"];
    let connected = Dialogue::start(&mut site.folder.armor(&key));
    let session: Value = serde_json::from_str(&connected.read_line()).expect("JSON");
    assert_eq!((&session["name"], &session["role"]), (&"alice".into(), &"engineer".into()));
    assert_eq!(session["registry"], run.registry().to_string());
    let via = session["via"].as_str().expect("the proxy");
    let ask = |host: &str, port: u16| {
        let mut proxy = TcpStream::connect(via).expect("the proxy");
        proxy.set_read_timeout(Some(DEADLINE)).expect("a deadline");
        let mut request = b"\x05\x01\x00\x05\x01\x00\x03".to_vec();
        request.push(u8::try_from(host.len()).expect("short"));
        request.extend(host.as_bytes());
        request.extend(port.to_be_bytes());
        proxy.write_all(&request).expect("sent");
        let mut answer = [0; 12];
        proxy.read_exact(&mut answer).expect("an answer");
        answer[3]
    };
    const CONNECTED: u8 = 0;
    const FORBIDDEN: u8 = 2;
    const REFUSED: u8 = 5;
    assert_eq!(ask("127.0.0.1", run.registry().port()), CONNECTED);
    assert_eq!(ask("127.0.0.1", address.port()), REFUSED);
    assert_eq!(ask("127.0.0.1", site.gate.port()), REFUSED);
    for elsewhere in ["localhost", "192.0.2.1", "0.0.0.0", "", "x\0y"] {
        assert_eq!(ask(elsewhere, address.port()), FORBIDDEN, "{elsewhere}");
    }
    service.set_nonblocking(true).expect("it is ours");
    let untouched = service.accept().err().map(|error| error.kind());
    assert_eq!(untouched, Some(ErrorKind::WouldBlock), "it was not even connected to");
}

#[test]
fn a_gate_without_keys_that_it_can_trust_does_not_listen() {
    let site = Site::new("key-none");
    let gate = site.gate.to_string();
    let refused = |keys: &str, why: &str| {
        for arguments in [
            &["gate", "--listen", &gate, "--keys", keys][..],
            &["run", "guarded.xml", "--headless", "--gate", &gate, "--keys", keys],
        ] {
            let (code, _, err) = run_to_end(&mut site.folder.armor(arguments));
            assert!(code == 1 && err.contains(why), "{arguments:?}: {code} {err}");
        }
        assert!(TcpStream::connect(site.gate).is_err(), "nothing listens");
    };
    refused(
        "nowhere",
        "nowhere: No such file or directory (os error 2): copy the key of this host",
    );
    site.add("other", "host");
    refused("authority", "several keys of hosts");
    fs::remove_file(site.path("robot/revoked")).expect("it was there");
    refused("robot", "the list of revoked keys is missing; copy it");
    site.copy_to_robot(&["revoked"]);
    site.folder.write("robot/revoked", "mallory\n");
    refused("robot", "line 1: mallory is not a serial number");
    site.copy_to_robot(&["revoked"]);
    let set_mode = |path: &str, mode| {
        fs::set_permissions(site.path(path), Permissions::from_mode(mode)).expect("it is ours");
    };
    set_mode("robot/robot.key", 0o644);
    refused("robot", "chmod 600");
    set_mode("robot/robot.key", 0o600);
    set_mode("robot", 0o755);
    refused("robot", "chmod 700");
    set_mode("robot", 0o700);
    fs::remove_file(site.path("robot/robot.key")).expect("it was there");
    refused("robot", "there is no key of a host here");
}

#[test]
fn tools_wait_for_a_robot_that_is_cut_off_for_long() {
    let site = Site::new("key-cut-off");
    let run = site.folder.run("out", &["guarded.xml", "--headless"]);
    run.wait_for_log("the start: nowhere -> up", 1);
    site.add("alice", "observer");
    let (gate, registry) = (site.gate.to_string(), run.registry().to_string());
    let start_gate = || {
        let listen = ["gate", "--listen", &gate, "--registry", &registry, "--keys", "robot"];
        let gate = Dialogue::start(&mut site.folder.armor(&listen));
        wait_for("the gate", || TcpStream::connect(site.gate).ok());
        gate
    };
    let first = start_gate();
    let key = ["connect", &gate, "--key", "authority/alice.key", "--format", "json"];
    let connected = Dialogue::start(&mut site.folder.armor(&key));
    let session: Value = serde_json::from_str(&connected.read_line()).expect("JSON");
    let tool = |arguments: &[&str]| {
        let mut command = site.folder.armor(arguments);
        command.env("ARMOR_VIA", session["via"].as_str().expect("an address"));
        command.env("ARMOR_REGISTRY", &registry);
        command
    };
    let echo = Dialogue::start(&mut tool(&["echo", "robot.odometry"]));
    echo.read_line();
    first.kill();
    // A tool that asks once gives up after three seconds; one that follows data does not.
    for _ in 0..2 {
        let (code, _, err) = run_to_end(&mut tool(&["ps"]));
        assert!(code == 1 && err.contains("no answer from the registry"), "{code} {err}");
    }
    let _second = start_gate();
    let back_s = now_s();
    wait_for("data that was published after that", || {
        let data: Value = serde_json::from_str(&echo.read_line()).expect("JSON");
        (data["stamp_s"].as_f64()? > back_s).then_some(())
    });
}

/// The page is served on the operator's own computer; the robot decides by the role of the key.
#[test]
fn a_page_served_through_the_gate_has_the_role_of_the_key() {
    let site = Site::new("keys-web");
    site.add("olga", "observer");
    let run = site.run();
    let gate = site.gate.to_string();
    let key = ["--key", "authority/olga.key", "--format", "json"];
    let connect = Dialogue::start(site.folder.armor(&["connect", &gate]).args(key));
    let link: Value = serde_json::from_str(&connect.read_line()).expect("JSON");
    let tool = ["web", "--listen", "127.0.0.1:0", "--as", "another", "--format", "json"];
    let mut command = site.folder.armor(&tool);
    command.env("ARMOR_VIA", link["via"].as_str().expect("a proxy"));
    command.env("ARMOR_REGISTRY", link["registry"].as_str().expect("a registry"));
    let server = Dialogue::start(&mut command);
    let line: Value = serde_json::from_str(&server.read_line()).expect("JSON");
    let address = line["listen"].as_str().expect("an address").to_owned();
    let post = |path: &str, body: &str| {
        let mut stream = TcpStream::connect(&address).expect("the server");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let len = body.len();
        let request = format!(
            "POST {path} HTTP/1.1\r\nHost: {address}\r\nContent-Length: {len}\r\n\
             Connection: close\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).expect("sent");
        let mut response = String::new();
        stream.read_to_string(&mut response).expect("a response");
        response
    };
    let refused = post("/api/mission/orders", r#"{"order":"fire","transition":"descend"}"#);
    assert!(refused.starts_with("HTTP/1.1 409"), "{refused}");
    assert!(refused.contains("needs the role operator"), "{refused}");
    let stopped = post("/api/stop", "");
    assert!(stopped.starts_with("HTTP/1.1 200"), "every role may stop the robot: {stopped}");
    assert_eq!(site.mission(&run)["pause"]["by"], "olga");
}
