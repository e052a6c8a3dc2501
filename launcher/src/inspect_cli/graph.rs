//! `armor graph`: every link of a running system, with counts of sent, dropped and lost data.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use armor_inspect::{ObservedLink, Sighting, combine_links, pair_reports};
use armor_wire::control::Status;
use clap::Args;

use super::absence::list_absent;
use super::named_part::NamedPart;
use super::ps::describe_untaken_events;
use super::unheard_reports::UnheardReports;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{Table, end_printing, flatten_text, print_line, terminal_width};
use crate::verb::Verb;

/// Time between the two statuses from which rates are computed.
const RATE_OVER: Duration = Duration::from_secs(1);
/// Where the column of the hosts stands, if there are several.
const HOSTS_COLUMN: usize = 2;
/// Where the count of links that pull stands, if there are any.
const SKIPPED_COLUMN: usize = 10;
/// Columns that a narrow terminal does without, the least important first.
const DISPENSABLE: [&str; 7] = ["WAITING", "SKIPPED", "QUEUED", "VIA", "KEEP", "TYPE", "RECEIVED"];

/// Show the links of a running system, with counts of sent, dropped and lost data; `--format dot`
/// for Graphviz.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor graph                                        a terminal shows what fits its width
  armor graph | cat                                  all columns
  armor graph mapper                                 the links of one component
  armor graph simulator.scan                         those of one output or input
  armor graph --format dot | dot -Tsvg > graph.svg   a drawing")]
pub struct GraphArguments {
    /// Only the links of this component, output or input.
    name: Option<String>,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for GraphArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_links(&self.running, NamedPart(self.name.as_deref()), format)?.into())
    }
}

/// Prints one row per link of the part.
///
/// # Errors
/// If no system is found, its registry does not answer, or nothing in it has the name.
fn print_links(
    running: &RunningSystem,
    part: NamedPart<'_>,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let observed = super::select_system(running, "graph")?;
    let sightings = observed.ask_statuses()?;
    let mut hosts = HostsOfComponents::of(&sightings);
    let before = keep_statuses(sightings);
    let mut statuses = if format == OutputFormat::Dot {
        before.clone()
    } else {
        thread::sleep(RATE_OVER);
        let sightings = observed.ask_statuses()?;
        hosts = HostsOfComponents::of(&sightings);
        keep_statuses(sightings)
    };
    let unheard = UnheardReports::read(&observed);
    let mut edges = combine_links(&pair_reports(&before, &statuses));
    if part.0.is_some() {
        let absent = list_absent(running);
        let names = hosts.0.keys().chain(absent.iter().map(|it| &it.component)).cloned();
        let names: Vec<_> = names.chain(statuses.iter().flat_map(list_ports)).collect();
        let ends = edges.iter().flat_map(|edge| [edge.from.as_str(), edge.to.as_str()]);
        part.expect_among(names.iter().map(String::as_str).chain(ends))?;
        keep_part(part, &mut statuses, &mut edges);
    }
    end_printing(match format {
        OutputFormat::Json => edges.iter().try_for_each(|edge| {
            let mut line = serde_json::to_value(edge)?;
            line["from_host"] = hosts.find(&edge.from).into();
            line["to_host"] = hosts.find(&edge.to).into();
            print_line(line)
        }),
        OutputFormat::Dot => print_line(format_dot(&statuses, &edges, &hosts, &unheard)),
        OutputFormat::Text => {
            let mut headings = vec![
                "FROM", "TO", "TYPE", "KEEP", "VIA", "RATE", "SENT", "RECEIVED", "DROPPED", "LOST",
                "SKIPPED", "QUEUED", "WAITING", "STATE",
            ];
            let mut rows: Vec<_> = edges.iter().map(format_row).collect();
            if edges.iter().all(|edge| edge.keep != "pull") {
                headings.remove(SKIPPED_COLUMN);
                rows.iter_mut().for_each(|row| drop(row.remove(SKIPPED_COLUMN)));
            }
            if hosts.are_several() {
                headings.insert(HOSTS_COLUMN, "HOSTS");
                for (row, edge) in rows.iter_mut().zip(&edges) {
                    row.insert(HOSTS_COLUMN, hosts.describe_link(edge));
                }
            }
            let table = Table::new(&headings, rows).dispensable(&DISPENSABLE);
            let text = table.format(terminal_width()) + &list_lost_reports(&statuses, &unheard);
            print_line(text.trim_end())
        }
    })
}

/// The outputs and inputs of a component, with its name before them.
fn list_ports(status: &Status) -> Vec<String> {
    let outputs = status.outputs.iter().map(|output| output.data.clone());
    let inputs = status.inputs.iter().map(|input| format!("{}.{}", status.name, input.id));
    outputs.chain(inputs).collect()
}

/// Keeps the links of the part, and the components at their ends.
fn keep_part(part: NamedPart<'_>, statuses: &mut Vec<Status>, edges: &mut Vec<ObservedLink>) {
    edges.retain(|edge| part.contains(&edge.from) || part.contains(&edge.to));
    statuses.retain(|status| {
        let own = NamedPart(Some(&status.name));
        part.contains(&status.name)
            || edges.iter().any(|edge| own.contains(&edge.from) || own.contains(&edge.to))
    });
}

/// On which host each component runs.
struct HostsOfComponents(BTreeMap<String, String>);

impl HostsOfComponents {
    fn of(sightings: &[Sighting]) -> Self {
        let entries = sightings.iter().map(|sighting| &sighting.entry);
        Self(entries.map(|entry| (entry.name.clone(), entry.host.clone())).collect())
    }

    /// The host of an output, an input or a component; none for a tool.
    fn find(&self, port: &str) -> Option<&str> {
        self.0.get(port.split('.').next().unwrap_or_default()).map(String::as_str)
    }

    fn are_several(&self) -> bool {
        let first = self.0.values().next();
        self.0.values().any(|host| Some(host) != first)
    }

    fn describe_link(&self, link: &ObservedLink) -> String {
        match (self.find(&link.from), self.find(&link.to)) {
            (Some(from), Some(to)) if from == to => from.to_owned(),
            (from, to) => format!("{} → {}", from.unwrap_or("-"), to.unwrap_or("-")),
        }
    }
}

fn keep_statuses(sightings: Vec<Sighting>) -> Vec<Status> {
    sightings.into_iter().filter_map(|sighting| sighting.status.ok()).collect()
}

/// Returns a line for each component with events that no executive has taken, or reports that no
/// transition waits for.
fn list_lost_reports(statuses: &[Status], unheard: &UnheardReports) -> String {
    let lines = statuses.iter().flat_map(|status| {
        let lost = describe_lost_reports(status, unheard);
        lost.map(|lost| flatten_text(&format!("{}: {lost}", status.name)) + "\n")
    });
    lines.collect()
}

fn describe_lost_reports(
    status: &Status,
    unheard: &UnheardReports,
) -> impl Iterator<Item = String> + use<> {
    describe_untaken_events(status).into_iter().chain(unheard.describe(&status.name))
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
        if edge.transport.is_empty() { "-".into() } else { edge.transport.clone() },
        edge.rate_hz.map_or("-".into(), |hz| format!("{hz:.1} Hz")),
        edge.sent.to_string(),
        // A tool, and the time of a process, report no counts of their own.
        if edge.to.contains('.') { edge.received.to_string() } else { "-".into() },
        edge.dropped.to_string(),
        edge.lost.to_string(),
        if edge.keep == "pull" { edge.skipped.to_string() } else { "-".into() },
        edge.queued.to_string(),
        edge.waiting.to_string(),
        state,
    ]
}

fn format_dot(
    statuses: &[Status],
    edges: &[ObservedLink],
    hosts: &HostsOfComponents,
    unheard: &UnheardReports,
) -> String {
    let mut out = String::from("digraph system {\n  rankdir=LR;\n  node [shape=box];\n");
    for status in statuses {
        let Status { name, kind, .. } = status;
        let lost = describe_lost_reports(status, unheard).map(|text| format!("\\n{text}"));
        let lost: String = lost.collect();
        let _ = writeln!(out, "  {name:?} [label=\"{name}\\n{kind}{lost}\"];");
    }
    if hosts.are_several() {
        let names: BTreeSet<_> = hosts.0.values().collect();
        for host in names {
            let _ =
                writeln!(out, "  subgraph {:?} {{\n    label={host:?};", format!("cluster_{host}"));
            let there = statuses.iter().filter(|status| hosts.find(&status.name) == Some(host));
            for status in there {
                let _ = writeln!(out, "    {:?};", status.name);
            }
            out.push_str("  }\n");
        }
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
            untaken_events: 0,
            time_s: 0.0,
            busy: false,
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
            transport: "shm".into(),
            connected: problem.is_empty(),
            paused: false,
            sent: 140,
            dropped: 7,
            skipped: 0,
            history_dropped: 0,
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
        let expected =
            ["laser.scan", "slam.scan", "LaserScan", "latest", "shm", "20.0 Hz", "140", "131"];
        assert_eq!(cells[..8], expected);
        assert_eq!(cells[8..], ["7", "2", "-", "1", "5", "up"]);
        let pulled = ObservedLink { keep: "pull".into(), skipped: 9, ..format_edge("") };
        assert_eq!(format_row(&pulled)[SKIPPED_COLUMN], "9");
        let one = place(&[("laser", "robot"), ("slam", "robot")]);
        let drawn =
            format_dot(&[status("laser"), status("slam")], &[format_edge("")], &one, &none());
        assert!(drawn.contains("\"laser\" -> \"slam\"") && !drawn.contains("cluster"), "{drawn}");
    }

    #[test]
    fn a_name_keeps_its_links_and_the_components_at_their_ends() {
        let to_map =
            ObservedLink { from: "slam.map".into(), to: "view.map".into(), ..format_edge("") };
        let kept = |name| {
            let mut statuses = ["laser", "slam", "view"].map(status).to_vec();
            let mut edges = vec![format_edge(""), to_map.clone()];
            keep_part(NamedPart(Some(name)), &mut statuses, &mut edges);
            let names: Vec<_> = statuses.into_iter().map(|status| status.name).collect();
            (edges.into_iter().map(|edge| edge.to).collect::<Vec<_>>(), names)
        };
        let owned = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
        let of = |to: &[&str], names: &[&str]| (owned(to), owned(names));
        assert_eq!(kept("slam"), of(&["slam.scan", "view.map"], &["laser", "slam", "view"]));
        assert_eq!(kept("laser"), of(&["slam.scan"], &["laser", "slam"]));
        assert_eq!(kept("view.map"), of(&["view.map"], &["slam", "view"]));
        assert_eq!(kept("slam.other"), of(&[], &[]));
    }

    fn none() -> UnheardReports {
        UnheardReports::default()
    }

    fn place(components: &[(&str, &str)]) -> HostsOfComponents {
        let places = components.iter().map(|(name, host)| (name.to_string(), host.to_string()));
        HostsOfComponents(places.collect())
    }

    #[test]
    fn components_of_several_hosts_are_drawn_in_a_box_for_each() {
        let hosts = place(&[("laser", "arm"), ("slam", "robot")]);
        let edge = format_edge("");
        assert_eq!(hosts.describe_link(&edge), "arm → robot");
        let to_tool = ObservedLink { to: "echo-7".into(), ..format_edge("") };
        assert_eq!(hosts.describe_link(&to_tool), "arm → -");
        let drawn = format_dot(&[status("laser"), status("slam")], &[edge], &hosts, &none());
        let group = "  subgraph \"cluster_arm\" {\n    label=\"arm\";\n    \"laser\";\n  }\n";
        assert!(drawn.contains(group) && drawn.contains("cluster_robot"), "{drawn}");
    }

    #[test]
    fn reports_that_no_executive_takes_are_part_of_the_drawing() {
        let heater = Status { untaken_events: 12, ..status("heater") };
        let drawn = format_dot(&[heater], &[], &place(&[]), &none());
        assert!(drawn.contains("simulator\\n12 events that no executive"), "{drawn}");
        let unheard = UnheardReports::of("heater", 3);
        let drawn = format_dot(&[status("heater")], &[], &place(&[]), &unheard);
        assert!(drawn.contains("simulator\\n3 reports that no transition waits for"), "{drawn}");
    }

    #[test]
    fn a_line_below_the_table_stays_one_line() {
        let heater = Status { untaken_events: 1, ..status("hea\nter") };
        let text = list_lost_reports(&[heater, status("laser")], &UnheardReports::of("laser", 1));
        let lost = "hea ter: 1 event that no executive has taken\n\
                    laser: 1 report that no transition waits for\n";
        assert_eq!(text, lost);
    }

    #[test]
    fn a_link_that_is_down_shows_the_reason() {
        let cells = format_row(&format_edge("no component provides laser.scan"));
        assert_eq!(cells.last().map(String::as_str), Some("no component provides laser.scan"));
    }
}
