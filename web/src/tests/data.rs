//! Data, images, streams and the live WebSocket.

use std::io::Read;

use super::*;
use crate::endpoints::ENDPOINTS;

#[test]
fn a_value_is_shown_with_its_header() {
    let scene = Scene::begin_with_base();
    let (status, response) = wait_for("a value", || {
        Some(scene.get("/api/data/base.count?wait=10")).filter(|it| it.0 == 200)
    });
    let value = body_json(&response);
    assert_eq!(status, 200, "{response}");
    assert_eq!(
        (value["name"].as_str(), value["type"].as_str()),
        (Some("base.count"), Some("Number"))
    );
    assert!(value["value"]["data"].as_f64().is_some() && value["stamp_s"].is_f64(), "{value}");
    let (_, listed) = scene.get("/api/data");
    let listed = body_json(&listed);
    let map = listed["data"].as_array().unwrap().iter().find(|it| it["data"] == "base.map");
    assert!(map.is_some_and(|map| map["image"] == true && map["latched"] == true), "{listed}");
}

#[test]
fn a_map_is_an_image_with_its_place_and_a_number_is_none() {
    let scene = Scene::begin_with_base();
    let (_, response) = wait_for("a map", || {
        Some(scene.get("/api/data/base.map/image?wait=10")).filter(|it| it.0 == 200)
    });
    assert!(response.contains("content-type: image/png"), "{response}");
    assert!(response.contains("\"width\":2") && response.contains("armor-place: {"), "{response}");
    let (status, response) = scene.get("/api/data/base.count/image?wait=10");
    assert_eq!(
        (status, body_json(&response)["error"]["where"].as_str()),
        (415, Some("data `base.count`"))
    );
}

#[test]
fn values_are_streamed_as_events() {
    let scene = Scene::begin_with_base();
    let mut stream = scene.connect();
    let request = "GET /api/data/base.count/stream?max_hz=100 HTTP/1.1\r\nHost: localhost\r\n\r\n";
    stream.write_all(request.as_bytes()).unwrap();
    let (mut text, mut buffer) = (String::new(), [0; 4096]);
    while text.matches("\ndata: {").count() < 3 {
        let len = stream.read(&mut buffer).unwrap();
        assert!(len > 0, "{text}");
        text += &String::from_utf8_lossy(&buffer[..len]);
    }
    assert!(text.contains("content-type: text/event-stream"), "{text}");
}

#[test]
fn several_data_arrive_over_one_web_socket_until_they_are_unsubscribed() {
    let scene = Scene::begin_with_base();
    let mut socket = scene.open("/api/live").unwrap();
    let subscribe = r#"{"subscribe":[{"name":"base.count","max_hz":100},{"name":"system"},
        {"name":"mission"},{"name":"base.map","values":false}]}"#;
    write_json(&mut socket, subscribe);
    let mut seen = std::collections::BTreeSet::new();
    wait_for("all four", || {
        let message = read_json(&mut socket);
        if message["problem"].is_null() {
            seen.insert(message["name"].as_str().unwrap_or_default().to_owned());
            assert_eq!(message["value"].is_null(), message["name"] == "base.map", "{message}");
        }
        (seen.len() == 4).then_some(())
    });
    write_json(&mut socket, r#"{"unsubscribe":["base.count","system","mission"],"ping":7}"#);
    wait_for("the answer", || (read_json(&mut socket)["pong"] == 7).then_some(()));
    for _ in 0..5 {
        assert_eq!(read_json(&mut socket)["name"], "base.map");
    }
    write_json(&mut socket, r#"{"subscribe":[{"name":"x"}]}"#);
    wait_for("a refusal", || read_json(&mut socket)["error"]["what"].as_str().map(drop));
}

#[test]
fn a_client_that_reads_nothing_loses_its_own_values_and_they_are_counted() {
    let scene = Scene::begin_with_base();
    let mut lazy = scene.open("/api/live").unwrap();
    write_json(&mut lazy, r#"{"subscribe":[{"name":"base.long","max_hz":100}]}"#);
    let mut keen = scene.open("/api/live").unwrap();
    write_json(&mut keen, r#"{"subscribe":[{"name":"base.count","max_hz":100}]}"#);
    let dropped = || {
        let (_, text) = scene.get("/metrics");
        let line = text.lines().find_map(|it| it.strip_prefix("armor_web_dropped_total "))?;
        line.parse::<f64>().ok().filter(|count| *count > 5.0)
    };
    // The buffers of the kernel take some megabytes first.
    wait_for("a loss", dropped);
    let before = read_json(&mut keen)["value"]["data"].as_f64();
    wait_for("the other client", || {
        (read_json(&mut keen)["value"]["data"].as_f64() > before).then_some(())
    });
    // What the lazy client reads in the end is what fitted into the buffers, and then the newest.
    wait_for("the count", || read_json(&mut lazy)["dropped"].as_u64().filter(|count| *count > 0));
}

#[test]
fn every_route_of_the_description_exists() {
    let scene = Scene::begin();
    for endpoint in ENDPOINTS {
        let path = endpoint.path.replace("{name}", "a.b").replace("{component}", "a");
        let method = endpoint.method;
        let mut stream = scene.connect();
        let request = format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        // The head is enough: a stream does not end.
        let mut head = [0; 12];
        stream.read_exact(&mut head).unwrap();
        let status = String::from_utf8_lossy(&head[9..]).into_owned();
        // Only this data does not exist.
        let is_missing = status == "404" && !path.contains("a.b");
        assert!(!is_missing && status != "405", "{method} {path}: {status}");
    }
    let (status, answer) = scene.send_json("DELETE", "/api/system", "");
    assert_eq!((status, answer["error"]["where"].as_str()), (405, Some("/api/system")));
}

#[test]
fn a_connection_that_has_ended_gives_its_place_back() {
    let scene = Scene::begin();
    let sockets: Vec<_> = (0..20).map(|_| scene.open("/api/live").unwrap()).collect();
    let open = || {
        let (_, text) = scene.get("/metrics");
        text.lines().find_map(|it| it.strip_prefix("armor_web_connections ")?.parse::<f64>().ok())
    };
    assert!(open().unwrap() >= 20.0);
    drop(sockets);
    wait_for("the end of all", || open().filter(|count| *count < 3.0));
}
