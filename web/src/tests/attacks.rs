//! Pages of strangers, damaged requests and clients that hold connections.

use std::sync::atomic::{AtomicU64, Ordering};

use super::*;

/// Damaged requests in each run; [`FULL_COUNT`] with `ARMOR_FULL=1`.
const COUNT: u64 = 3_000;
const FULL_COUNT: u64 = 100_000;

#[test]
fn a_page_of_a_stranger_can_neither_read_nor_command() {
    let scene = Scene::begin();
    let host = scene.address();
    let rebound = "GET /api/system HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n";
    assert_eq!(scene.send(rebound).0, 421);
    for path in ["/api/stop", "/api/mission/orders"] {
        let (status, response) = scene.send(&format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://evil.example\r\n\
             Content-Type: text/plain\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
        ));
        assert_eq!(status, 403, "{response}");
        assert_eq!(body_json(&response)["error"]["where"], "the header Origin");
    }
    let upgrade = format!(
        "GET /api/control HTTP/1.1\r\nHost: {host}\r\nOrigin: http://127.0.0.1:1\r\n\
         Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    );
    assert_eq!(scene.send(&upgrade).0, 403);
    assert!(scene.robot.stops.lock().is_empty());
    let (_, page) = scene.get("/");
    for header in ["content-security-policy: default-src 'self'", "x-frame-options: DENY"] {
        assert!(page.contains(header), "{page}");
    }
    assert!(!page.contains("access-control-allow"), "{page}");
}

#[test]
fn a_request_that_is_too_long_is_refused() {
    let scene = Scene::begin();
    let long = "x".repeat(100_000);
    let (status, _) = scene.get(&format!("/{long}"));
    assert!(status == 431 || status == 414 || status == 0, "{status}");
    let (status, answer) =
        scene.send_json("POST", "/api/mission/orders", &format!("{{\"order\":\"{long}\"}}"));
    assert_eq!((status, answer["error"]["what"].as_str()), (413, Some("the body is too long")));
    let headers = "A: b\r\n".repeat(200);
    let many = format!("GET / HTTP/1.1\r\nHost: localhost\r\n{headers}\r\n");
    let (status, _) = scene.send(&many);
    assert!(status == 431 || status == 400, "{status}");
    assert_eq!(scene.get("/api/system").0, 200);
}

#[test]
fn damaged_requests_cause_no_panic() {
    static PANICS: AtomicU64 = AtomicU64::new(0);
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::thread::current().name().is_some_and(|name| name.starts_with("web")) {
            PANICS.fetch_add(1, Ordering::Relaxed);
        }
        before(panic);
    }));
    let scene = Scene::begin();
    let is_full = std::env::var_os("ARMOR_FULL").is_some();
    let (count, seed) = (if is_full { FULL_COUNT } else { COUNT }, fastrand::u64(..));
    println!("seed {seed}");
    let mut dice = fastrand::Rng::with_seed(seed);
    for _ in 0..count {
        let mut request = damage_request(&mut dice);
        let mut stream = scene.connect();
        stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        // The server may refuse the first part and close before the rest.
        let _ = stream.write_all(&request);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        request.resize(512, 0);
        let _ = stream.read(&mut request);
    }
    assert_eq!(PANICS.load(Ordering::Relaxed), 0, "seed {seed}");
    wait_for("an answer", || (scene.get("/api/system").0 == 200).then_some(()));
}

/// Returns a request of which some bytes were changed, removed or repeated.
fn damage_request(dice: &mut fastrand::Rng) -> Vec<u8> {
    const PATHS: [&str; 12] = [
        "/",
        "/api/system",
        "/api/data/a.b?wait=0",
        "/api/data/a.b/image?wait=0",
        "/api/data/a.b/stream?max_hz=1",
        "/api/live",
        "/api/control?take=true",
        "/api/parameters/a/b",
        "/api/mission/orders",
        "/api/stop/release",
        "/api/stop/live",
        "/metrics",
    ];
    const BODIES: [&str; 4] = [
        r#"{"order":"fire","transition":"x","moves":[{"from":"a","to":"b","tokens":1}]}"#,
        r#"{"control":"0123"}"#,
        r#"{"value":"1 m/s"}"#,
        "",
    ];
    let method = ["GET", "POST", "PUT", "HEAD", "OPTIONS"][dice.usize(..5)];
    let (path, body) = (PATHS[dice.usize(..PATHS.len())], BODIES[dice.usize(..BODIES.len())]);
    let upgrade = match dice.bool() {
        true => {
            "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        }
        false => "",
    };
    let len = body.len();
    let mut bytes = format!(
        "{method} {path} HTTP/1.1\r\nHost: localhost\r\n{upgrade}Content-Length: {len}\r\n\r\n{body}"
    )
    .into_bytes();
    if !upgrade.is_empty() {
        // Frames that a WebSocket would read.
        bytes.extend((0..dice.usize(..40)).map(|_| dice.u8(..)));
    }
    for _ in 0..dice.usize(..6) {
        let at = dice.usize(..bytes.len());
        match dice.u8(..4) {
            0 => bytes[at] = dice.u8(..),
            // One byte is left, so that there is a place for the next damage.
            1 if bytes.len() > 1 => drop(bytes.remove(at)),
            2 => bytes.insert(at, dice.u8(..)),
            _ => bytes.truncate(at + 1),
        }
    }
    bytes
}
