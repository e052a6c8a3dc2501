//! What a pull costs: how much later `exec` is called because the newest message is taken first, within
//! one host and over TCP.

use std::time::Duration;

use anyhow::Result;

use crate::bench::{Bench, FIRST_CORE};
use crate::process::RoleLine;
use crate::reliability::report::FaultReport;

const PATIENCE: Duration = Duration::from_secs(20);
/// Pulled from at 20 Hz: each fiftieth write triggers a call.
const WRITE_PERIOD: &str = "1ms";
const TRIGGERED: usize = 50;
const LEN: usize = 100;

/// What one arrangement of links gives, in µs.
struct PullAges {
    /// From the beginning of a pull to the call of `exec`.
    pull_p50: f64,
    /// The part without handing the message to the component's code.
    taking_p50: f64,
    taking_p99: f64,
    /// From the trigger's sending to its arrival in the component's code.
    trigger_p50: f64,
    /// Age of the pulled value, at most.
    value_p99: f64,
}

/// Measures and reports it.
///
/// # Errors
/// If a process does not print its figures.
pub fn measure(bench: &Bench) -> Result<FaultReport> {
    let by_memory = measure_links(bench, "memory", Some(",keep=pull"), "")?;
    let by_awake = measure_links(bench, "awake", Some(",keep=pull"), ",wake=spin,transport=shm")?;
    let by_tcp = measure_links(bench, "tcp", Some(",keep=pull,transport=tcp"), "")?;
    let round_trip = 2.0 * measure_links(bench, "way", None, ",transport=tcp")?.trigger_p50;
    let mut report = FaultReport::default();
    report.add_value("call delayed by a pull, one host, p50", by_memory.pull_p50, "µs", Some(5.0));
    report.add_value("of it without handing over, p50", by_memory.taking_p50, "µs", None);
    report.add_value("of it without handing over, p99", by_memory.taking_p99, "µs", None);
    let awake = "call delayed by a pull, one host, thread awake, p50";
    report.add_value(awake, by_awake.pull_p50, "µs", Some(5.0));
    report.add_value("of it without handing over, p50", by_awake.taking_p50, "µs", None);
    report.add_value("value pulled, one host: age, p99", by_memory.value_p99, "µs", None);
    report.add_value("round trip over TCP (twice the way of the trigger)", round_trip, "µs", None);
    let most = Some((110.0 * round_trip).round() / 100.0);
    report.add_value("call delayed by a pull, TCP, p50", by_tcp.pull_p50, "µs", most);
    report.add_value("value pulled, TCP: age, p99", by_tcp.value_p99, "µs", None);
    Ok(report)
}

fn measure_links(bench: &Bench, name: &str, pull: Option<&str>, trigger: &str) -> Result<PullAges> {
    let (writer, reader) = (format!("pulled-{name}"), format!("puller-{name}"));
    let window = format!("window={}s", bench.window.as_secs_f64());
    let settings = [window.clone(), format!("len={LEN}"), format!("period={WRITE_PERIOD}")];
    let settings = settings.into_iter().chain([format!("triggered={TRIGGERED}")]);
    let settings: Vec<_> = settings.flat_map(|setting| ["--set".into(), setting]).collect();
    let _writer = bench.start_component(FIRST_CORE, "stamped-writer", &writer, &settings)?;
    let mut settings = vec!["--set".into(), window, "--set".into(), "work=0s".into()];
    settings.extend(bench.link_arguments("trigger", &format!("{writer}.trigger"), trigger));
    if let Some(pull) = pull {
        settings.extend(bench.link_arguments("value", &format!("{writer}.value"), pull));
    }
    let reader = bench.start_component(bench.other_core(), "pulling-reader", &reader, &settings)?;
    // The first window has the start of the links in it.
    reader.wait_for_line("ages", PATIENCE + bench.window)?;
    let triggers: RoleLine = reader.wait_for_line("triggers", PATIENCE + bench.window)?;
    let ages = reader.wait_for_line("ages", PATIENCE + bench.window)?;
    let pulls = reader.wait_for_line("pulls", PATIENCE + bench.window)?;
    Ok(PullAges {
        pull_p50: pulls["p50_us"],
        taking_p50: pulls["taking_p50_us"],
        taking_p99: pulls["taking_p99_us"],
        trigger_p50: triggers["p50_us"],
        value_p99: ages["p99_us"],
    })
}
