//! Traces in the JSON encoding of OTLP (OpenTelemetry protocol 1.x, `ExportTraceServiceRequest`). Pure.
//!
//! The crates `opentelemetry`, `opentelemetry_sdk` and `opentelemetry-otlp` make spans of the process
//! that they run in, with the times of that process; here a tool sends the spans of others, of which it
//! knows all ids and times.

use std::collections::BTreeMap;

use armor_inspect::{CallCause, TracePlace, TraceStep};
use serde_json::{Value, json};

/// The kinds of spans, as OTLP numbers them.
const INTERNAL: u8 = 1;
const PRODUCER: u8 = 4;
const CONSUMER: u8 = 5;
/// The status of a span that has failed.
const STATUS_ERROR: u8 = 2;

/// One span, before it is written.
struct Span {
    id: u64,
    parent: Option<u64>,
    name: String,
    kind: u8,
    start_s: f64,
    end_s: f64,
    attributes: Vec<Value>,
    links: Vec<Value>,
    has_failed: bool,
}

/// Writes the request with these steps; and how many spans it has. `system` is the name of the system.
pub fn encode_request(system: &str, steps: &[TraceStep]) -> (Value, usize) {
    let mut processes: BTreeMap<(&str, u64), Vec<Value>> = BTreeMap::new();
    for step in steps {
        let spans = spans_of(step).into_iter().map(|span| json_of(step.place.trace, span));
        processes.entry((&step.component, step.instance)).or_default().extend(spans);
    }
    let count = processes.values().map(Vec::len).sum();
    let resources: Vec<_> = processes
        .into_iter()
        .map(|((component, instance), spans)| {
            json!({
                "resource": {"attributes": [
                    text("service.name", component),
                    text("service.namespace", system),
                    text("service.instance.id", &format!("{instance:016x}")),
                ]},
                "scopeSpans": [{
                    "scope": {"name": "armor", "version": env!("CARGO_PKG_VERSION")},
                    "spans": spans,
                }],
            })
        })
        .collect();
    (json!({ "resourceSpans": resources }), count)
}

/// The spans of a step: the call; and if it was for a message, the hop from its publication to the end
/// of the call, with transport and wait.
fn spans_of(step: &TraceStep) -> Vec<Span> {
    let call = &step.call;
    let mut spans = Vec::new();
    let mut span = Span {
        id: step.place.span,
        parent: None,
        name: call.function.clone(),
        kind: if call.published.is_empty() { INTERNAL } else { PRODUCER },
        start_s: call.began_s,
        end_s: call.ended_s,
        attributes: Vec::new(),
        links: Vec::new(),
        has_failed: call.has_failed,
    };
    if !call.published.is_empty() {
        let published: Vec<_> = call
            .published
            .iter()
            .map(|it| format!("{}.{} #{}", step.component, it.output, it.sequence))
            .collect();
        span.attributes.push(text("armor.published", &published.join(", ")));
    }
    match &step.cause {
        CallCause::Origin { after } => span.links = after.iter().map(link_to).collect(),
        CallCause::Message(message) => {
            let input = &message.input;
            let begin_s = message.begin_s(call.began_s);
            let part = |salt: u64, name: &str, start_s: f64, end_s: f64| Span {
                id: (message.hop_span ^ salt).max(1),
                parent: Some(message.hop_span),
                name: name.into(),
                kind: INTERNAL,
                start_s,
                end_s,
                attributes: Vec::new(),
                links: Vec::new(),
                has_failed: false,
            };
            spans.push(Span {
                id: message.hop_span,
                parent: message.published.map(|(span, _)| span),
                name: format!("{} → {}.{}", input.data, step.component, input.input),
                kind: CONSUMER,
                start_s: begin_s,
                end_s: call.ended_s,
                attributes: vec![
                    text("messaging.system", "armor"),
                    text("messaging.destination.name", &input.data),
                    number("armor.sequence", input.sequence),
                    number("armor.lost", input.lost),
                    json!({"key": "armor.stamp_s", "value": {"doubleValue": input.stamp_s}}),
                ],
                links: Vec::new(),
                has_failed: false,
            });
            if let Some(arrived_s) = message.arrived_s() {
                if message.published.is_some() {
                    spans.push(part(1 << 62, "transport", begin_s, arrived_s));
                }
                spans.push(part(1 << 61, "wait", arrived_s.min(call.began_s), call.began_s));
            }
            span.parent = Some(message.hop_span);
        }
        CallCause::Held { last, data, since_s, others } => {
            span.parent = Some(last.span);
            span.attributes.push(text("armor.after", data));
            let held_s = (call.began_s - since_s).max(0.0);
            span.attributes.push(json!({"key": "armor.held_s", "value": {"doubleValue": held_s}}));
            span.links = others.iter().map(link_to).collect();
        }
    }
    spans.push(span);
    spans
}

fn link_to(place: &TracePlace) -> Value {
    let TracePlace { trace, span } = place;
    json!({"traceId": format!("{trace:032x}"), "spanId": format!("{span:016x}")})
}

fn json_of(trace: u128, span: Span) -> Value {
    let start_ns = nanoseconds(span.start_s);
    let mut json = json!({
        "traceId": format!("{trace:032x}"),
        "spanId": format!("{:016x}", span.id),
        "name": span.name,
        "kind": span.kind,
        "startTimeUnixNano": start_ns.to_string(),
        // Clocks of two hosts may differ by more than a message was on its way.
        "endTimeUnixNano": nanoseconds(span.end_s).max(start_ns).to_string(),
        "attributes": span.attributes,
    });
    if let Some(parent) = span.parent {
        json["parentSpanId"] = format!("{parent:016x}").into();
    }
    if !span.links.is_empty() {
        json["links"] = span.links.into();
    }
    if span.has_failed {
        json["status"] = json!({ "code": STATUS_ERROR });
    }
    json
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).max(0.0) as u64
}

fn text(key: &str, value: &str) -> Value {
    json!({"key": key, "value": {"stringValue": value}})
}

/// Whole numbers of 64 bits are texts in JSON.
fn number(key: &str, value: u64) -> Value {
    json!({"key": key, "value": {"intValue": value.to_string()}})
}

#[cfg(test)]
mod tests {
    use armor_inspect::{CallReport, TraceAssembly};
    use armor_sdk::call_trace::{TracedCall, TracedInput, TracedOutput};

    use super::*;

    fn call(number: u64, function: &str, times_s: [f64; 2], published: Option<f64>) -> TracedCall {
        let published =
            published.map(|at_s| TracedOutput { output: "out".into(), sequence: number, at_s });
        TracedCall {
            number,
            function: function.into(),
            began_s: times_s[0],
            ended_s: times_s[1],
            published: published.into_iter().collect(),
            ..TracedCall::default()
        }
    }

    #[test]
    fn a_hop_has_its_transport_its_wait_and_its_call() {
        let mut assembly = TraceAssembly::default();
        let laser = call(4, "exec", [1000.0, 1000.5], Some(1000.125));
        let input = TracedInput {
            input: "scan".into(),
            data: "laser.out".into(),
            instance: 1,
            sequence: 4,
            stamp_s: 999.5,
            arrived_s: 1000.25,
            lost: 2,
        };
        let mapper = TracedCall {
            input: Some(input),
            has_failed: true,
            ..call(0, "data_received", [1000.75, 1001.0], None)
        };
        let tick = call(1, "exec", [1001.5, 1001.75], Some(1001.625));
        for (component, instance, calls) in
            [("laser", 1, vec![laser]), ("mapper", 2, vec![mapper, tick])]
        {
            let component = component.into();
            assembly.add_report(CallReport { component, instance, calls, missed: 0 });
        }
        let (request, count) = encode_request("rover", &assembly.settle(2000.0));
        assert_eq!(count, 6);
        let resources = request["resourceSpans"].as_array().expect("two processes");
        let names: Vec<_> = resources
            .iter()
            .map(|it| it["resource"]["attributes"][0]["value"]["stringValue"].as_str())
            .collect();
        assert_eq!(names, [Some("laser"), Some("mapper")]);
        let laser = &resources[0]["scopeSpans"][0]["spans"][0];
        assert!(laser["parentSpanId"].is_null() && laser["kind"] == PRODUCER, "{laser}");
        let spans = resources[1]["scopeSpans"][0]["spans"].as_array().expect("spans");
        let find = |name: &str| {
            spans.iter().find(|span| span["name"] == name).unwrap_or_else(|| panic!("no {name}"))
        };
        let times = |span: &Value| {
            ["startTimeUnixNano", "endTimeUnixNano"]
                .map(|name| span[name].as_str().and_then(|text| text.parse::<u64>().ok()))
        };
        let hop = find("laser.out → mapper.scan");
        assert_eq!(hop["parentSpanId"], laser["spanId"]);
        assert_eq!(times(hop), [Some(1_000_125_000_000), Some(1_001_000_000_000)]);
        for (name, expected) in [
            ("transport", [1_000_125_000_000, 1_000_250_000_000]),
            ("wait", [1_000_250_000_000, 1_000_750_000_000]),
            ("data_received", [1_000_750_000_000, 1_001_000_000_000]),
        ] {
            let span = find(name);
            assert_eq!(span["parentSpanId"], hop["spanId"], "{name}");
            assert_eq!(times(span), expected.map(Some), "{name}");
        }
        assert_eq!(find("data_received")["status"]["code"], STATUS_ERROR);
        let tick = find("exec");
        assert_eq!(tick["parentSpanId"], find("data_received")["spanId"]);
        for span in spans {
            assert_eq!(span["traceId"], laser["traceId"], "one trace");
            let [trace, id] = ["traceId", "spanId"].map(|it| span[it].as_str().map(str::len));
            assert_eq!((trace, id), (Some(32), Some(16)));
        }
        let attributes = hop["attributes"].as_array().expect("a list");
        let lost = attributes.iter().find(|it| it["key"] == "armor.lost").expect("it is counted");
        assert_eq!(lost["value"]["intValue"], "2");
    }
}
