//! The page for people on other hosts: `armor web` beyond loopback with `armor keys`, from the first key
//! to the journal of the mission.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::sync::Arc;

use armor_keys::expiry::{DAY_S, now_s};
use armor_keys::{KeyHolder, KeyPurpose, KeysFolder, NewKey};
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};
use serde_json::{Value, json};

use crate::fixture::{DEADLINE, Dialogue, Folder, free_port, run_to_end, wait_for};
use crate::resilience::system::{Draft, System};

/// A name in the key of the robot, which no name server knows.
const HOST: &str = "robot.test";

const MISSION: &str = "
<mission name='watch' goal='over' safe='hold'>
  <place name='up' initial='true' components='north'/>
  <place name='down'/>
  <place name='over'/>
  <place name='hold'/>
  <transition name='descend' from='up' to='down' operator='true'/>
  <transition name='climb' from='down' to='up' operator='true'/>
  <transition name='leave' from='up' to='over' operator='true'/>
</mission>";

/// Runs `armor keys …` on the folder `keys`; returns its exit code, stdout and stderr.
fn run_keys(folder: &Folder, arguments: &[&str]) -> (i32, String, String) {
    let mut command = folder.armor(&["keys"]);
    run_to_end(command.args(arguments).args(["--keys", "keys"]))
}

fn keys_ok(folder: &Folder, arguments: &[&str]) -> String {
    let (code, out, err) = run_keys(folder, arguments);
    assert_eq!(code, 0, "{arguments:?} {out} {err}");
    out
}

/// A system, a server for other hosts, and a client that trusts its authority.
struct Scene {
    system: System,
    port: u16,
    config: Arc<ClientConfig>,
    server: Dialogue,
}

impl Scene {
    fn begin(name: &str) -> Self {
        let folder = Folder::new(name);
        keys_ok(&folder, &["init"]);
        keys_ok(&folder, &["add", "robot", "--role", "host", "--at", HOST, "--at", "127.0.0.1"]);
        keys_ok(&folder, &["certificate", "--out", "authority.crt"]);
        let authority = fs::read(folder.path().join("authority.crt")).expect("the certificate");
        let draft = Draft::default()
            .probe("north", "rate='50Hz'", "")
            .probe("watcher", "", "")
            .link("north", "watcher.a", "latest")
            .mission(MISSION);
        let system = draft.run(folder);
        let (server, port) = serve(&system);
        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from(authority)).expect("an authority");
        let ring = Arc::new(rustls::crypto::ring::default_provider());
        let config = ClientConfig::builder_with_provider(ring)
            .with_safe_default_protocol_versions()
            .expect("TLS 1.3")
            .with_root_certificates(roots)
            .with_no_client_auth();
        Self { system, port, config: Arc::new(config), server }
    }

    /// Sends a request with the cookie of a session; returns the status and the whole response.
    fn send(&self, method: &str, path: &str, cookie: &str, body: &str) -> (u16, String) {
        let name = ServerName::try_from(HOST).expect("a name");
        let client = ClientConnection::new(Arc::clone(&self.config), name).expect("a client");
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the server");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let mut stream = StreamOwned::new(client, stream);
        let (port, len) = (self.port, body.len());
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {HOST}:{port}\r\nCookie: {cookie}\r\n\
             Content-Length: {len}\r\nConnection: close\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).expect("sent");
        let mut response = Vec::new();
        let _ = stream.read_to_end(&mut response);
        let response = String::from_utf8_lossy(&response).into_owned();
        let status = response.split(' ').nth(1).and_then(|status| status.parse().ok());
        (status.unwrap_or(0), response)
    }

    fn json(&self, method: &str, path: &str, cookie: &str, body: &Value) -> (u16, Value) {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let (status, response) = self.send(method, path, cookie, &body);
        let body = response.split_once("\r\n\r\n").map_or("", |(_, body)| body);
        (status, serde_json::from_str(body).unwrap_or(Value::Null))
    }

    /// Invites a person on the command line; returns the secret of the link.
    fn invite(&self, name: &str, role: &str) -> String {
        let at = format!("{HOST}:{}", self.port);
        let arguments = ["invite", name, "--role", role, "--at", &at, "--format", "json"];
        let record: Value =
            serde_json::from_str(&keys_ok(&self.system.folder, &arguments)).expect("JSON");
        let link = record["link"].as_str().expect("a link");
        let secret = link.strip_prefix(&format!("https://{at}/#invite=")).expect("its form");
        secret.to_owned()
    }

    /// Exchanges an invitation; returns the status and the cookie.
    fn log_in(&self, secret: &str) -> (u16, String) {
        let body = json!({"invite": secret}).to_string();
        let (status, response) = self.send("POST", "/api/login", "", &body);
        let set = response.lines().find_map(|line| line.strip_prefix("set-cookie: "));
        let cookie = set.and_then(|set| set.split(';').next()).unwrap_or_default();
        (status, cookie.to_owned())
    }

    fn wait_for_place(&self, cookie: &str, place: &str) {
        wait_for(&format!("{place}\n{}", self.system.run.log()), || {
            let marking = &self.json("GET", "/api/mission", cookie, &Value::Null).1["marking"];
            let marked = marking["places"].as_array()?.iter().any(|it| it["place"] == place);
            marked.then_some(())
        });
    }
}

fn serve(system: &System) -> (Dialogue, u16) {
    let registry = system.registry.to_string();
    let mut command = system.folder.armor(&["web", "--listen", "0.0.0.0:0", "--keys", "keys"]);
    let server = Dialogue::start(command.args(["--format", "json", "--registry", &registry]));
    let line: Value = serde_json::from_str(&server.read_line()).expect("JSON");
    let url = line["urls"][0].as_str().expect("an address");
    assert!(line["fingerprint"].as_str().is_some_and(|it| it.len() == 95), "{line}");
    let port = line["listen"].as_str().and_then(|it| it.rsplit(':').next()?.parse().ok());
    let port: u16 = port.expect("a port");
    assert_eq!(url, format!("https://{HOST}:{port}/"));
    (server, port)
}

#[test]
fn a_person_logs_in_orders_under_their_name_and_is_revoked() {
    let mut scene = Scene::begin("web-remote");
    let link = scene.invite("alice", "operator");
    let (status, alice) = scene.log_in(&link);
    assert!(status == 200 && alice.starts_with("__Host-armor="), "{status} {alice}");
    assert_eq!(scene.log_in(&link).0, 403, "the link has been used");
    scene.wait_for_place(&alice, "up");
    let order = json!({"order": "fire", "transition": "descend", "author": "boss"});
    let (status, answer) = scene.json("POST", "/api/mission/orders", &alice, &order);
    assert_eq!((status, answer["accepted"].as_bool()), (200, Some(true)), "{answer}");
    scene.wait_for_place(&alice, "down");

    let (status, olga) = scene.log_in(&scene.invite("olga", "observer"));
    assert_eq!(status, 200);
    let climb = json!({"order": "fire", "transition": "climb"});
    let (status, answer) = scene.json("POST", "/api/mission/orders", &olga, &climb);
    let what = answer["error"]["what"].as_str().unwrap_or_default();
    assert!(status == 403 && what.contains("needs the role operator"), "{answer}");
    let (status, answer) = scene.json("POST", "/api/stop", &olga, &Value::Null);
    assert_eq!((status, answer["means"].as_str()), (200, Some("paused")), "{answer}");
    let marking = wait_for("the pause", || {
        let marking = scene.system.read_json(&["mission", "show"]).pop()?;
        marking["pause"]["by"].is_string().then_some(marking)
    });
    assert_eq!(marking["pause"]["by"], "olga", "{marking}");
    let journal = fs::read_to_string(scene.system.run.out().join("executive.journal"));
    let journal = journal.expect("the journal");
    assert!(journal.contains("alice") && !journal.contains("boss"), "{journal}");

    let listed = keys_ok(&scene.system.folder, &["list"]);
    assert!(listed.contains("alice") && listed.contains("1 of 1"), "{listed}");
    // The session survives a restart of the server.
    let (server, port) = serve(&scene.system);
    (scene.server, scene.port) = (server, port);
    assert_eq!(scene.json("GET", "/api/system", &alice, &Value::Null).0, 200);
    let out = keys_ok(&scene.system.folder, &["revoke", "alice"]);
    assert!(out.contains("alice: the invitation is revoked"), "{out}");
    let answer = wait_for("the end of the session", || {
        let (status, answer) = scene.json("GET", "/api/system", &alice, &Value::Null);
        (status == 401).then_some(answer)
    });
    assert!(answer["error"]["what"].as_str().is_some_and(|it| it.contains("revoked")), "{answer}");
    assert_eq!(scene.json("GET", "/api/system", &olga, &Value::Null).0, 200, "olga stays");
    let (code, _, err) = run_keys(&scene.system.folder, &["revoke", "alice"]);
    assert!(code == 1 && err.contains("alice"), "{code} {err}");
    drop(scene.server);
}

#[test]
fn stop_gets_through_while_clients_say_nothing_and_others_guess() {
    let scene = Scene::begin("web-remote-crowd");
    let link = scene.invite("olga", "observer");
    let silent: Vec<_> = (0..100)
        .map(|_| TcpStream::connect(("127.0.0.1", scene.port)).expect("a connection"))
        .collect();
    let mut refused = 0;
    for number in 0..40 {
        refused += u32::from(scene.log_in(&format!("{number:040x}")).0 == 429);
    }
    assert!(refused > 10, "{refused} of 40 guesses were slowed down");
    // The one who guesses has the address of this person, who waits for as long.
    let olga = wait_for("the login", || {
        let (status, cookie) = scene.log_in(&link);
        (status == 200).then_some(cookie)
    });
    scene.wait_for_place(&olga, "up");
    let (status, answer) = scene.json("POST", "/api/stop", &olga, &Value::Null);
    assert_eq!((status, answer["stopped"].as_bool()), (200, Some(true)), "{answer}");
    drop(silent);
}

#[test]
fn a_component_serves_its_page_to_other_hosts_too() {
    let folder = Folder::new("web-remote-view");
    keys_ok(&folder, &["init"]);
    keys_ok(&folder, &["add", "robot", "--role", "host", "--at", HOST]);
    let port = free_port();
    folder.write(
        "page.xml",
        &format!(
            "<armor version='1'><system name='page'>\
             <component name='web' kind='web-view' rate='10Hz' controllable='false'>\
             <parameter name='listen' value='0.0.0.0:{port}'/></component></system></armor>"
        ),
    );
    // The folder that the shell names is not the one that the launcher is given.
    let mut command =
        folder.armor(&["run", "page.xml", "--headless", "--out", "out", "--keys", "keys"]);
    let registry = format!("127.0.0.1:{}", free_port());
    command.args(["--registry", &registry]).env("ARMOR_KEYS", folder.path().join("none"));
    let run = Dialogue::start(&mut command);
    let plain = wait_for("the page", || {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        stream.set_read_timeout(Some(DEADLINE)).ok()?;
        write!(stream, "GET / HTTP/1.1\r\nHost: {HOST}:{port}\r\n\r\n").ok()?;
        let mut response = String::new();
        stream.read_to_string(&mut response).ok()?;
        (!response.is_empty()).then_some(response)
    });
    assert!(plain.starts_with("HTTP/1.1 308 "), "only HTTPS is served: {plain}");
    let arguments = ["invite", "bob", "--role", "observer", "--for", "3d"];
    let link = keys_ok(&folder, &arguments);
    assert!(link.starts_with(&format!("https://{HOST}:{port}/#invite=")), "its port: {link}");
    run.kill();
}

#[test]
fn the_folder_of_a_robot_shows_its_own_key_and_links_are_not_followed() {
    let folder = Folder::new("web-remote-robot");
    keys_ok(&folder, &["init"]);
    let added =
        keys_ok(&folder, &["add", "robot", "--role", "host", "--at", HOST, "--at", "127.0.0.1"]);
    assert!(added.contains("robot.key"), "{added}");
    let renewed = keys_ok(&folder, &["renew", "robot"]);
    assert!(renewed.contains("as before, at robot.test, 127.0.0.1"), "{renewed}");
    let renewed = keys_ok(&folder, &["renew", "robot", "--at", HOST]);
    assert!(renewed.contains("no longer at 127.0.0.1"), "{renewed}");

    let robot = folder.path().join("robot");
    fs::create_dir(&robot).expect("a folder");
    fs::set_permissions(&robot, fs::Permissions::from_mode(0o700)).expect("its mode");
    for name in ["robot.key", "revoked"] {
        fs::copy(folder.path().join("keys").join(name), robot.join(name)).expect("copied");
    }
    let keys = |arguments: &[&str]| {
        let mut command = folder.armor(&["keys"]);
        run_to_end(command.args(arguments).args(["--keys", "robot"]))
    };
    let (code, out, err) = keys(&["list"]);
    assert!(code == 0 && out.contains("robot (host), at robot.test, valid until"), "{out}{err}");
    assert!(err.contains("armor keys invite NAME"), "{err}");
    let fingerprint = out.lines().find_map(|line| line.strip_prefix("SHA-256 ")).expect("one");
    let (_, out, _) = keys(&["list", "--format", "json"]);
    let record: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(
        (record["name"].as_str(), record["fingerprint"].as_str()),
        (Some("robot"), Some(fingerprint))
    );
    assert_eq!(keys(&["invite", "bob", "--role", "observer"]).0, 0);
    let (_, out, err) = keys(&["list"]);
    assert!(out.contains(fingerprint) && out.contains("bob") && err.is_empty(), "{out}{err}");

    folder.write("precious", "text");
    symlink("precious", folder.path().join("authority.crt")).expect("a link");
    let (code, _, err) = keys(&["certificate"]);
    assert!(code == 1 && err.contains("symbolic link") && err.contains("--out"), "{code} {err}");
    assert_eq!(fs::read_to_string(folder.path().join("precious")).expect("the file"), "text");
}

#[test]
fn without_keys_no_page_is_served_to_other_hosts() {
    let folder = Folder::new("web-remote-refused");
    let refused = |remedy: &str| {
        let listen = ["web", "--listen", "0.0.0.0:0", "--keys", "keys"];
        let mut command = folder.armor(&listen);
        let (code, out, err) = run_to_end(command.args(["--registry", "127.0.0.1:7411"]));
        assert_eq!((code, out.as_str()), (1, ""), "{err}");
        assert!(err.contains(remedy), "{err}");
    };
    refused("armor keys add NAME --role host");
    keys_ok(&folder, &["init"]);
    refused("there is no key of a host here");
    keys_ok(&folder, &["add", "robot", "--role", "host"]);
    refused("armor keys renew robot --at ADDRESS");
    let (code, _, err) = run_keys(&folder, &["invite", "bob", "--role", "operator"]);
    assert!(code == 1 && err.contains("armor keys renew robot --at"), "{err}");
    keys_ok(&folder, &["renew", "robot", "--at", HOST]);
    let arguments = ["invite", "bob", "--role", "operator", "--at", "other.test:8443"];
    let (code, _, err) = run_keys(&folder, &arguments);
    assert!(code == 1 && err.contains("it names robot.test"), "{err}");
    keys_ok(&folder, &["revoke", "robot"]);
    refused("is revoked");
}

#[test]
fn no_invitation_is_made_while_the_clock_is_obviously_wrong() {
    // A clock that is wrong by days puts the key of this host before or after its time; a key for
    // another time does the same to a clock that is right.
    for (name, made_in_days, reason) in [
        ("web-clock-behind", 10, "and the key of robot is valid from "),
        ("web-clock-ahead", -10, "the key of robot expired at "),
    ] {
        let folder = Folder::new(name);
        let keys = folder.path().join("keys");
        let now_s = now_s() + made_in_days * DAY_S;
        let holder = KeyHolder { name: "robot".into(), purpose: KeyPurpose::Host };
        let sites = vec![HOST.parse().expect("a name")];
        let made = KeysFolder::create(&keys, now_s)
            .and_then(|keys| keys.add_key(NewKey { holder, sites }, 2, now_s));
        made.expect("a key");
        let (code, out, err) = run_keys(&folder, &["invite", "bob", "--role", "observer"]);
        assert_eq!((code, out.as_str()), (1, ""), "{err}");
        assert!(err.contains(reason) && err.contains("set the clock of the robot"), "{err}");
        let (_, list, _) = run_keys(&folder, &["list"]);
        assert!(!list.contains("bob"), "{list}");
    }
}
