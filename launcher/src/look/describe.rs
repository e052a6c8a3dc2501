//! `armor describe [KIND]`: what there is to build a system from.

use std::path::Path;

use anyhow::{Result, bail};
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
/// If there is no such kind, or the component directories cannot be read.
pub fn run(arguments: &Describe, format: Format) -> Result<Ending> {
    // As for a file in the current folder: `components/` belongs to it.
    let here = Path::new("system.xml");
    let catalogue = Catalogue::gather(&arguments.kinds.directories, [here])?;
    for problem in &catalogue.problems {
        eprintln!("warning: {problem}; this executable is not used");
    }
    let Some(name) = &arguments.kind else {
        return printed(list(&catalogue, format));
    };
    let Some(kind) = catalogue.kinds.get(name) else {
        let known: Vec<_> = catalogue.kinds.keys().map(String::as_str).collect();
        bail!("no kind is called {name}; there are {}", known.join(", "));
    };
    printed(match format {
        Format::Json => say(with_origin(kind)),
        _ => say(in_words(kind).trim_end()),
    })
}

fn list(catalogue: &Catalogue, format: Format) -> Result<()> {
    if format == Format::Json {
        return catalogue.kinds.values().try_for_each(|kind| say(with_origin(kind)));
    }
    let rows: Vec<_> = catalogue
        .kinds
        .values()
        .map(|kind| {
            vec![kind.manifest.kind.clone(), kind.manifest.summary.clone(), kind.origin.to_string()]
        })
        .collect();
    say(print::table(&["KIND", "SUMMARY", "ORIGIN"], &rows).trim_end())
}

fn with_origin(kind: &Kind) -> serde_json::Value {
    let mut value = json!(kind.manifest);
    value["origin"] = kind.origin.to_string().into();
    value
}

fn in_words(kind: &Kind) -> String {
    let Manifest { kind: name, summary, inputs, outputs, parameters, .. } = &kind.manifest;
    let mut out = format!("{name} ({})\n{summary}\n", kind.origin);
    let ports = [("INPUT", inputs), ("OUTPUT", outputs)];
    for (heading, ports) in ports.into_iter().filter(|(_, ports)| !ports.is_empty()) {
        let rows: Vec<_> = ports.iter().map(port).collect();
        out += "\n";
        out += &print::table(&[heading, "TYPE", "", ""], &rows);
    }
    if !parameters.is_empty() {
        let rows: Vec<_> = parameters.iter().map(parameter).collect();
        out += "\n";
        out += &print::table(&["PARAMETER", "TYPE", "DEFAULT", "RANGE", ""], &rows);
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

fn parameter(parameter: &ParameterManifest) -> Vec<String> {
    let mut kind = format!("{:?}", parameter.kind).to_lowercase();
    if !parameter.unit.is_empty() {
        kind += &format!(" ({})", parameter.unit);
    }
    let range = match parameter.range() {
        range if range.is_empty() => parameter.choices.join("|"),
        range => range,
    };
    let default = parameter.default.clone().unwrap_or_else(|| "(required)".into());
    let doc =
        if parameter.live { format!("{} (live)", parameter.doc) } else { parameter.doc.clone() };
    vec![parameter.name.clone(), kind, default, range, doc]
}
