//! `armor describe [KIND]`: the kinds of components that a system can use.

pub mod fields;

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_inspect::ObservedSystem;
use armor_inspect::systems;
use armor_robotfile::{Colours, Findings, advise_similar};
use armor_wire::manifest::{EventManifest, EventValue, Manifest, ParameterManifest, PortManifest};
use clap::Args;
use serde_json::json;

use crate::arguments::{KindFolders, OutputFormat};
use crate::exit::CommandEnding;
use crate::kinds::{Catalogue, ComponentKind};
use crate::print;
use crate::print::{Table, end_printing, print_line, print_notice, terminal_width, wrap_text};
use crate::verb::Verb;
use fields::list_fields;

/// Show a kind of component: its ports, the fields of their messages with units, and its
/// parameters. Without KIND: list all kinds.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor describe                  all kinds
  armor describe simulator        its ports, messages and parameters
  armor describe --format json simulator | jq .outputs")]
pub struct DescribeArguments {
    /// The kind.
    pub kind: Option<String>,
    #[command(flatten)]
    pub kinds: KindFolders,
}

impl Verb for DescribeArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(describe_kinds(&self, format)?.into())
    }
}

/// Prints one kind, or a line for each.
///
/// # Errors
/// If there is no such kind, or a component directory of the arguments cannot be read.
fn describe_kinds(arguments: &DescribeArguments, format: OutputFormat) -> Result<CommandEnding> {
    // The same as for a file in the current folder, whose `components/` is searched.
    let here = Path::new("system.xml");
    let catalogue = Catalogue::gather(&arguments.kinds.directories, [here])?;
    let mut findings = Findings::default();
    findings.extend(catalogue.findings(None));
    let stderr = std::io::stderr();
    let colours = if print::wants_colours(&stderr) { Colours::Yes } else { Colours::No };
    let problems = findings.render(colours);
    if !problems.is_empty() {
        print_notice(problems.trim_end());
    }
    let ending = match &arguments.kind {
        None => end_printing(list_kinds(&catalogue, format)),
        Some(name) => {
            let Some(kind) = catalogue.kinds.get(name) else {
                let known: Vec<_> = catalogue.kinds.keys().map(String::as_str).collect();
                let advice = match find_kind_of(name) {
                    Some(kind) => format!(
                        "; `{name}` runs as a component of the kind {kind}: `armor describe {kind}`"
                    ),
                    None => advise_similar(name, known.iter().copied()),
                };
                bail!(
                    "no kind is called {name}{advice} (there are: {}); {}",
                    known.join(", "),
                    catalogue.describe_search(name)
                );
            };
            end_printing(match format {
                OutputFormat::Json => print_line(with_origin(kind)),
                _ => print_line(in_words(kind).trim_end()),
            })
        }
    }?;
    Ok(if findings.has_errors() { CommandEnding::Failed } else { ending })
}

/// Returns the kind of the component with that name in a running system, for those who give the
/// name that they see in `armor ps`.
fn find_kind_of(component: &str) -> Option<String> {
    let records = systems::list_running(&systems::record_directory().ok()?).ok()?;
    records.iter().find_map(|record| {
        let observed = ObservedSystem::at(&record.registry.to_string(), "describe");
        let listed = observed.list().ok()?.components;
        listed.into_iter().find(|entry| entry.name == component).map(|entry| entry.kind)
    })
}

fn list_kinds(catalogue: &Catalogue, format: OutputFormat) -> Result<()> {
    if format == OutputFormat::Json {
        return catalogue.kinds.values().try_for_each(|kind| print_line(with_origin(kind)));
    }
    let rows: Vec<_> = catalogue
        .kinds
        .values()
        .map(|kind| {
            vec![kind.manifest.kind.clone(), kind.manifest.summary.clone(), format_origins(kind)]
        })
        .collect();
    let table = Table::new(&["KIND", "SUMMARY", "ORIGIN"], rows);
    print_line(table.format(terminal_width()).trim_end())
}

fn format_origins(kind: &ComponentKind) -> String {
    let all = [&kind.origin].into_iter().chain(&kind.rivals);
    all.map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// Returns the manifest, with the program that runs the kind.
fn with_origin(kind: &ComponentKind) -> serde_json::Value {
    let mut value = json!(kind.manifest);
    value["origin"] = kind.origin.to_string().into();
    value
}

fn in_words(kind: &ComponentKind) -> String {
    let Manifest { kind: name, summary, inputs, outputs, parameters, .. } = &kind.manifest;
    let width = terminal_width();
    let summary = wrap_text(summary, width.unwrap_or(usize::MAX)).join("\n");
    let mut out = format!("{name} ({})\n{summary}\n", format_origins(kind));
    if !kind.manifest.controllable {
        out += "No mission may freeze it: it is always active.\n";
    }
    let ports = [("INPUT", inputs), ("OUTPUT", outputs)];
    for (heading, ports) in ports.into_iter().filter(|(_, ports)| !ports.is_empty()) {
        let rows = ports.iter().map(|port| format_port(port, &kind.manifest)).collect();
        out += "\n";
        out += &Table::new(&[heading, "TYPE", "", ""], rows).format(width);
    }
    if !parameters.is_empty() {
        let rows: Vec<_> = parameters.iter().map(format_parameter).collect();
        out += "\n";
        let headings = ["PARAMETER", "TYPE", "DEFAULT", "RANGE", "", ""];
        out += &Table::new(&headings, rows).format(width);
    }
    out += &describe_events(&kind.manifest, width);
    out += &describe_messages(inputs.iter().chain(outputs), width);
    out
}

/// Returns the table of what a mission can wait for, or a line if that is only what components of every
/// kind report or is not known.
fn describe_events(manifest: &Manifest, width: Option<usize>) -> String {
    let line = match &manifest.events {
        Some(events) if !events.is_empty() => {
            let rows: Vec<_> = events.iter().map(format_event).collect();
            return format!("\n{}", Table::new(&["EVENT", "VALUE", ""], rows).format(width));
        }
        Some(_) if !manifest.reports_done => "It reports no events, only failed.",
        Some(_) => "It reports no events, only done and failed.",
        None => "Its events are not known: its manifest does not list them.",
    };
    format!("\n{}\n", wrap_text(line, width.unwrap_or(usize::MAX)).join("\n"))
}

/// Returns the fields of each message type, once.
fn describe_messages<'a>(
    ports: impl Iterator<Item = &'a PortManifest>,
    width: Option<usize>,
) -> String {
    let mut types: Vec<&PortManifest> = ports.collect();
    types.retain(|port| !port.is_any());
    types.sort_by_key(|port| &port.type_name);
    types.dedup_by_key(|port| &port.type_name);
    let mut out = String::new();
    for port in types {
        let rows = list_fields(&port.schema).into_iter().map(|(path, kind)| vec![path, kind]);
        out += "\n";
        out += &Table::new(&[&format!("MESSAGE {}", port.type_name), ""], rows.collect())
            .format(width);
    }
    out
}

fn format_event(event: &EventManifest) -> Vec<String> {
    let name = match event.named_by.as_str() {
        "" => event.name.clone(),
        parameter => format!("the words of {parameter}"),
    };
    let value = match event.value {
        Some(EventValue::Number) if !event.unit.is_empty() => event.unit.clone(),
        Some(EventValue::Number) => "number".into(),
        Some(EventValue::Integer) => "integer".into(),
        None => String::new(),
    };
    vec![name, value, event.doc.clone()]
}

fn format_port(port: &PortManifest, of: &Manifest) -> Vec<String> {
    let nature = match (port.required, port.latched) {
        (true, _) => "required",
        (_, true) => "latched",
        _ => "",
    };
    let sources = if port.many { "any number of links" } else { "" };
    let age = match port.stale_after.as_str() {
        "" => String::new(),
        age => format!("not older than {age}"),
    };
    let frame = of.frames.iter().find(|frame| frame.port == port.id);
    let frame = frame.map(|it| format!("in the frame {}", it.parameter)).unwrap_or_default();
    let parts = [nature.to_owned(), sources.to_owned(), age, frame];
    let nature: Vec<_> = parts.into_iter().filter(|it| !it.is_empty()).collect();
    vec![port.id.clone(), port.type_name.clone(), nature.join(", "), port.doc.clone()]
}

/// Values as they are written into a file.
fn format_parameter(parameter: &ParameterManifest) -> Vec<String> {
    let kind = parameter.kind.to_string();
    let range = match parameter.range_with_unit() {
        range if range.is_empty() && parameter.format.is_some() => parameter.form(),
        range if range.is_empty() => parameter.choices.join(" | "),
        range => range,
    };
    let default = match parameter.default_with_unit() {
        None => "(required)".into(),
        Some(default) if default.is_empty() => "\"\"".into(),
        Some(default) => default,
    };
    let live = if parameter.live { "live" } else { "" };
    vec![parameter.name.clone(), kind, default, range, live.into(), parameter.doc.clone()]
}
