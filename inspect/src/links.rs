//! All links of a running system, each combined from the status reports of both ends.

use std::collections::{HashMap, HashSet};

use armor_sdk::control::{InputStatus, LinkStatus, Status};
use serde::Serialize;

/// One output feeding one input, or a tool.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObservedLink {
    /// The data.
    pub from: String,
    /// The input, `component.input`, or the name of the tool.
    pub to: String,
    /// Name of the type.
    #[serde(rename = "type")]
    pub type_name: String,
    /// The queueing policy for a slow consumer.
    pub keep: String,
    /// What carries its data: `unix`, `tcp` or `shm`; empty if that is not known.
    pub transport: String,
    /// Whether it is up.
    pub connected: bool,
    /// Whether the consumer has asked for a pause.
    pub paused: bool,
    /// Data given to the network.
    pub sent: u64,
    /// Data dropped by the provider or in the consumer's process, because the consumer was slow.
    pub dropped: u64,
    /// Data published between two pulls, which no pull has asked for.
    pub skipped: u64,
    /// Messages of the input's history that were dropped before their time, because all were too
    /// long together.
    pub history_dropped: u64,
    /// Data lost in between, seen as gaps in the sequence.
    pub lost: u64,
    /// Data queued at the provider.
    pub queued: u64,
    /// Data waiting in the consumer's process until the component is free.
    pub waiting: u64,
    /// Data delivered to the component.
    pub received: u64,
    /// Data sent per second, if it is known.
    pub rate_hz: Option<f64>,
    /// Why it is down; empty if it is up.
    pub problem: String,
}

/// Two status reports of one component, from which rates are taken; both are of the same process
/// start.
#[derive(Clone, Copy, Debug)]
pub struct Looks<'a> {
    /// The earlier report.
    pub before: Option<&'a Status>,
    /// The newest report.
    pub now: &'a Status,
}

/// Pairs each report of `now` with the earlier one of the same name.
pub fn pair_reports<'a>(before: &'a [Status], now: &'a [Status]) -> Vec<Looks<'a>> {
    let earlier: HashMap<_, _> = before.iter().map(|status| (&status.name, status)).collect();
    now.iter().map(|now| Looks { before: earlier.get(&now.name).copied(), now }).collect()
}

/// The provider's end of a link.
#[derive(Clone, Copy)]
struct ProviderEnd<'a> {
    type_name: &'a str,
    link: &'a LinkStatus,
    rate_hz: Option<f64>,
}

/// Returns all links, sorted by data and by consumer.
pub fn combine_links(components: &[Looks<'_>]) -> Vec<ObservedLink> {
    let mut ends = HashMap::new();
    for component in components {
        let before = component.before.map(sent_by_link).unwrap_or_default();
        let passed_s = component.before.map(|before| component.now.uptime_s - before.uptime_s);
        for (data, type_name, link) in links_of(component.now) {
            let key = (data, link.to.as_str());
            let rate_hz = rate_between(passed_s, before.get(&key).copied(), link.sent);
            ends.insert(key, ProviderEnd { type_name, link, rate_hz });
        }
    }
    let mut edges = Vec::new();
    for consumer in components.iter().map(|component| component.now) {
        for input in consumer.inputs.iter().filter(|input| !input.data.is_empty()) {
            let end = ends.get(&(input.data.as_str(), consumer.name.as_str()));
            edges.push(component_link(consumer, input, end));
        }
    }
    // Links to tools, which are not components and report no inputs.
    let names: HashSet<_> =
        components.iter().map(|component| component.now.name.as_str()).collect();
    let tools = ends.iter().filter(|((_, to), _)| !names.contains(to));
    edges.extend(tools.map(|((data, to), end)| tool_link(data, to, end)));
    edges.sort_by(|a, b| (&a.from, &a.to).cmp(&(&b.from, &b.to)));
    edges
}

fn tool_link(data: &str, to: &str, end: &ProviderEnd<'_>) -> ObservedLink {
    ObservedLink {
        from: data.into(),
        to: to.into(),
        type_name: end.type_name.into(),
        keep: end.link.keep.to_string(),
        transport: end.link.transport.clone(),
        connected: true,
        paused: end.link.paused,
        sent: end.link.sent,
        dropped: end.link.dropped,
        skipped: 0,
        history_dropped: 0,
        lost: 0,
        queued: end.link.queued,
        waiting: 0,
        received: 0,
        rate_hz: end.rate_hz,
        problem: String::new(),
    }
}

fn component_link(
    consumer: &Status,
    input: &InputStatus,
    end: Option<&ProviderEnd<'_>>,
) -> ObservedLink {
    let link = end.map(|end| end.link);
    ObservedLink {
        from: input.data.clone(),
        to: format!("{}.{}", consumer.name, input.id),
        type_name: end.map(|end| end.type_name).unwrap_or_default().into(),
        keep: link.map(|link| link.keep.to_string()).unwrap_or_default(),
        transport: link.map(|link| link.transport.clone()).unwrap_or_default(),
        connected: input.connected,
        paused: link.is_some_and(|link| link.paused),
        sent: link.map_or(0, |link| link.sent),
        dropped: link.map_or(0, |link| link.dropped) + input.dropped,
        skipped: input.skipped,
        history_dropped: input.history_dropped,
        lost: input.lost,
        queued: link.map_or(0, |link| link.queued),
        waiting: input.waiting,
        received: input.received,
        rate_hz: end.and_then(|end| end.rate_hz),
        problem: input.problem.clone(),
    }
}

fn links_of(status: &Status) -> impl Iterator<Item = (&str, &str, &LinkStatus)> {
    status.outputs.iter().flat_map(|output| {
        output.links.iter().map(|link| (output.data.as_str(), output.type_name.as_str(), link))
    })
}

fn sent_by_link(status: &Status) -> HashMap<(&str, &str), u64> {
    links_of(status).map(|(data, _, link)| ((data, link.to.as_str()), link.sent)).collect()
}

/// Returns data per second between two reports; `None` if the link or its provider is new.
fn rate_between(passed_s: Option<f64>, before: Option<u64>, now: u64) -> Option<f64> {
    let passed_s = passed_s.filter(|passed_s| *passed_s > 0.0)?;
    Some(now.checked_sub(before?)? as f64 / passed_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_sdk::control::{OutputStatus, RunState};
    use armor_wire::keep::Keep;

    fn status(name: &str, uptime_s: f64, sent: u64) -> Status {
        let link = |to: &str| LinkStatus {
            to: to.into(),
            keep: Keep::Latest,
            sent,
            dropped: 3,
            queued: 1,
            paused: false,
            transport: "unix".into(),
        };
        let output = OutputStatus {
            id: "scan".into(),
            data: "laser.scan".into(),
            type_name: "LaserScan".into(),
            published: sent,
            published_bytes: 0,
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
            skipped: 9,
            history_dropped: 0,
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
            skipped_ticks: 0,
            skipped_share: 0.0,
            clock_offset_s: 0.0,
            clock_error_s: None,
            last_error: String::new(),
            untaken_events: 0,
            time_s: 0.0,
            busy: false,
            call: None,
            outputs: if name == "laser" { vec![output] } else { vec![] },
            inputs: if name == "slam" { vec![input] } else { vec![] },
        }
    }

    #[test]
    fn a_link_shows_both_its_ends_and_a_tool_is_a_link_too() {
        let before = [status("laser", 10.0, 100), status("slam", 10.0, 100)];
        let now = [status("laser", 12.0, 140), status("slam", 12.0, 140)];
        let edges = combine_links(&pair_reports(&before, &now));
        let [tool, slam] = &edges[..] else { panic!("{edges:?}") };
        assert_eq!((tool.from.as_str(), tool.to.as_str()), ("laser.scan", "echo-7"));
        assert_eq!((slam.to.as_str(), slam.rate_hz), ("slam.scan", Some(20.0)));
        assert_eq!(
            (slam.sent, slam.dropped, slam.lost, slam.queued, slam.waiting),
            (140, 7, 2, 1, 5)
        );
    }

    #[test]
    fn a_link_of_a_restarted_provider_has_no_rate_yet() {
        let (before, now) = ([status("laser", 10.0, 140)], [status("laser", 1.0, 20)]);
        let edges = combine_links(&pair_reports(&before, &now));
        assert_eq!(edges[0].rate_hz, None);
    }

    #[test]
    fn a_consumer_without_its_provider_is_still_shown() {
        let mut slam = status("slam", 1.0, 0);
        slam.inputs[0].connected = false;
        slam.inputs[0].problem = "no component provides laser.scan".into();
        let edges = combine_links(&pair_reports(&[], &[slam]));
        let [edge] = &edges[..] else { panic!("{edges:?}") };
        assert_eq!(
            (edge.connected, edge.problem.as_str()),
            (false, "no component provides laser.scan")
        );
    }
}
