//! `armor data list`: every output of a running system.

use std::collections::HashMap;
use std::thread;
use std::time::Duration;

use anyhow::Result;
use armor_wire::control::Status;
use armor_wire::registry::DataEntry;
use serde::Serialize;

use super::super::absence::list_absent;
use super::super::named_part::NamedPart;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::inspect_cli::select_system;
use crate::print::{Table, end_printing, print_line, terminal_width};

/// Time between the two statuses from which rates are computed.
const RATE_OVER: Duration = Duration::from_secs(1);

/// An output.
#[derive(Debug, PartialEq, Serialize)]
struct ListedOutput {
    data: String,
    #[serde(rename = "type")]
    type_name: String,
    latched: bool,
    /// Messages per second; none if the component does not answer or has just started.
    rate_hz: Option<f64>,
    published: Option<u64>,
    /// The components and tools that are linked to it.
    links: Vec<String>,
}

/// Prints one row per output of the part.
///
/// # Errors
/// If no system is found, its registry does not answer, or nothing in it has the name.
pub fn list_outputs(
    running: &RunningSystem,
    part: NamedPart<'_>,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let observed = select_system(running, "data")?;
    let ask = || -> Result<Vec<Status>> {
        let sightings = observed.ask_statuses()?;
        Ok(sightings.into_iter().filter_map(|sighting| sighting.status.ok()).collect())
    };
    let before = ask()?;
    thread::sleep(RATE_OVER);
    let now = ask()?;
    let listing = observed.list()?;
    if part.0.is_some() {
        let absent = list_absent(running);
        let names = listing.components.iter().map(|entry| entry.name.as_str());
        let names = names.chain(absent.iter().map(|it| it.component.as_str()));
        part.expect_among(names.chain(listing.data.iter().map(|entry| entry.data.as_str())))?;
    }
    let mut outputs = combine_outputs(&listing.data, &before, &now);
    outputs.retain(|output| part.contains(&output.data));
    end_printing(if format == OutputFormat::Json {
        outputs.iter().try_for_each(|output| print_line(serde_json::to_string(output)?))
    } else {
        let rows = outputs.iter().map(format_row).collect();
        let table = Table::new(&["DATA", "TYPE", "RATE", "PUBLISHED", "LINKED TO"], rows);
        print_line(table.dispensable(&["PUBLISHED"]).format(terminal_width()).trim_end())
    })
}

fn combine_outputs(entries: &[DataEntry], before: &[Status], now: &[Status]) -> Vec<ListedOutput> {
    let earlier: HashMap<_, _> = published_counts(before).collect();
    let counts: HashMap<_, _> = published_counts(now).collect();
    let listed = entries.iter().map(|entry| {
        let outputs = now.iter().flat_map(|status| &status.outputs);
        let found = outputs.filter(|output| output.data == entry.data);
        let links = found.flat_map(|output| output.links.iter().map(|link| link.to.clone()));
        let count = counts.get(entry.data.as_str());
        let rate_hz = count.zip(earlier.get(entry.data.as_str())).and_then(|(now, before)| {
            let passed_s = now.uptime_s - before.uptime_s;
            let more = now.published.checked_sub(before.published)?;
            (passed_s > 0.0).then(|| more as f64 / passed_s)
        });
        let mut links: Vec<String> = links.collect();
        links.sort();
        ListedOutput {
            data: entry.data.clone(),
            type_name: entry.type_name.clone(),
            latched: entry.latched,
            rate_hz,
            published: count.map(|count| count.published),
            links,
        }
    });
    let mut listed: Vec<_> = listed.collect();
    listed.sort_by(|a, b| a.data.cmp(&b.data));
    listed
}

/// The number of messages on an output, and the age of its process when it was counted.
struct PublishedCount {
    published: u64,
    uptime_s: f64,
}

fn published_counts(statuses: &[Status]) -> impl Iterator<Item = (&str, PublishedCount)> {
    statuses.iter().flat_map(|status| {
        status.outputs.iter().map(|output| {
            let uptime_s = status.uptime_s;
            (output.data.as_str(), PublishedCount { published: output.published, uptime_s })
        })
    })
}

fn format_row(output: &ListedOutput) -> Vec<String> {
    let latched = if output.latched { ", latched" } else { "" };
    let links = if output.links.is_empty() { "not linked".into() } else { output.links.join(", ") };
    vec![
        output.data.clone(),
        format!("{}{latched}", output.type_name),
        output.rate_hz.map_or("-".into(), |rate_hz| format!("{rate_hz:.1} Hz")),
        output.published.map_or("-".into(), |count| count.to_string()),
        links,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_wire::control::{LinkStatus, OutputStatus, RunState};
    use armor_wire::keep::Keep;

    fn status(uptime_s: f64, published: u64) -> Status {
        let link = |to: &str| LinkStatus {
            to: to.into(),
            keep: Keep::Latest,
            sent: 0,
            dropped: 0,
            queued: 0,
            paused: false,
            transport: "unix".into(),
        };
        let output = OutputStatus {
            id: "scan".into(),
            data: "laser.scan".into(),
            type_name: "LaserScan".into(),
            published,
            published_bytes: 0,
            links: vec![link("slam"), link("map")],
        };
        Status {
            name: "laser".into(),
            kind: "laser".into(),
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
            outputs: vec![output],
            inputs: Vec::new(),
        }
    }

    #[test]
    fn every_registered_output_is_listed_with_its_rate_and_its_links() {
        let entry = |data: &str, type_name: &str, latched| DataEntry {
            data: data.into(),
            type_name: type_name.into(),
            schema: String::new(),
            latched,
        };
        let entries = [entry("map.grid", "Grid", true), entry("laser.scan", "LaserScan", false)];
        let rows: Vec<_> = combine_outputs(&entries, &[status(10.0, 100)], &[status(12.0, 140)])
            .iter()
            .map(format_row)
            .collect();
        assert_eq!(rows[0], ["laser.scan", "LaserScan", "20.0 Hz", "140", "map, slam"]);
        assert_eq!(rows[1], ["map.grid", "Grid, latched", "-", "-", "not linked"]);
        let restarted = combine_outputs(&entries, &[status(10.0, 100)], &[status(1.0, 7)]);
        assert_eq!(restarted[0].rate_hz, None);
    }
}
