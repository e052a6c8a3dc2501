//! `armor graph`: every link of a running system, with what it sent, dropped and lost.

use std::fmt::Write;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use armor_wire::control::{InputStatus, LinkStatus, Status};
use serde::Serialize;

use super::{Observed, Sighting, printed, say};
use crate::arguments::{Format, Running};
use crate::exit::Ending;
use crate::print;

/// Time between the two looks that the rates come from.
const RATE_OVER: Duration = Duration::from_secs(1);

/// One output feeding one input, or a tool.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Edge {
    from: String,
    to: String,
    #[serde(rename = "type")]
    type_name: String,
    keep: String,
    connected: bool,
    paused: bool,
    sent: u64,
    /// By the provider or in the consumer's process, because the consumer was slow.
    dropped: u64,
    /// On the way, seen as gaps.
    lost: u64,
    /// At the provider.
    queued: u64,
    /// In the consumer's process, until the component is free.
    waiting: u64,
    /// Handed to the component.
    received: u64,
    rate_hz: Option<f64>,
    problem: String,
}

/// Prints one row per link.
///
/// # Errors
/// If no system is found or its registry does not answer.
pub fn run(running: &Running, format: Format) -> Result<Ending> {
    let observed = Observed::find(running, "graph")?;
    let before = said(observed.statuses()?);
    let statuses = if format == Format::Dot {
        before.clone()
    } else {
        thread::sleep(RATE_OVER);
        said(observed.statuses()?)
    };
    let edges = edges(&before, &statuses);
    printed(match format {
        Format::Json => edges.iter().try_for_each(|edge| say(serde_json::to_string(edge)?)),
        Format::Dot => say(dot(&statuses, &edges)),
        Format::Text => {
            let headings = [
                "FROM", "TO", "TYPE", "KEEP", "RATE", "SENT", "RECEIVED", "DROPPED", "LOST",
                "QUEUED", "WAITING", "STATE",
            ];
            let rows: Vec<_> = edges.iter().map(row).collect();
            say(print::table(&headings, &rows).trim_end())
        }
    })
}

fn said(sightings: Vec<Sighting>) -> Vec<Status> {
    sightings.into_iter().filter_map(|sighting| sighting.status.ok()).collect()
}

fn edges(before: &[Status], now: &[Status]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for consumer in now {
        for input in consumer.inputs.iter().filter(|input| !input.data.is_empty()) {
            let link = link(now, &input.data, &consumer.name);
            let rate_hz = rate(before, now, &input.data, &consumer.name);
            edges.push(edge(consumer, input, link, rate_hz));
        }
    }
    // Links into tools, which are no components and have no inputs.
    for (data, type_name, link) in now.iter().flat_map(links_of) {
        if !now.iter().any(|status| status.name == link.to) {
            let rate_hz = rate(before, now, data, &link.to);
            edges.push(Edge {
                from: data.into(),
                to: link.to.clone(),
                type_name: type_name.into(),
                keep: link.keep.clone(),
                connected: true,
                paused: link.paused,
                sent: link.sent,
                dropped: link.dropped,
                lost: 0,
                queued: link.queued,
                waiting: 0,
                received: 0,
                rate_hz,
                problem: String::new(),
            });
        }
    }
    edges.sort_by(|a, b| (&a.from, &a.to).cmp(&(&b.from, &b.to)));
    edges
}

fn edge(
    consumer: &Status,
    input: &InputStatus,
    link: Option<(&str, &LinkStatus)>,
    rate_hz: Option<f64>,
) -> Edge {
    let (type_name, link) = link.unzip();
    Edge {
        from: input.data.clone(),
        to: format!("{}.{}", consumer.name, input.id),
        type_name: type_name.unwrap_or_default().into(),
        keep: link.map(|link| link.keep.clone()).unwrap_or_default(),
        connected: input.connected,
        paused: link.is_some_and(|link| link.paused),
        sent: link.map_or(0, |link| link.sent),
        dropped: link.map_or(0, |link| link.dropped) + input.dropped,
        lost: input.lost,
        queued: link.map_or(0, |link| link.queued),
        waiting: input.waiting,
        received: input.received,
        rate_hz,
        problem: input.problem.clone(),
    }
}

fn links_of(status: &Status) -> impl Iterator<Item = (&str, &str, &LinkStatus)> {
    status.outputs.iter().flat_map(|output| {
        output.links.iter().map(|link| (output.data.as_str(), output.type_name.as_str(), link))
    })
}

fn link<'a>(statuses: &'a [Status], data: &str, to: &str) -> Option<(&'a str, &'a LinkStatus)> {
    let mut links = statuses.iter().flat_map(links_of);
    links.find(|(from, _, link)| *from == data && link.to == to).map(|(_, name, link)| (name, link))
}

/// How often the link sent between the two looks; nothing if it or its provider is new.
fn rate(before: &[Status], now: &[Status], data: &str, to: &str) -> Option<f64> {
    let uptime_s = |statuses: &[Status]| {
        let provider = data.split('.').next()?;
        Some(statuses.iter().find(|status| status.name == provider)?.uptime_s)
    };
    let passed_s = uptime_s(now)? - uptime_s(before)?;
    let (first, last) = (link(before, data, to)?.1.sent, link(now, data, to)?.1.sent);
    (passed_s > 0.0).then_some(last.checked_sub(first)? as f64 / passed_s)
}

fn row(edge: &Edge) -> Vec<String> {
    let state = match edge {
        Edge { problem, .. } if !problem.is_empty() => problem.clone(),
        Edge { connected: false, .. } => "not connected".into(),
        Edge { paused: true, .. } => "paused".into(),
        _ => "up".into(),
    };
    vec![
        edge.from.clone(),
        edge.to.clone(),
        edge.type_name.clone(),
        edge.keep.clone(),
        edge.rate_hz.map_or("-".into(), |hz| format!("{hz:.1} Hz")),
        edge.sent.to_string(),
        edge.received.to_string(),
        edge.dropped.to_string(),
        edge.lost.to_string(),
        edge.queued.to_string(),
        edge.waiting.to_string(),
        state,
    ]
}

fn dot(statuses: &[Status], edges: &[Edge]) -> String {
    let mut out = String::from("digraph system {\n  rankdir=LR;\n  node [shape=box];\n");
    for Status { name, kind, .. } in statuses {
        let _ = writeln!(out, "  {name:?} [label=\"{name}\\n{kind}\"];");
    }
    for Edge { from, to, keep, connected, .. } in edges {
        let component = |port: &str| port.split('.').next().unwrap_or_default().to_owned();
        let style = if *connected { "solid" } else { "dashed" };
        let (tail, head) = (component(from), component(to));
        let _ = writeln!(
            out,
            "  {tail:?} -> {head:?} [label=\"{from} -> {to}\\n{keep}\", style={style}];"
        );
    }
    out.push('}');
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_wire::control::{OutputStatus, RunState};

    fn status(name: &str, uptime_s: f64, sent: u64) -> Status {
        let link = |to: &str| LinkStatus {
            to: to.into(),
            keep: "latest".into(),
            sent,
            dropped: 3,
            queued: 1,
            paused: false,
        };
        let output = OutputStatus {
            id: "scan".into(),
            data: "laser.scan".into(),
            type_name: "LaserScan".into(),
            published: sent,
            links: vec![link("slam"), link("echo-7")],
        };
        let input = InputStatus {
            id: "scan".into(),
            data: "laser.scan".into(),
            connected: true,
            received: sent,
            waiting: 5,
            lost: 2,
            dropped: 4,
            connections: 1,
            problem: String::new(),
        };
        Status {
            name: name.into(),
            kind: "simulator".into(),
            state: RunState::Active,
            activation: 0,
            controllable: true,
            uptime_s,
            exec_calls: 0,
            clock_offset_s: 0.0,
            clock_error_s: None,
            last_error: String::new(),
            outputs: if name == "laser" { vec![output] } else { vec![] },
            inputs: if name == "slam" { vec![input] } else { vec![] },
        }
    }

    #[test]
    fn a_link_shows_both_its_ends_and_a_tool_is_a_link_too() {
        let before = [status("laser", 10.0, 100), status("slam", 10.0, 100)];
        let now = [status("laser", 12.0, 140), status("slam", 12.0, 140)];
        let edges = edges(&before, &now);
        let [tool, slam] = &edges[..] else { panic!("{edges:?}") };
        assert_eq!((tool.from.as_str(), tool.to.as_str()), ("laser.scan", "echo-7"));
        assert_eq!((slam.to.as_str(), slam.rate_hz), ("slam.scan", Some(20.0)));
        assert_eq!(
            (slam.sent, slam.dropped, slam.lost, slam.queued, slam.waiting),
            (140, 7, 2, 1, 5)
        );
        assert!(dot(&now, &edges).contains("\"laser\" -> \"slam\""));
    }

    #[test]
    fn a_consumer_without_its_provider_is_still_shown() {
        let mut slam = status("slam", 1.0, 0);
        slam.inputs[0].connected = false;
        slam.inputs[0].problem = "nobody provides laser.scan".into();
        let edges = edges(&[], &[slam]);
        assert_eq!(row(&edges[0]).last().map(String::as_str), Some("nobody provides laser.scan"));
    }
}
