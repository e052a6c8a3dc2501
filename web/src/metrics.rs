//! Metrics in the text format of Prometheus, version 0.0.4.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use armor_inspect::{Condition, SystemPicture};
use armor_marking::Marking;
use armor_socket::host_name;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;

use crate::failure::text_response;
use crate::histogram::TimeHistogram;
use crate::process_usage::{ProcessUsage, read_usage};
use crate::system_routes::run_asking;
use crate::web_state::WebState;

/// The type by which Prometheus recognises the format.
const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// `GET /metrics`.
pub(crate) async fn show_metrics(State(web): State<Arc<WebState>>) -> Response {
    match run_asking(&web, compose_metrics).await {
        Ok(text) => text_response(StatusCode::OK, CONTENT_TYPE, text),
        Err(failure) => axum::response::IntoResponse::into_response(failure),
    }
}

/// Returns all metrics.
fn compose_metrics(web: &WebState) -> String {
    let picture = web.watch.picture();
    let mut text = MetricsText::default();
    text.family("armor_up", "gauge", "whether the registry of the system can be reached");
    text.add("armor_up", &[], f64::from(u8::from(picture.is_found)));
    write_processes(&mut text, &picture, web.directory.is_remote());
    write_links(&mut text, &picture);
    let latency = "armor_data_latency_seconds";
    text.family(latency, "histogram", "time from publication to arrival here, of followed data");
    for (data, times) in web.hub.latencies() {
        text.add_histogram(latency, &[("data", &data)], &times);
    }
    if let Some(marking) = web.mission.look().marking {
        write_mission(&mut text, &marking);
    }
    write_server(&mut text, web);
    text.0
}

fn write_processes(text: &mut MetricsText, picture: &SystemPicture, is_remote: bool) {
    let host = host_name();
    let shown = picture.processes.iter().filter(|(name, _)| !picture.is_second_name(name));
    let processes: Vec<_> = shown
        .map(|(name, process)| {
            // A host reached through a proxy may have the name of this one.
            let is_here = !is_remote && process.entry.host == host && !process.condition.is_gone();
            (name.as_str(), process, is_here.then(|| read_usage(process.entry.pid)).flatten())
        })
        .collect();
    text.family("armor_process_state", "gauge", "1 for the state in which the process is");
    for (name, process, _) in &processes {
        for condition in Condition::ALL {
            let labels = [("component", *name), ("state", condition.word())];
            text.add(
                "armor_process_state",
                &labels,
                f64::from(u8::from(condition == process.condition)),
            );
        }
    }
    text.family("armor_process_restarts_total", "counter", "starts after the first that was seen");
    for (name, process, _) in &processes {
        let restarts = f64::from(process.starts.saturating_sub(1));
        text.add("armor_process_restarts_total", &[("component", name)], restarts);
    }
    type UsageMetric = (&'static str, &'static str, &'static str, fn(&ProcessUsage) -> f64);
    const USAGE: [UsageMetric; 3] = [
        ("armor_process_cpu_seconds_total", "counter", "processor time", |it| it.cpu_s),
        ("armor_process_memory_bytes", "gauge", "memory in use", |it| it.memory_len as f64),
        ("armor_process_threads", "gauge", "threads", |it| it.threads as f64),
    ];
    for (metric, kind, about, read) in USAGE {
        text.family(metric, kind, about);
        for (name, _, usage) in &processes {
            if let Some(usage) = usage {
                text.add(metric, &[("component", name)], read(usage));
            }
        }
    }
    type StatusMetric =
        (&'static str, &'static str, &'static str, fn(&armor_sdk::control::Status) -> f64);
    const STATUS: [StatusMetric; 4] = [
        ("armor_process_uptime_seconds", "gauge", "time since its start", |it| it.uptime_s),
        ("armor_exec_calls_total", "counter", "calls of exec", |it| it.exec_calls as f64),
        ("armor_skipped_ticks_total", "counter", "ticks that a slow call made it miss", |it| {
            it.skipped_ticks as f64
        }),
        ("armor_untaken_events_total", "counter", "events that no executive took", |it| {
            it.untaken_events as f64
        }),
    ];
    for (metric, kind, about, read) in STATUS {
        text.family(metric, kind, about);
        for (name, process, _) in &processes {
            if let Some(status) = &process.status {
                text.add(metric, &[("component", name)], read(status));
            }
        }
    }
    type OutputMetric = (&'static str, &'static str, fn(&armor_sdk::control::OutputStatus) -> u64);
    const OUTPUT: [OutputMetric; 2] = [
        ("armor_published_total", "messages published on the output", |it| it.published),
        ("armor_published_bytes_total", "bytes of those that had a link, each once", |it| {
            it.published_bytes
        }),
    ];
    for (metric, about, read) in OUTPUT {
        text.family(metric, "counter", about);
        for (_, process, _) in &processes {
            for output in process.status.iter().flat_map(|status| &status.outputs) {
                let labels = [("data", output.data.as_str()), ("type", output.type_name.as_str())];
                text.add(metric, &labels, read(output) as f64);
            }
        }
    }
}

fn write_links(text: &mut MetricsText, picture: &SystemPicture) {
    type LinkMetric =
        (&'static str, &'static str, &'static str, fn(&armor_inspect::ObservedLink) -> f64);
    const LINK: [LinkMetric; 7] = [
        ("armor_link_up", "gauge", "whether the link is connected", |it| {
            f64::from(u8::from(it.connected))
        }),
        ("armor_link_sent_total", "counter", "messages given to the network", |it| it.sent as f64),
        ("armor_link_dropped_total", "counter", "messages dropped for a slow subscriber", |it| {
            it.dropped as f64
        }),
        ("armor_link_lost_total", "counter", "messages lost in transport", |it| it.lost as f64),
        ("armor_link_received_total", "counter", "messages delivered", |it| it.received as f64),
        ("armor_link_waiting", "gauge", "messages in the queues of both ends", |it| {
            (it.queued + it.waiting) as f64
        }),
        ("armor_link_rate_hertz", "gauge", "messages per second", |it| {
            it.rate_hz.unwrap_or_default()
        }),
    ];
    // Several links of one tool to the same data have the same names.
    let mut seen = std::collections::BTreeSet::new();
    let links: Vec<_> =
        picture.links.iter().filter(|link| seen.insert((&link.from, &link.to))).collect();
    for (metric, kind, about, read) in LINK {
        text.family(metric, kind, about);
        for link in &links {
            let labels = [
                ("from", link.from.as_str()),
                ("to", link.to.as_str()),
                ("transport", link.transport.as_str()),
            ];
            text.add(metric, &labels, read(link));
        }
    }
}

fn write_mission(text: &mut MetricsText, marking: &Marking) {
    let mission = ("mission", marking.mission.as_str());
    text.family("armor_mission_tokens", "gauge", "tokens in the marked places");
    for place in &marking.places {
        let labels = [mission, ("place", place.place.as_str())];
        text.add("armor_mission_tokens", &labels, f64::from(place.tokens));
    }
    text.family("armor_mission_stage", "gauge", "1 for the stage of the mission");
    text.add("armor_mission_stage", &[mission, ("stage", marking.stage.as_str())], 1.0);
    type MissionMetric = (&'static str, &'static str, &'static str, fn(&Marking) -> f64);
    const MISSION: [MissionMetric; 5] = [
        ("armor_mission_time_seconds", "gauge", "mission time", |it| it.now_at_s),
        ("armor_mission_fired_total", "counter", "transitions fired", |it| it.fired as f64),
        ("armor_mission_paused", "gauge", "whether an operator has paused it", |it| {
            f64::from(u8::from(it.pause.is_some()))
        }),
        ("armor_mission_questions", "gauge", "questions without an answer", |it| {
            it.confirmations.len() as f64
        }),
        ("armor_mission_late_reports_total", "counter", "reports of ended activations", |it| {
            it.late_reports as f64
        }),
    ];
    for (metric, kind, about, read) in MISSION {
        text.family(metric, kind, about);
        text.add(metric, &[mission], read(marking));
    }
}

fn write_server(text: &mut MetricsText, web: &WebState) {
    let counters = &web.counters;
    let count = |number: &std::sync::atomic::AtomicU64| number.load(Ordering::Relaxed) as f64;
    text.family("armor_web_connections", "gauge", "open connections to this server");
    text.add("armor_web_connections", &[], count(&counters.connections));
    text.family("armor_web_refused_total", "counter", "connections refused");
    text.add("armor_web_refused_total", &[], count(&counters.refused));
    if let Some(remote) = &web.remote {
        let visitors = remote.count_visitors() as f64;
        text.family("armor_web_visitor_connections", "gauge", "connections of persons logged in");
        text.add("armor_web_visitor_connections", &[], visitors);
        text.family("armor_web_logins_total", "counter", "invitations exchanged for a session");
        text.add("armor_web_logins_total", &[], count(&remote.logins));
        text.family("armor_web_wrong_secrets_total", "counter", "wrong invitations looked at");
        text.add("armor_web_wrong_secrets_total", &[], count(&remote.wrong_secrets));
    }
    text.family("armor_web_dropped_total", "counter", "live values that slow clients did not get");
    text.add("armor_web_dropped_total", &[], count(&counters.dropped));
    text.family("armor_web_followed_outputs", "gauge", "outputs that this server is linked to");
    text.add("armor_web_followed_outputs", &[], web.hub.link_count() as f64);
    let responses = counters.responses();
    text.family("armor_web_responses_total", "counter", "responses by the class of their status");
    for (class, number) in responses.by_class.iter().enumerate() {
        let class = format!("{}xx", class + 1);
        text.add("armor_web_responses_total", &[("class", &class)], *number as f64);
    }
    let times = "armor_web_response_seconds";
    text.family(times, "histogram", "time until a response began");
    text.add_histogram(times, &[], &responses.times);
}

/// Metrics being written.
#[derive(Default)]
struct MetricsText(String);

impl MetricsText {
    /// Begins the metrics of one name.
    fn family(&mut self, name: &str, kind: &str, about: &str) {
        let _ = writeln!(self.0, "# HELP {name} {about}\n# TYPE {name} {kind}");
    }

    fn add(&mut self, name: &str, labels: &[(&str, &str)], value: f64) {
        let labels = join_labels(labels);
        let braces = if labels.is_empty() { String::new() } else { format!("{{{labels}}}") };
        let _ = writeln!(self.0, "{name}{braces} {value}");
    }

    fn add_histogram(&mut self, name: &str, labels: &[(&str, &str)], times: &TimeHistogram) {
        times.write_series(&mut self.0, name, &join_labels(labels));
    }
}

fn join_labels(labels: &[(&str, &str)]) -> String {
    let escape =
        |value: &str| value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    let joined = labels.iter().map(|(name, value)| format!("{name}=\"{}\"", escape(value)));
    joined.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_labels_are_escaped() {
        assert_eq!(join_labels(&[("a", "b\"c\\d\ne")]), "a=\"b\\\"c\\\\d\\ne\"");
    }
}
