//! `armor ps`: the processes of a running system.

use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use serde_json::json;

use super::absence::ask_launcher;
use super::mission::file::problem_of_file;
use super::named_part::NamedPart;
use super::unheard_reports::UnheardReports;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{Table, end_printing, flatten_text, print_line, terminal_width};
use crate::verb::Verb;
use armor_inspect::run_control::{AbsentComponent, AbsentState, HostReport};
use armor_inspect::words::{describe_call, format_duration, format_short_time};
use armor_inspect::{CONFIGD, HANGING_CALL_S, Sighting};

/// Where the column of the hosts stands, if there are several.
const HOST_COLUMN: usize = 2;

/// From this share of skipped ticks on, a component is listed as too slow.
const SKIPPED_SHARE: f64 = 0.2;

/// Show the processes of a running system.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor ps
  armor ps mapper                                             one of them
  armor ps --system rover                                     if several systems run
  armor ps --format json | jq -r 'select(.problem) | .name'   those that do not answer")]
pub struct PsArguments {
    /// Only this component.
    name: Option<String>,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for PsArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_processes(&self.running, NamedPart(self.name.as_deref()), format)?.into())
    }
}

/// Prints one row per process of the part.
///
/// # Errors
/// If no system is found, its registry does not answer, or nothing in it has the name.
fn print_processes(
    running: &RunningSystem,
    part: NamedPart<'_>,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let observed = super::select_system(running, "ps")?;
    let mut sightings = observed.ask_statuses()?;
    let of_file = problem_of_file(&observed);
    let unheard = UnheardReports::read(&observed);
    let (mut absent, mut hosts) = ask_launcher(running);
    absent.retain(|it| sightings.iter().all(|sighting| sighting.entry.name != it.component));
    let present = sightings.iter().map(|sighting| sighting.entry.name.as_str());
    part.expect_among(present.chain(absent.iter().map(|it| it.component.as_str())))?;
    let is_spread = has_several_hosts(&sightings) || !hosts.is_empty();
    sightings.retain(|sighting| part.contains(&sighting.entry.name));
    absent.retain(|it| part.contains(&it.component));
    if part.0.is_some() {
        let is_shown = |host: &String| {
            sightings.iter().any(|sighting| sighting.entry.host == *host)
                || absent.iter().any(|it| it.host.as_ref() == Some(host))
        };
        hosts.retain(|report| is_shown(&report.host));
    }
    end_printing(if format == OutputFormat::Json {
        let present = sightings.iter().map(|sighting| {
            let mut line = json_of(sighting, of_file.as_deref());
            line["unheard_reports"] = json!(unheard.count(&sighting.entry.name));
            if let Some(report) = hosts.iter().find(|report| report.host == sighting.entry.host) {
                line["host_link"] = json!(report);
            }
            line
        });
        present.chain(absent.iter().map(json_of_absent)).try_for_each(print_line)
    } else {
        let present = sightings.iter().map(|sighting| {
            let row = format_row(sighting, of_file.as_deref(), &unheard);
            explain_cut(row, &hosts, Some(&sighting.entry.host))
        });
        let without =
            absent.iter().map(|it| explain_cut(format_absent(it), &hosts, it.host.as_ref()));
        let mut rows: Vec<_> = present.chain(without).collect();
        let mut headings =
            vec!["NAME", "KIND", "STATE", "PID", "UPTIME", "CALLS", "CLOCK", "PROBLEM"];
        if is_spread {
            let places = sightings.iter().map(|sighting| sighting.entry.host.clone());
            let unknown = || "-".to_owned();
            let places =
                places.chain(absent.iter().map(|it| it.host.clone().unwrap_or_else(unknown)));
            headings.insert(HOST_COLUMN, "HOST");
            rows.iter_mut().zip(places).for_each(|(row, host)| row.insert(HOST_COLUMN, host));
        }
        let table = Table::new(&headings, rows).dispensable(&["CLOCK", "CALLS", "UPTIME"]);
        let mut text = table.format(terminal_width()).trim_end().to_owned();
        for report in &hosts {
            text += &format!("\nhost {}", flatten_text(&report.describe()));
        }
        print_line(text)
    })
}

/// Replaces the problem of a component, the last cell, if its host is cut off: the others follow from
/// that.
fn explain_cut(mut row: Vec<String>, hosts: &[HostReport], host: Option<&String>) -> Vec<String> {
    if let Some(cut) = host.and_then(|host| describe_cut(hosts, host))
        && let Some(problem) = row.last_mut()
    {
        *problem = cut;
    }
    row
}

/// Why a component on this host cannot be reached, if the host is cut off.
fn describe_cut(hosts: &[HostReport], host: &str) -> Option<String> {
    hosts.iter().find(|report| report.host == host)?.describe_cut()
}

fn has_several_hosts(sightings: &[Sighting]) -> bool {
    let mut hosts = sightings.iter().map(|sighting| &sighting.entry.host);
    let first = hosts.next();
    hosts.any(|host| Some(host) != first)
}

fn format_absent(absent: &AbsentComponent) -> Vec<String> {
    let none = || "-".to_owned();
    let state = absent.state.to_string();
    let name = absent.component.clone();
    vec![name, none(), state, none(), none(), none(), none(), describe_absence(absent)]
}

fn json_of_absent(absent: &AbsentComponent) -> serde_json::Value {
    let AbsentComponent { component, host, state, reason, starts, ends } = absent;
    json!({"name": component, "host": host, "state": state, "problem": reason, "starts": starts, "ends": ends})
}

/// How its last process ended and what follows, and how those before it ended.
fn describe_absence(absent: &AbsentComponent) -> String {
    let AbsentComponent { component, state, reason, starts, ends, .. } = absent;
    let remedy = match state {
        AbsentState::GivenUp => {
            format!("; its log says why; `armor restart {component}` starts it again")
        }
        _ => String::new(),
    };
    if ends.len() < 2 {
        return format!("{reason}{remedy}");
    }
    format!("{reason} ({starts} starts; the last ends: {}){remedy}", ends.join(", "))
}

/// `of_file`: what is wrong with the file, which is a problem of configd.
fn format_row(sighting: &Sighting, of_file: Option<&str>, unheard: &UnheardReports) -> Vec<String> {
    let entry = &sighting.entry;
    let (state, uptime, calls, clock, problem) = match &sighting.status {
        Ok(status) => (
            status.state.to_string(),
            format_duration(status.uptime_s),
            status.exec_calls.to_string(),
            status.clock_error_s.map_or("-".into(), format_short_time),
            list_problems(status, unheard),
        ),
        Err(_) if entry.kind == CONFIGD => {
            let problem = of_file.unwrap_or_default().to_owned();
            ("up".into(), "-".into(), "-".into(), "-".into(), problem)
        }
        Err(problem) => ("unknown".into(), "-".into(), "-".into(), "-".into(), problem.clone()),
    };
    let pid = entry.pid.to_string();
    vec![entry.name.clone(), entry.kind.clone(), state, pid, uptime, calls, clock, problem]
}

fn list_problems(status: &armor_wire::control::Status, unheard: &UnheardReports) -> String {
    let inputs = status.inputs.iter().filter(|input| !input.problem.is_empty());
    let inputs = inputs.map(|input| format!("{}: {}", input.id, input.problem));
    let own = Some(status.last_error.clone()).filter(|error| !error.is_empty());
    let hanging = status.call.as_ref().filter(|call| call.call_s >= HANGING_CALL_S);
    hanging
        .map(describe_call)
        .into_iter()
        .chain(own)
        .chain(describe_skipped_ticks(status))
        .chain(describe_untaken_events(status))
        .chain(unheard.describe(&status.name))
        .chain(inputs)
        .collect::<Vec<_>>()
        .join("; ")
}

/// Returns which share of its ticks a component that is too slow for its rate misses, in words.
fn describe_skipped_ticks(status: &armor_wire::control::Status) -> Option<String> {
    let share = status.skipped_share;
    (share >= SKIPPED_SHARE)
        .then(|| format!("{:.0} % of its ticks skipped: too slow for its rate", share * 100.0))
}

/// Returns how many events of a component no executive has taken, in words, if there are any.
pub(super) fn describe_untaken_events(status: &armor_wire::control::Status) -> Option<String> {
    match status.untaken_events {
        0 => None,
        1 => Some("1 event that no executive has taken".to_owned()),
        count => Some(format!("{count} events that no executive has taken")),
    }
}

fn json_of(sighting: &Sighting, of_file: Option<&str>) -> serde_json::Value {
    let Sighting { entry, status } = sighting;
    json!({
        "name": entry.name,
        "kind": entry.kind,
        "pid": entry.pid,
        "host": entry.host,
        "endpoint": entry.endpoint,
        "instance": format!("{:016x}", entry.instance),
        "status": status.as_ref().ok(),
        "problem": match entry.kind.as_str() {
            CONFIGD => of_file,
            _ => status.as_ref().err().map(String::as_str),
        },
    })
}

#[cfg(test)]
mod tests {
    use armor_inspect::run_control::HostLink;

    use super::*;

    #[test]
    fn a_component_on_a_host_that_is_cut_off_has_that_as_its_problem() {
        let report = |link| HostReport {
            host: "arm".into(),
            link,
            reason: "it has fallen silent".into(),
            for_s: 3.0,
            clock_offset_s: Some(-0.25),
            clock_error_s: Some(0.001),
        };
        let reports = [report(HostLink::CutOff)];
        let why = describe_cut(&reports, "arm");
        assert_eq!(why.as_deref(), Some("arm is cut off for 3.0 s (it has fallen silent)"));
        assert_eq!(describe_cut(&reports, "robot"), None);
        assert_eq!(describe_cut(&[report(HostLink::Connected)], "arm"), None);
    }
}
