//! The path of messages through several processes, as `armor trace` reports it.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};

use serde_json::Value;

use crate::fixture::{Dialogue, Folder, run_to_end};
use crate::resilience::system::{Draft, System};

/// `north` publishes in its ticks; `south` stores what it receives and publishes in its own;
/// `east` works on each message.
fn system(name: &str) -> System {
    let draft = Draft::default()
        .probe("north", "rate='20Hz'", "")
        .probe("south", "rate='50Hz'", "")
        .probe("east", "", "")
        .link("north", "south.a", "latest")
        .link("south", "east.a", "latest");
    let system = draft.run(Folder::new(name));
    for name in ["north", "south", "east"] {
        system.status(name);
    }
    system
}

#[test]
fn a_trace_leads_from_the_first_message_to_the_last_call() {
    let system = system("traced");
    let steps = loop {
        let steps = system.read_json(&["trace", "north.numbers", "--for", "3s"]);
        if steps.iter().any(|step| step["component"] == "east") {
            break steps;
        }
    };
    let last = steps.iter().find(|step| step["component"] == "east").expect("it is there");
    assert_eq!(
        (&last["cause"]["data"], &last["function"]),
        (&"south.numbers".into(), &"data_received".into())
    );
    let of_trace: Vec<_> =
        steps.iter().filter(|step| step["trace_id"] == last["trace_id"]).collect();
    let first = of_trace[0];
    assert_eq!((&first["component"], &first["cause"]["kind"]), (&"north".into(), &"origin".into()));
    let by_span = |id: &Value| of_trace.iter().find(|step| step["span_id"] == *id).expect("a step");
    let tick = by_span(&last["cause"]["publisher_span_id"]);
    assert_eq!((&tick["component"], &tick["cause"]["kind"]), (&"south".into(), &"held".into()));
    let received = by_span(&tick["cause"]["receiver_span_id"]);
    assert_eq!(received["cause"]["data"], "north.numbers");
    assert_eq!(received["cause"]["publisher_span_id"], first["span_id"]);
    let time = |step: &Value, name: &str| step[name].as_f64().expect("seconds");
    for step in [received, last] {
        let times = [
            time(&step["cause"], "published_s"),
            time(&step["cause"], "arrived_s"),
            time(step, "began_s"),
            time(step, "ended_s"),
        ];
        assert!(times.is_sorted(), "{step}");
    }
    assert!(time(first, "began_s") <= time(&received["cause"], "published_s"), "{first}");
    assert!(time(received, "ended_s") <= time(tick, "began_s"), "{tick}");

    // What is observed is not changed: no output appears, and nothing is linked.
    let listed = system.shown(&["data", "list"]);
    assert!(!listed.contains("armor-calls"), "{listed}");
    assert!(!system.shown(&["graph"]).contains("armor-calls"));
    let text = system.shown(&["trace", "north.numbers", "--for", "2s"]);
    assert!(text.starts_with("TRACE ") && text.contains("east.data_received"), "{text}");
    let registry = system.registry.to_string();
    let refused = |arguments: &[&str]| {
        run_to_end(system.folder.armor(arguments).args(["--registry", &registry]))
    };
    let (code, _, err) = refused(&["trace", "north.nubmers"]);
    assert!(code == 1 && err.contains("did you mean north.numbers?"), "{err}");
    let (code, _, err) = refused(&["trace", "--otlp", "https://127.0.0.1"]);
    assert!(code == 2 && err.contains("TLS is not spoken here"), "{err}");
    let closed =
        TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let (code, _, err) = refused(&["trace", "--otlp", &format!("http://{closed}")]);
    assert!(code == 1 && err.contains("no collector of OpenTelemetry takes traces at"), "{err}");
}

/// A collector that takes every request and hands over its body.
fn collect(listener: TcpListener, bodies: &Sender<Value>) {
    for stream in listener.incoming().flatten() {
        let Some(body) = take_request(stream) else { continue };
        if bodies.send(body).is_err() {
            return;
        }
    }
}

fn take_request(mut stream: TcpStream) -> Option<Value> {
    let mut bytes = Vec::new();
    let mut piece = [0; 4096];
    loop {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        if let Some((head, _)) = text.split_once("\r\n\r\n") {
            assert!(head.starts_with("POST /v1/traces HTTP/1.1\r\n"), "{head}");
            assert!(head.contains("Content-Type: application/json"), "{head}");
            let (_, len) = head.split_once("Content-Length: ")?;
            let len: usize = len.lines().next()?.parse().ok()?;
            let begins = head.len() + 4;
            if bytes.len() >= begins + len {
                let body = serde_json::from_slice(&bytes[begins..begins + len]).expect("JSON");
                let answer = "HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}";
                stream.write_all(answer.as_bytes()).ok()?;
                return Some(body);
            }
        }
        let len = stream.read(&mut piece).ok().filter(|len| *len > 0)?;
        bytes.extend_from_slice(&piece[..len]);
    }
}

fn spans_of(request: &Value) -> Vec<(String, Value)> {
    let mut spans = Vec::new();
    for resource in request["resourceSpans"].as_array().expect("a list") {
        let service = &resource["resource"]["attributes"][0];
        assert_eq!(service["key"], "service.name");
        let service = service["value"]["stringValue"].as_str().expect("a name");
        for span in resource["scopeSpans"][0]["spans"].as_array().expect("a list") {
            spans.push((service.to_owned(), span.clone()));
        }
    }
    spans
}

#[test]
fn a_collector_gets_spans_whose_parents_lead_to_the_first_component() {
    let system = system("collected");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let (sender, bodies): (Sender<Value>, Receiver<Value>) = channel();
    std::thread::spawn(move || collect(listener, &sender));
    let registry = system.registry.to_string();
    let otlp = format!("http://{address}");
    let tracing = Dialogue::start(&mut system.folder.armor(&[
        "trace",
        "north.numbers",
        "--registry",
        &registry,
        "--otlp",
        &otlp,
    ]));
    assert_eq!(
        spans_of(&bodies.recv().expect("a first request")).len(),
        0,
        "it tries the collector"
    );
    let mut spans: Vec<(String, Value)> = Vec::new();
    let last = loop {
        let request = bodies.recv_timeout(crate::fixture::DEADLINE).expect("a request");
        spans.extend(spans_of(&request));
        let is_last = |(service, span): &&(String, Value)| {
            service == "east" && span["name"] == "data_received"
        };
        if let Some((_, span)) = spans.iter().find(is_last) {
            break span.clone();
        }
    };
    tracing.kill();
    let mut path = Vec::new();
    let mut at = last.clone();
    loop {
        let name = at["name"].as_str().expect("a name").to_owned();
        let by_id = |id: &Value| spans.iter().find(|(_, span)| span["spanId"] == *id);
        assert_eq!(at["traceId"], last["traceId"]);
        let [start, end] = ["startTimeUnixNano", "endTimeUnixNano"].map(|name| {
            at[name].as_str().and_then(|text| text.parse::<u64>().ok()).expect("a time")
        });
        assert!(start <= end && start > 1_600_000_000_000_000_000, "{at}");
        let (service, _) = by_id(&at["spanId"]).expect("it is one of them");
        path.push(format!("{service}: {name}"));
        let Some((_, parent)) = by_id(&at["parentSpanId"]) else { break };
        let began = parent["startTimeUnixNano"].as_str().and_then(|text| text.parse::<u64>().ok());
        assert!(began.is_some_and(|began| began <= start), "{parent} {at}");
        at = parent.clone();
    }
    assert!(at["parentSpanId"].is_null(), "{at}");
    assert_eq!(
        path,
        [
            "east: data_received",
            "east: south.numbers → east.a",
            "south: exec",
            "south: data_received",
            "south: north.numbers → south.a",
            "north: exec",
        ]
    );
}
