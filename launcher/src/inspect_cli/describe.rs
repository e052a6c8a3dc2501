//! `armor describe [KIND]`: what there is to build a system from.

use std::path::Path;

use anyhow::{Result, bail};
use armor_robotfile::{Colours, Findings};
use armor_wire::manifest::{Manifest, ParameterManifest, PortManifest};
use serde_json::json;

use super::{printed, say};
use crate::arguments::{Describe, Format};
use crate::exit::Ending;
use crate::kinds::{Catalogue, Kind};
use crate::print;

/// Prints one kind, or a line for each.
///
/// # Errors
/// If there is no such kind, or a component directory that was asked for cannot be read.
pub fn run(arguments: &Describe, format: Format) -> Result<Ending> {
    // As for a file in the current folder: `components/` belongs to it.
    let here = Path::new("system.xml");
    let catalogue = Catalogue::gather(&arguments.kinds.directories, [here])?;
    let mut findings = Findings::default();
    findings.extend(catalogue.findings(None));
    let stderr = std::io::stderr();
    let colours = if print::coloured(&stderr) { Colours::Yes } else { Colours::No };
    eprint!("{}", findings.render(colours));
    let ending = match &arguments.kind {
        None => printed(list(&catalogue, format)),
        Some(name) => {
            let Some(kind) = catalogue.kinds.get(name) else {
                let known: Vec<_> = catalogue.kinds.keys().map(String::as_str).collect();
                bail!("no kind is called {name}; there are {}", known.join(", "));
            };
            printed(match format {
                Format::Json => say(with_origin(kind)),
                _ => say(in_words(kind).trim_end()),
            })
        }
    }?;
    Ok(if findings.has_errors() { Ending::Failed } else { ending })
}

fn list(catalogue: &Catalogue, format: Format) -> Result<()> {
    if format == Format::Json {
        return catalogue.kinds.values().try_for_each(|kind| say(with_origin(kind)));
    }
    let rows: Vec<_> = catalogue
        .kinds
        .values()
        .map(|kind| vec![kind.manifest.kind.clone(), kind.manifest.summary.clone(), origins(kind)])
        .collect();
    say(print::table(&["KIND", "SUMMARY", "ORIGIN"], &rows).trim_end())
}

fn origins(kind: &Kind) -> String {
    let all = [&kind.origin].into_iter().chain(&kind.rivals);
    all.map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// The manifest, and beside it what runs the kind.
fn with_origin(kind: &Kind) -> serde_json::Value {
    let mut value = json!(kind.manifest);
    value["origin"] = kind.origin.to_string().into();
    value
}

fn in_words(kind: &Kind) -> String {
    let Manifest { kind: name, summary, inputs, outputs, parameters, .. } = &kind.manifest;
    let mut out = format!("{name} ({})\n{summary}\n", origins(kind));
    let ports = [("INPUT", inputs), ("OUTPUT", outputs)];
    for (heading, ports) in ports.into_iter().filter(|(_, ports)| !ports.is_empty()) {
        let rows: Vec<_> = ports.iter().map(port).collect();
        out += "\n";
        out += &print::table(&[heading, "TYPE", "", ""], &rows);
    }
    if !parameters.is_empty() {
        let rows: Vec<_> = parameters.iter().map(parameter).collect();
        out += "\n";
        out += &print::table(&["PARAMETER", "TYPE", "DEFAULT", "RANGE", "", ""], &rows);
    }
    out
}

fn port(port: &PortManifest) -> Vec<String> {
    let nature = match (port.required, port.latched) {
        (true, _) => "required",
        (_, true) => "latched",
        _ => "",
    };
    vec![port.id.clone(), port.type_name.clone(), nature.into(), port.doc.clone()]
}

/// Values as they are written into a file.
fn parameter(parameter: &ParameterManifest) -> Vec<String> {
    let kind = parameter.kind.to_string();
    let range = match parameter.range_with_unit() {
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
