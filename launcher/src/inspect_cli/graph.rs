//! `armor graph`: every link of a running system, with counts of sent, dropped and lost data.

use std::fmt::Write;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use armor_inspect::{ObservedLink, Sighting, combine_links, pair_reports};
use armor_wire::control::Status;
use clap::Args;

use super::ps::describe_dropped_reports;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{Table, end_printing, flatten_text, print_line, terminal_width};
use crate::verb::Verb;

/// Time between the two statuses from which rates are computed.
const RATE_OVER: Duration = Duration::from_secs(1);
/// Columns that a narrow terminal does without, the least important first.
const DISPENSABLE: [&str; 5] = ["WAITING", "QUEUED", "KEEP", "TYPE", "RECEIVED"];

/// Show the links of a running system, with counts of sent, dropped and lost data; `--format dot`
/// for Graphviz.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor graph                                        a terminal shows what fits its width
  armor graph | cat                                  all columns
  armor graph --format dot | dot -Tsvg > graph.svg   a drawing")]
pub struct GraphArguments {
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for GraphArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_links(&self.running, format)?.into())
    }
}

/// Prints one row per link.
///
/// # Errors
/// If no system is found or its registry does not answer.
fn print_links(running: &RunningSystem, format: OutputFormat) -> Result<CommandEnding> {
    let observed = super::select_system(running, "graph")?;
    let before = keep_statuses(observed.ask_statuses()?);
    let statuses = if format == OutputFormat::Dot {
        before.clone()
    } else {
        thread::sleep(RATE_OVER);
        keep_statuses(observed.ask_statuses()?)
    };
    let edges = combine_links(&pair_reports(&before, &statuses));
    end_printing(match format {
        OutputFormat::Json => {
            edges.iter().try_for_each(|edge| print_line(serde_json::to_string(edge)?))
        }
        OutputFormat::Dot => print_line(format_dot(&statuses, &edges)),
        OutputFormat::Text => {
            let headings = [
                "FROM", "TO", "TYPE", "KEEP", "RATE", "SENT", "RECEIVED", "DROPPED", "LOST",
                "QUEUED", "WAITING", "STATE",
            ];
            let rows: Vec<_> = edges.iter().map(format_row).collect();
            let table = Table::new(&headings, rows).dispensable(&DISPENSABLE);
            let text = table.format(terminal_width()) + &list_dropped_reports(&statuses);
            print_line(text.trim_end())
        }
    })
}

fn keep_statuses(sightings: Vec<Sighting>) -> Vec<Status> {
    sightings.into_iter().filter_map(|sighting| sighting.status.ok()).collect()
}

/// Returns a line for each component whose reports were dropped.
fn list_dropped_reports(statuses: &[Status]) -> String {
    let dropped = statuses.iter().filter_map(|status| {
        let line = format!("{}: {}", status.name, describe_dropped_reports(status)?);
        Some(flatten_text(&line) + "\n")
    });
    dropped.collect()
}

fn format_row(edge: &ObservedLink) -> Vec<String> {
    let state = match edge {
        ObservedLink { problem, .. } if !problem.is_empty() => problem.clone(),
        ObservedLink { connected: false, .. } => "not connected".into(),
        ObservedLink { paused: true, .. } => "paused".into(),
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

fn format_dot(statuses: &[Status], edges: &[ObservedLink]) -> String {
    let mut out = String::from("digraph system {\n  rankdir=LR;\n  node [shape=box];\n");
    for status in statuses {
        let Status { name, kind, .. } = status;
        let dropped = describe_dropped_reports(status).map(|text| format!("\\n{text}"));
        let dropped = dropped.unwrap_or_default();
        let _ = writeln!(out, "  {name:?} [label=\"{name}\\n{kind}{dropped}\"];");
    }
    for ObservedLink { from, to, keep, connected, .. } in edges {
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
    use armor_wire::control::RunState;

    fn status(name: &str) -> Status {
        Status {
            name: name.into(),
            kind: "simulator".into(),
            state: RunState::Active,
            activation: 0,
            controllable: true,
            uptime_s: 1.0,
            exec_calls: 0,
            skipped_ticks: 0,
            skipped_share: 0.0,
            clock_offset_s: 0.0,
            clock_error_s: None,
            last_error: String::new(),
            dropped_reports: 0,
            call: None,
            outputs: Vec::new(),
            inputs: Vec::new(),
        }
    }

    fn format_edge(problem: &str) -> ObservedLink {
        ObservedLink {
            from: "laser.scan".into(),
            to: "slam.scan".into(),
            type_name: "LaserScan".into(),
            keep: "latest".into(),
            connected: problem.is_empty(),
            paused: false,
            sent: 140,
            dropped: 7,
            lost: 2,
            queued: 1,
            waiting: 5,
            received: 131,
            rate_hz: Some(20.0),
            problem: problem.into(),
        }
    }

    #[test]
    fn a_link_is_a_row_and_an_arrow() {
        let cells = format_row(&format_edge(""));
        let expected = ["laser.scan", "slam.scan", "LaserScan", "latest", "20.0 Hz", "140", "131"];
        assert_eq!(cells[..7], expected);
        assert_eq!(cells[7..], ["7", "2", "1", "5", "up"]);
        let drawn = format_dot(&[status("laser"), status("slam")], &[format_edge("")]);
        assert!(drawn.contains("\"laser\" -> \"slam\""), "{drawn}");
    }

    #[test]
    fn reports_that_no_executive_takes_are_part_of_the_drawing() {
        let heater = Status { dropped_reports: 12, ..status("heater") };
        let drawn = format_dot(&[heater], &[]);
        assert!(drawn.contains("simulator\\n12 reports dropped: no executive"), "{drawn}");
    }

    #[test]
    fn a_line_below_the_table_stays_one_line() {
        let heater = Status { dropped_reports: 1, ..status("hea\nter") };
        let text = list_dropped_reports(&[heater, status("laser")]);
        assert_eq!(text, "hea ter: 1 report dropped: no executive takes them\n");
    }

    #[test]
    fn a_link_that_is_down_shows_the_reason() {
        let cells = format_row(&format_edge("no component provides laser.scan"));
        assert_eq!(cells.last().map(String::as_str), Some("no component provides laser.scan"));
    }
}
