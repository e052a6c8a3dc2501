//! `armor data info NAME`: one output, with its type, its provider and its subscribers.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use armor_inspect::words::{format_bytes, format_duration};
use armor_inspect::{ObservedLink, ObservedSystem, combine_links, pair_reports};
use armor_wire::control::{RunState, Status};
use armor_wire::registry::{ComponentEntry, DataEntry};
use serde::Serialize;

use super::super::absence::list_absent;
use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::inspect_cli::describe::fields::list_fields;
use crate::inspect_cli::select_system;
use crate::inspect_cli::silence::explain_unprovided;
use crate::inspect_cli::time_source::find_time_source;
use crate::print::{Table, end_printing, print_line, terminal_width};

/// Time over which rates are taken and the last value is waited for.
const LOOK_FOR: Duration = Duration::from_secs(1);

/// One output.
#[derive(Debug, Serialize)]
struct OutputInfo {
    data: String,
    #[serde(rename = "type")]
    type_name: String,
    latched: bool,
    fields: Vec<ListedField>,
    provider: Provider,
    /// Messages per second; none if the provider does not answer or has just started.
    rate_hz: Option<f64>,
    published: Option<u64>,
    last: Option<LastValue>,
    links: Vec<ObservedLink>,
}

#[derive(Debug, PartialEq, Serialize)]
struct ListedField {
    path: String,
    #[serde(rename = "type")]
    type_name: String,
}

#[derive(Debug, Serialize)]
struct Provider {
    component: String,
    kind: String,
    pid: u32,
    host: String,
    endpoint: String,
    /// None if it does not answer.
    state: Option<RunState>,
}

/// The newest value that has been seen.
#[derive(Debug, Serialize)]
struct LastValue {
    sequence: u64,
    stamp_s: f64,
    bytes: usize,
    /// None in a system whose time follows data.
    age_s: Option<f64>,
}

/// Prints what is known about an output.
///
/// # Errors
/// If no system is found, its registry does not answer, or nothing in it provides the data.
pub fn print_info(
    running: &RunningSystem,
    data: &str,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let observed = select_system(running, "data")?;
    let before = ask_statuses(&observed)?;
    let listing = observed.list()?;
    let component = data.split('.').next().unwrap_or_default();
    let entry = listing.data.iter().find(|entry| entry.data == data);
    let provider = listing.components.iter().find(|entry| entry.name == component);
    let (Some(entry), Some(provider)) = (entry, provider) else {
        return Err(explain_absence(running, &observed, &before, data));
    };
    let look = LastLook::take(&observed, entry, &before);
    let now = ask_statuses(&observed)?;
    let info = combine_info(entry, provider, &before, &now, look);
    end_printing(match format {
        OutputFormat::Json => print_line(serde_json::to_string(&info)?),
        _ => print_line(in_words(&info).trim_end()),
    })
}

fn ask_statuses(observed: &ObservedSystem) -> Result<Vec<Status>> {
    let sightings = observed.ask_statuses()?;
    Ok(sightings.into_iter().filter_map(|sighting| sighting.status.ok()).collect())
}

/// Returns why nothing provides the data, and which inputs wait for it.
fn explain_absence(
    running: &RunningSystem,
    observed: &ObservedSystem,
    statuses: &[Status],
    data: &str,
) -> anyhow::Error {
    let component = data.split('.').next().unwrap_or_default();
    let absent = list_absent(running).into_iter().find(|absent| absent.component == component);
    let why = match absent {
        Some(absent) => format!("{data} has no provider: {component}: {}", absent.reason),
        None => explain_unprovided(observed, data)
            .map_or_else(|| format!("no component provides {data}"), |error| error.to_string()),
    };
    match list_waiting(statuses, data).as_slice() {
        [] => anyhow!(why),
        waiting => anyhow!("{why}; inputs that wait for it: {}", waiting.join(", ")),
    }
}

/// Returns the inputs that the file feeds with the data, `COMPONENT.INPUT`.
pub fn list_waiting(statuses: &[Status], data: &str) -> Vec<String> {
    let inputs = statuses.iter().flat_map(|status| {
        let own = status.inputs.iter().filter(|input| input.data == data);
        own.map(|input| format!("{}.{}", status.name, input.id))
    });
    inputs.collect()
}

/// What a short link to the output has shown.
#[derive(Default)]
struct LastLook {
    schema: Option<String>,
    last: Option<LastValue>,
}

impl LastLook {
    /// Reads the output for [`LOOK_FOR`], which is also the time between the two statuses.
    fn take(observed: &ObservedSystem, entry: &DataEntry, statuses: &[Status]) -> Self {
        let start = Instant::now();
        let mut look = Self::default();
        let follows = find_time_source(statuses).is_some();
        if let Ok(mut tap) = observed.tap_within(&entry.data, LOOK_FOR) {
            look.schema = Some(tap.schema().to_string());
            while let Ok(Some(item)) = tap.next(LOOK_FOR.saturating_sub(start.elapsed())) {
                let age_s = observed.timestamp() - item.header.stamp_s;
                look.last = Some(LastValue {
                    sequence: item.header.sequence,
                    stamp_s: item.header.stamp_s,
                    bytes: item.payload.len(),
                    age_s: (!follows).then_some(age_s),
                });
            }
            // The age is that at the end, not on arrival.
            if let Some(last) = look.last.as_mut().filter(|_| !follows) {
                last.age_s = Some(observed.timestamp() - last.stamp_s);
            }
        }
        thread::sleep(LOOK_FOR.saturating_sub(start.elapsed()));
        look
    }
}

fn combine_info(
    entry: &DataEntry,
    provider: &ComponentEntry,
    before: &[Status],
    now: &[Status],
    look: LastLook,
) -> OutputInfo {
    let own_tool = format!("tool-{}", std::process::id());
    let find = |statuses: &'_ [Status]| {
        let status = statuses.iter().find(|status| status.name == provider.name);
        let counts = status.and_then(|status| {
            let output = status.outputs.iter().find(|output| output.data == entry.data)?;
            Some((status.uptime_s, output.published))
        });
        (status.map(|status| status.state), counts)
    };
    let ((_, earlier), (state, later)) = (find(before), find(now));
    let rate_hz = earlier.zip(later).and_then(|((from_s, from), (to_s, to))| {
        let more = to.checked_sub(from)?;
        (to_s > from_s).then(|| more as f64 / (to_s - from_s))
    });
    let mut links = combine_links(&pair_reports(before, now));
    links.retain(|link| link.from == entry.data && link.to != own_tool);
    let schema = look.schema.as_ref().unwrap_or(&entry.schema);
    let fields = list_fields(schema).into_iter();
    OutputInfo {
        data: entry.data.clone(),
        type_name: entry.type_name.clone(),
        latched: entry.latched,
        fields: fields.map(|(path, type_name)| ListedField { path, type_name }).collect(),
        provider: Provider {
            component: provider.name.clone(),
            kind: provider.kind.clone(),
            pid: provider.pid,
            host: provider.host.clone(),
            endpoint: provider.endpoint.clone(),
            state,
        },
        rate_hz,
        published: later.map(|(_, published)| published),
        last: look.last,
        links,
    }
}

fn in_words(info: &OutputInfo) -> String {
    let width = terminal_width();
    let OutputInfo { data, type_name, latched, provider, published, rate_hz, .. } = info;
    let state = provider.state.map_or("does not answer".into(), |state| state.to_string());
    let mut out = format!("{data}: {type_name}{}\n", if *latched { ", latched" } else { "" });
    out += &format!(
        "provider    {}, kind {}, {state}, process {} on {}\n",
        provider.component, provider.kind, provider.pid, provider.host
    );
    let count = published.map_or("an unknown number".into(), |count| count.to_string());
    let rate = rate_hz.map(|rate_hz| format!(", {rate_hz:.1} Hz now")).unwrap_or_default();
    out += &format!("published   {count}{rate}\n");
    out += &format!("last value  {}\n", describe_last(info));
    if info.links.is_empty() {
        out += "linked to   nothing\n";
    } else {
        out += "\n";
        let rows = info.links.iter().map(format_link).collect();
        let headings = ["LINKED TO", "KEEP", "VIA", "RATE", "DROPPED", "LOST", "STATE"];
        out += &Table::new(&headings, rows).dispensable(&["VIA", "KEEP"]).format(width);
    }
    let rows = info.fields.iter().map(|field| vec![field.path.clone(), field.type_name.clone()]);
    out += "\n";
    out += &Table::new(&["FIELD", "TYPE"], rows.collect()).format(width);
    out
}

fn describe_last(info: &OutputInfo) -> String {
    let waited = format_duration(LOOK_FOR.as_secs_f64());
    match &info.last {
        Some(LastValue { bytes, age_s: Some(age_s), .. }) => {
            format!("{} old, {}", format_duration(*age_s), format_bytes(*bytes as f64))
        }
        Some(LastValue { bytes, stamp_s, .. }) => {
            format!("{} of {stamp_s:.3} s, in the system's time", format_bytes(*bytes as f64))
        }
        None if info.published == Some(0) => "none: it has not been published yet".into(),
        None => format!("none was published within {waited}"),
    }
}

fn format_link(link: &ObservedLink) -> Vec<String> {
    let state = match (link.connected, link.paused) {
        (true, true) => "paused".into(),
        (true, false) => "up".into(),
        (false, _) if link.problem.is_empty() => "down".into(),
        (false, _) => format!("down: {}", link.problem),
    };
    vec![
        link.to.clone(),
        link.keep.clone(),
        link.transport.clone(),
        link.rate_hz.map_or("-".into(), |rate_hz| format!("{rate_hz:.1} Hz")),
        link.dropped.to_string(),
        link.lost.to_string(),
        state,
    ]
}
