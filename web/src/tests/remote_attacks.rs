//! What strangers on the network try.

use armor_wire::acting::KeyRole;

use super::remote_scene::{HOST, RemoteScene, read_tls, wait_for_end};
use super::*;

/// Damaged requests over TLS in each run; [`FULL_COUNT`] with `ARMOR_FULL=1`.
const COUNT: usize = 200;
const FULL_COUNT: usize = 20_000;

#[test]
fn wrong_invitations_are_slowed_and_counted_and_disturb_no_session() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Observer);
    let mut statuses = Vec::new();
    for number in 0..30 {
        let mut guess = scene.browser();
        let (status, response) = guess.log_in(&format!("{number:040x}"));
        statuses.push(status);
        assert!(guess.cookie.is_empty() && !response.contains(&format!("{number:040x}")));
    }
    assert_eq!(statuses[..5], [403; 5]);
    assert!(statuses.iter().filter(|status| **status == 429).count() >= 10, "{statuses:?}");
    let (_, response) = scene.browser().log_in("no secret at all");
    assert!(response.contains("retry-after: ") || response.contains("403"), "{response}");
    assert_eq!(alice.json("POST", "/api/stop", "").0, 200, "a session is not affected");
    let (_, metrics) = alice.send("GET", "/metrics", "");
    let count =
        metrics.lines().find_map(|line| line.strip_prefix("armor_web_wrong_secrets_total "));
    let count: f64 = count.expect("a count").parse().expect("a number");
    assert!((5.0..30.0).contains(&count), "{count}");
}

#[test]
fn another_host_origin_or_site_is_refused_with_the_cookie_too() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Operator);
    let (host, cookie) = (scene.host(), &alice.cookie);
    let port = scene.port();
    let send = |host: &str, headers: &str, path: &str| {
        let head = format!("POST {path} HTTP/1.1\r\nHost: {host}\r\n{cookie}{headers}");
        scene.send(&format!("{head}Content-Length: 0\r\nConnection: close\r\n\r\n")).0
    };
    for other in ["evil.example", "localhost", "gate.armor", "robot.test.evil.example", "10.0.0.9"]
    {
        assert_eq!(send(&format!("{other}:{port}"), "", "/api/stop"), 421, "{other}");
    }
    for headers in [
        "Origin: https://evil.example\r\n".to_owned(),
        format!("Origin: http://{host}\r\n"),
        format!("Origin: https://{HOST}:{}\r\n", port.wrapping_add(1)),
        "Origin: null\r\n".to_owned(),
        "Sec-Fetch-Site: cross-site\r\n".to_owned(),
        "Sec-Fetch-Site: same-site\r\n".to_owned(),
    ] {
        assert_eq!(send(&host, &headers, "/api/stop"), 403, "{headers}");
    }
    assert!(scene.robot.stops.lock().is_empty());
    assert_eq!(send(&host, "", "/api/stop"), 200, "a program with the cookie");
    assert_eq!(send(&format!("127.0.0.1:{port}"), "", "/api/stop"), 200, "another name in the key");
    for path in
        ["/../robot.key", "/%2e%2e/robot.key", "//etc/passwd", "/authority.crt/../robot.key"]
    {
        assert_eq!(alice.send("GET", path, "").0, 404, "{path}");
    }
}

#[test]
fn a_request_without_tls_gets_a_hint_and_no_data() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Operator);
    let plain = |host: &str| {
        let mut stream = scene.connect_plain();
        let cookie = &alice.cookie;
        let request = format!("POST /api/stop HTTP/1.1\r\nHost: {host}\r\n{cookie}\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        let mut response = String::new();
        let _ = stream.read_to_string(&mut response);
        response
    };
    let response = plain(&scene.host());
    let location = format!("Location: https://{}/\r\n", scene.host());
    assert!(response.starts_with("HTTP/1.1 308 ") && response.contains(&location), "{response}");
    let response = plain("evil.example");
    assert!(response.starts_with("HTTP/1.1 400 ") && !response.contains("evil"), "{response}");
    assert!(response.contains(&format!("https://{}/", scene.host())), "{response}");
    assert!(scene.robot.stops.lock().is_empty());
}

#[test]
fn clients_that_say_nothing_keep_no_one_out() {
    let scene = RemoteScene::begin();
    let link = scene.invite("alice", KeyRole::Operator, 1);
    let silent: Vec<_> = (0..100).map(|_| scene.connect_plain()).collect();
    // These finish the handshake, and ask for nothing.
    let mut half: Vec<_> = (0..40).map(|_| scene.connect()).collect();
    for stream in &mut half {
        let _ = stream.flush();
    }
    let mut alice = scene.browser();
    wait_for("the login", || (alice.log_in(&link).0 == 200).then_some(()));
    assert_eq!(alice.json("POST", "/api/stop", "").0, 200);
    // Guests who have got the page and keep their connections.
    let mut guests: Vec<_> = (0..40).map(|_| scene.connect()).collect();
    for stream in &mut guests {
        let request = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", scene.host());
        let _ = stream.write_all(request.as_bytes());
        let _ = stream.read(&mut [0; 64]);
    }
    assert_eq!(alice.json("GET", "/api/system", "").0, 200);
    let mut live = alice.open("/api/stop/live").expect("open");
    live.send(tungstenite::Message::text(r#"{"stop":true,"id":1}"#)).unwrap();
    assert_eq!(read_tls(&mut live)["stopped"], true);
    // Strangers who begin to ask for STOP, and so are on its thread.
    let mut halves: Vec<_> = (0..150).map(|_| scene.connect()).collect();
    for stream in &mut halves {
        let _ = stream.write_all(b"POST /api/stop HTTP/1.1\r\n");
    }
    live.send(tungstenite::Message::text(r#"{"stop":true,"id":2}"#)).unwrap();
    assert_eq!(read_tls(&mut live)["stopped"], true, "a person keeps the connection for STOP");
    drop((silent, half, guests, halves));
}

#[test]
fn a_person_with_many_connections_shuts_no_one_out() {
    let scene = RemoteScene::begin();
    let olga = scene.browser_of("olga", KeyRole::Observer);
    let mut sockets: Vec<_> = (0..30).map(|_| olga.open("/api/live").expect("open")).collect();
    // 24 of one session: the oldest end.
    wait_for_end(&mut sockets[0]);
    let alice = scene.browser_of("alice", KeyRole::Operator);
    assert_eq!(alice.json("GET", "/api/system", "").0, 200);
    alice.open("/api/live").expect("another person's");
}

#[test]
fn stop_works_over_tls_while_every_other_thread_hangs() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Observer);
    let mut ready = alice.open("/api/stop/live").expect("open");
    let hang = scene.server.hang_workers();
    let (status, answer) = alice.json("POST", "/api/stop", "");
    assert_eq!((status, answer["stopped"].as_bool()), (200, Some(true)), "{answer}");
    ready.send(tungstenite::Message::text(r#"{"stop":true,"id":3}"#)).unwrap();
    assert_eq!(read_tls(&mut ready)["stopped"], true);
    assert_eq!(*scene.robot.stops.lock(), [true, true]);
    drop(hang);
    assert_eq!(alice.json("GET", "/api/system", "").0, 200);
}

#[test]
fn damaged_requests_and_damaged_tls_end_no_service() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Operator);
    // A log-out that is damaged where it does not matter is one.
    let bob = scene.browser_of("bob", KeyRole::Operator);
    let is_full = std::env::var_os("ARMOR_FULL").is_some();
    let seed = fastrand::u64(..);
    println!("seed {seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    let host = scene.host();
    for number in 0..if is_full { FULL_COUNT } else { COUNT } {
        let path = ["/api/login", "/api/logout", "/api/session", "/api/stop", "/"][dice.usize(..5)];
        let mut bytes = format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\n{}Content-Length: 12\r\n\r\n{{\"invite\":1}}",
            bob.cookie
        )
        .into_bytes();
        for _ in 0..dice.usize(1..6) {
            let at = dice.usize(..bytes.len());
            bytes[at] = dice.u8(..);
        }
        if number.is_multiple_of(2) {
            let mut stream = scene.connect();
            let _ = stream.write_all(&bytes);
            let _ = stream.sock.shutdown(std::net::Shutdown::Write);
        } else {
            // The record type of a handshake, and garbage.
            bytes[0] = 22;
            let _ = scene.connect_plain().write_all(&bytes);
        }
    }
    wait_for("an answer", || (alice.json("GET", "/api/session", "").0 == 200).then_some(()));
    assert_eq!(alice.json("POST", "/api/stop", "").0, 200, "seed {seed}");
}
