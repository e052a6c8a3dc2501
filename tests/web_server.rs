//! `armor web` for a running system with its executive: orders, parameters, STOP by a pause, and the
//! command line.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, prlimit};
use serde_json::{Value, json};

use crate::fixture::{Dialogue, Folder, free_port, run_to_end, wait_for};
use crate::resilience::system::{Draft, System};

/// Only a hang takes this long.
const DEADLINE: Duration = Duration::from_secs(60);

const MISSION: &str = "
<mission name='watch' goal='over' safe='hold'>
  <place name='up' initial='true' components='north'/>
  <place name='down'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='descend' from='up' to='down' operator='true'/>
  <transition name='climb' from='down' to='up' autonomy='confirm' answer-within='10min'/>
  <transition name='leave' from='up' to='over' operator='true'/>
</mission>";

/// A system and a server for it.
struct Scene {
    system: System,
    address: String,
    _server: Dialogue,
}

impl Scene {
    fn begin(name: &str) -> Self {
        Self::begin_with(name, MISSION)
    }

    /// As [`Self::begin`], with `mission`, which may be empty.
    fn begin_with(name: &str, mission: &str) -> Self {
        let draft = Draft::default()
            .probe("north", "rate='50Hz'", "")
            .probe("watcher", "", "")
            .link("north", "watcher.a", "latest")
            .mission(mission);
        let system = draft.run(Folder::new(name));
        let registry = system.registry.to_string();
        let mut command = system.folder.armor(&["web", "--listen", "127.0.0.1:0"]);
        command.args(["--as", "ruth", "--format", "json", "--registry", &registry]);
        let server = Dialogue::start(&mut command);
        let line: Value = serde_json::from_str(&server.read_line()).expect("JSON");
        let address = line["listen"].as_str().expect("an address").to_owned();
        Self { system, address, _server: server }
    }

    fn send(&self, method: &str, path: &str, body: &Value) -> (u16, String) {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let mut stream = TcpStream::connect(&self.address).expect("the server");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            self.address,
            body.len()
        );
        stream.write_all(request.as_bytes()).expect("sent");
        let mut response = String::new();
        stream.read_to_string(&mut response).expect("a response");
        let status = response.split(' ').nth(1).and_then(|status| status.parse().ok());
        let (_, body) = response.split_once("\r\n\r\n").expect("a body");
        (status.expect("a status"), body.to_owned())
    }

    fn json(&self, method: &str, path: &str, body: &Value) -> (u16, Value) {
        let (status, body) = self.send(method, path, body);
        (status, serde_json::from_str(&body).unwrap_or(Value::Null))
    }

    fn order(&self, order: &Value) -> (u16, Value) {
        self.json("POST", "/api/mission/orders", order)
    }

    fn wait_for_place(&self, place: &str) {
        wait_for(&format!("{place}\n{}", self.system.run.log()), || {
            let marking = &self.json("GET", "/api/mission", &Value::Null).1["marking"];
            let marked = marking["places"].as_array()?.iter().any(|it| it["place"] == place);
            marked.then_some(())
        });
    }
}

#[test]
fn orders_questions_and_stop_reach_the_executive() {
    let scene = Scene::begin("web-orders");
    scene.wait_for_place("up");
    let (status, answer) = scene.order(&json!({"order": "fire", "transition": "descend"}));
    assert_eq!((status, answer["accepted"].as_bool()), (200, Some(true)), "{answer}");
    scene.wait_for_place("down");
    let (status, answer) = scene.order(&json!({"order": "fire", "transition": "descend"}));
    assert!(status == 409 && answer["error"]["what"].is_string(), "{answer}");
    let confirm = json!({"order": "confirm", "transition": "climb"});
    wait_for("the question", || (scene.order(&confirm).0 == 200).then_some(()));
    scene.wait_for_place("up");

    let (status, answer) = scene.json("POST", "/api/stop", &Value::Null);
    assert_eq!((status, answer["means"].as_str()), (200, Some("paused")), "{answer}");
    let marking = wait_for("the pause", || {
        let marking = scene.system.read_json(&["mission", "show"]).pop()?;
        marking["pause"]["by"].is_string().then_some(marking)
    });
    assert_eq!(marking["pause"]["by"], "ruth", "{marking}");
    let (_, stop) = scene.json("GET", "/api/stop", &Value::Null);
    wait_for("STOP in force", || {
        (scene.json("GET", "/api/stop", &Value::Null).1["ordered"] == true).then_some(())
    });
    assert_eq!(stop["means"], "paused");
    assert_eq!(scene.order(&json!({"order": "resume"})).0, 200);

    let (_, metrics) = scene.send("GET", "/metrics", &Value::Null);
    let tokens = "armor_mission_tokens{mission=\"watch\",place=\"up\"} 1\n";
    assert!(metrics.contains(tokens), "{metrics}");
    let (_, page) = scene.send("GET", "/", &Value::Null);
    assert!(page.contains("STOP"), "{page}");
    assert_eq!(scene.order(&json!({"order": "fire", "transition": "leave"})).0, 200);
}

#[test]
fn stop_in_a_system_without_a_mission_is_refused_with_the_reason() {
    let scene = Scene::begin_with("web-no-mission", "");
    // On a busy host the launcher may answer too late; the wait for an executive then ends in another
    // text.
    wait_for("a refusal that knows the reason", || {
        let (status, answer) = scene.json("POST", "/api/stop", &Value::Null);
        let what = answer["error"]["what"].as_str().unwrap_or_default();
        assert!(what.starts_with("STOP is not delivered"), "{status} {answer}");
        let is_known = what.contains("no mission runs that could be paused");
        // The page sends one without an answer again, and one that was refused not.
        assert_eq!(status, if is_known { 502 } else { 504 }, "{answer}");
        is_known.then_some(())
    });
    let (_, stop) = scene.json("GET", "/api/stop", &Value::Null);
    assert_eq!(stop["ordered"], Value::Null, "{stop}");
}

#[test]
fn stop_waits_for_an_executive_that_is_started_again() {
    let scene = Scene::begin("web-stop-restart");
    scene.wait_for_place("up");
    // The launcher starts the next one only after the server has noticed the death.
    scene.system.run.signal(Signal::STOP);
    scene.system.kill("executive");
    wait_for("the end of the executive", || {
        let (_, system) = scene.json("GET", "/api/system", &Value::Null);
        let executive = system["processes"].as_array()?.iter().find(|it| it["name"] == "executive");
        (["dead", "restarting"].contains(&executive?["state"].as_str()?)).then_some(())
    });
    scene.system.run.signal(Signal::CONT);
    // On a busy host the next executive may take longer than an order waits.
    let answer = wait_for("STOP", || {
        let (status, answer) = scene.json("POST", "/api/stop", &Value::Null);
        let what = answer["error"]["what"].as_str().unwrap_or_default();
        assert!(!what.contains("no mission runs"), "one is started: {answer}");
        (status == 200).then_some(answer)
    });
    assert_eq!(answer["means"], "paused", "{answer}");
}

#[test]
fn a_parameter_is_shown_and_a_wrong_one_is_refused_with_the_reason() {
    let scene = Scene::begin("web-parameters");
    scene.wait_for_place("up");
    let (status, list) = scene.json("GET", "/api/parameters", &Value::Null);
    assert!(status == 200 && list["parameters"].is_array(), "{list}");
    let (status, answer) = scene.json("GET", "/api/parameters/north/no-such", &Value::Null);
    assert!(status == 404 && answer["error"]["remedy"].is_string(), "{status} {answer}");
    let value = json!({"value": "1"});
    let (status, answer) = scene.json("PUT", "/api/parameters/north/no-such", &value);
    assert!(status == 409 && answer["error"]["what"].is_string(), "{status} {answer}");
}

#[test]
fn a_server_that_cannot_accept_connections_logs_that_and_its_recovery() {
    let port = free_port();
    let page = format!(
        "<component name='page' kind='web-view' rate='10Hz'>\
         <parameter name='listen' value='127.0.0.1:{port}'/></component>\n"
    );
    let system = Draft::default().component(&page).run(Folder::new("web-descriptors"));
    let connect = || {
        let stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        Some(stream)
    };
    let ask = |mut stream: TcpStream| {
        let request = "GET /api/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
        stream.write_all(request.as_bytes()).ok()?;
        let mut response = String::new();
        stream.read_to_string(&mut response).ok()?;
        response.starts_with("HTTP/1.1 200 ").then_some(())
    };
    // It answers: a server that has only bound its port needs further descriptors to start.
    wait_for("the page", || ask(connect()?));
    let pid = Pid::from_raw(system.pid("page"));
    let no_more = Rlimit { current: Some(0), ..getrlimit(Resource::Nofile) };
    let before = prlimit(pid, Resource::Nofile, no_more).expect("it is ours");
    let waiting = wait_for("a place in the queue of the port", connect);
    system.run.wait_for_log("no connection can be accepted: ", 1);
    assert!(!system.run.log().contains("connections are accepted again"));
    prlimit(pid, Resource::Nofile, before).expect("it is ours");
    system.run.wait_for_log("connections are accepted again", 1);
    assert_eq!(ask(waiting), Some(()), "the one that has waited");
    // A second time, which is logged 10 s after the first at the earliest.
    prlimit(pid, Resource::Nofile, Rlimit { current: Some(0), ..before }).expect("ours");
    let waiting = wait_for("a place in the queue of the port", connect);
    system.run.wait_for_log("no connection can be accepted: ", 2);
    prlimit(pid, Resource::Nofile, before).expect("it is ours");
    system.run.wait_for_log("connections are accepted again", 2);
    assert_eq!(ask(waiting), Some(()), "the one that has waited");
}

#[test]
fn the_server_of_the_command_line_logs_its_warnings() {
    let system = Draft::default().probe("north", "rate='50Hz'", "").run(Folder::new("web-log"));
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["web", "--listen", "127.0.0.1:0"]);
    command.args(["--format", "json", "--registry", &registry]);
    let log = system.folder.path().join("web.log");
    let server = Dialogue::start_with_log(&mut command, &log);
    let line: Value = serde_json::from_str(&server.read_line()).expect("JSON");
    // A client that has left before it is accepted, and one that is served after it.
    server.signal(Signal::STOP);
    let connect = || TcpStream::connect(line["listen"].as_str().expect("an address"));
    drop(connect().expect("a place in the queue of the port"));
    let mut client = connect().expect("another place");
    server.signal(Signal::CONT);
    client.write_all(b"GET /api/stop HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n").expect("sent");
    client.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    assert!(client.read(&mut [0; 64]).is_ok_and(|len| len > 0), "it is served");
    // Only a registry that was found can be lost.
    wait_for("the outputs of the system", || {
        let mut client = connect().ok()?;
        let request = "GET /api/data HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
        client.write_all(request.as_bytes()).ok()?;
        client.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let mut answer = String::new();
        client.read_to_string(&mut answer).ok()?;
        answer.contains("north.").then_some(())
    });
    system.kill("registry");
    let warning = format!("WARN lost the registry at {registry}: ");
    let logged = wait_for("a warning", || {
        std::fs::read_to_string(&log).ok().filter(|logged| logged.contains(&warning))
    });
    assert!(!logged.contains("is refused"), "no client is refused: {logged}");
    // No launcher adds the date.
    let line = logged.lines().find(|line| line.contains(&warning)).expect("the warning");
    let date = line.split(' ').next().and_then(|date| date.strip_suffix('Z'));
    assert!(date.is_some_and(|date| date.as_bytes()[10] == b'T'), "{line}");
}

#[test]
fn an_address_beyond_loopback_is_refused_on_the_command_line() {
    let folder = Folder::new("web-listen");
    let mut command = folder.armor(&["web", "--listen", "0.0.0.0:8080", "--keys", "no-keys"]);
    command.args(["--registry", "127.0.0.1:7411"]);
    let (code, out, err) = run_to_end(&mut command);
    assert_eq!((code, out.as_str()), (1, ""), "{err}");
    assert!(err.contains("armor connect") && err.contains("127.0.0.1"), "{err}");
}
