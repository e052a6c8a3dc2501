//! `armor ps`: the processes of a running system.

use anyhow::Result;
use serde_json::json;

use super::{printed, say};
use crate::arguments::{Format, Running};
use crate::exit::Ending;
use crate::print;
use armor_inspect::words::{format_duration, format_short_time};
use armor_inspect::{CONFIGD, Sighting};

/// Prints one row per process.
///
/// # Errors
/// If no system is found or its registry does not answer.
pub fn run(running: &Running, format: Format) -> Result<Ending> {
    let sightings = super::find(running, "ps")?.ask_statuses()?;
    printed(if format == Format::Json {
        sightings.iter().try_for_each(|sighting| say(json_of(sighting)))
    } else {
        let rows: Vec<_> = sightings.iter().map(row).collect();
        let headings = ["NAME", "KIND", "STATE", "PID", "UPTIME", "CALLS", "CLOCK", "PROBLEM"];
        say(print::table(&headings, &rows).trim_end())
    })
}

fn row(sighting: &Sighting) -> Vec<String> {
    let entry = &sighting.entry;
    let (state, uptime, calls, clock, problem) = match &sighting.status {
        Ok(status) => (
            status.state.to_string(),
            format_duration(status.uptime_s),
            status.exec_calls.to_string(),
            status.clock_error_s.map_or("-".into(), format_short_time),
            problems(status),
        ),
        Err(_) if entry.kind == CONFIGD => {
            ("up".into(), "-".into(), "-".into(), "-".into(), String::new())
        }
        Err(problem) => ("unknown".into(), "-".into(), "-".into(), "-".into(), problem.clone()),
    };
    let pid = entry.pid.to_string();
    vec![entry.name.clone(), entry.kind.clone(), state, pid, uptime, calls, clock, problem]
}

fn problems(status: &armor_wire::control::Status) -> String {
    let inputs = status.inputs.iter().filter(|input| !input.problem.is_empty());
    let inputs = inputs.map(|input| format!("{}: {}", input.id, input.problem));
    let own = Some(status.last_error.clone()).filter(|error| !error.is_empty());
    own.into_iter().chain(inputs).collect::<Vec<_>>().join("; ")
}

fn json_of(sighting: &Sighting) -> serde_json::Value {
    let Sighting { entry, status } = sighting;
    json!({
        "name": entry.name,
        "kind": entry.kind,
        "pid": entry.pid,
        "host": entry.host,
        "endpoint": entry.endpoint,
        "instance": format!("{:016x}", entry.instance),
        "status": status.as_ref().ok(),
        "problem": status.as_ref().err().filter(|_| entry.kind != CONFIGD),
    })
}
