//! Links, and the clock, against the ports of the kinds that they join: the ports exist, the
//! direction is right, the types match.

use std::collections::BTreeMap;

use armor_wire::clock::Clock;
use armor_wire::manifest::{Manifest, PortManifest};
use armor_wire::schema::difference;
use armor_wire::{Message, WireType};

use crate::check::any_type;
use crate::check::names::{listed, report_unknown};
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Link, Port, System};
use crate::typed_manifests::TypedManifests;

pub(super) fn check_link(
    link: &Link,
    kinds: &BTreeMap<&str, &Manifest>,
    typed: &TypedManifests<'_>,
    system: &System,
    findings: &mut Findings,
) {
    if is_exchanged(link, kinds) {
        let (from, to) = (link.from.data(), link.to.data());
        let message = format!("this link leads from an input, {from}, to an output, {to}");
        let finding = Finding::new(Code::WrongDirection, &link.from.at, message);
        findings.push(
            finding
                .remedy(format!("swap them: from=\"{to}\" to=\"{from}\""))
                .related(&link.to.at, "the output"),
        );
        return;
    }
    let output = find_output(&link.from, kinds, findings);
    let input = find_input(&link.to, kinds, findings);
    if let (Some(output), None) = (output, input) {
        advise_input(link, output, kinds, system, findings);
    }
    let (Some(output), Some(input)) = (output, input) else { return };
    if is_same_type(output, input) {
        return;
    }
    if let Some(first) = typed.first_link(&link.to) {
        findings.extend(any_type::report_writer((link, first), output, input, kinds, system));
    } else if !any_type::follows_from_writers(link, input, kinds, typed, system) {
        let meant = kinds.get(link.to.component.value.as_str()).and_then(|kind| {
            kind.inputs.iter().find(|other| other.required && is_same_type(output, other))
        });
        let finding = report_mismatch(link, output, input, meant);
        findings.push(any_type::explain_origin(finding, link, typed, system));
    }
}

/// Names the only input of the component that takes the data and is not fed, in the place of an
/// output at which the link ends.
fn advise_input(
    link: &Link,
    output: &PortManifest,
    kinds: &BTreeMap<&str, &Manifest>,
    system: &System,
    findings: &mut Findings,
) {
    let component = &link.to.component.value;
    let is_fed = |input: &PortManifest| {
        let mut links = system.links.iter();
        links.any(|it| it.to.component.value == *component && it.to.port.value == input.id)
    };
    let inputs = kinds.get(component.as_str()).into_iter().flat_map(|kind| &kind.inputs);
    let mut fits = inputs.filter(|it| is_same_type(output, it) && !it.is_any() && !is_fed(it));
    let (Some(meant), None) = (fits.next(), fits.next()) else { return };
    let is_it = |it: &&mut Finding| {
        let is_there = it.at.as_ref().is_some_and(|at| at.is_at(&link.to.at));
        it.code == Code::WrongDirection && is_there
    };
    for finding in findings.iter_mut().filter(is_it) {
        finding.remedy =
            format!("did you mean to=\"{component}.{}\"? Otherwise {}", meant.id, finding.remedy);
    }
}

/// Whether an output may feed an input. A type that is not known is no mismatch.
pub(super) fn is_same_type(output: &PortManifest, input: &PortManifest) -> bool {
    output.is_any()
        || input.is_any()
        || (&output.type_name, output.schema_hash) == (&input.type_name, input.schema_hash)
}

/// Returns whether the link starts at an input and ends at an output.
fn is_exchanged(link: &Link, kinds: &BTreeMap<&str, &Manifest>) -> bool {
    let is_among =
        |ports: &[PortManifest], port: &Port| ports.iter().any(|p| p.id == port.port.value);
    let kind = |port: &Port| kinds.get(port.component.value.as_str());
    let (Some(from), Some(to)) = (kind(&link.from), kind(&link.to)) else { return false };
    let only_input = is_among(&from.inputs, &link.from) && !is_among(&from.outputs, &link.from);
    let only_output = is_among(&to.outputs, &link.to) && !is_among(&to.inputs, &link.to);
    only_input && only_output
}

fn report_mismatch(
    link: &Link,
    output: &PortManifest,
    input: &PortManifest,
    meant: Option<&PortManifest>,
) -> Finding {
    let (from, to) = (link.from.data(), link.to.data());
    let (message, remedy) = if output.type_name == input.type_name {
        // Two versions of one type: the reader needs to see the fields that differ.
        let differ = difference((&from, &output.schema), (&to, &input.schema));
        (
            format!(
                "{from} cannot feed {to}: both use the name {} for different messages",
                output.type_name
            ),
            format!(
                "build both components with the same message; {}",
                differ.lines().collect::<Vec<_>>().join("; ")
            ),
        )
    } else {
        (
            format!(
                "{from} cannot feed {to}: it publishes {}, and {to} takes {}",
                output.type_name, input.type_name
            ),
            match meant {
                Some(meant) => format!(
                    "{}.{} takes {}; or link an output of {} here",
                    link.to.component.value,
                    meant.id,
                    output.type_name,
                    describe_type(input)
                ),
                None => format!(
                    "link an output of {} here; `armor describe` lists them",
                    describe_type(input)
                ),
            },
        )
    };
    let finding = Finding::new(Code::TypeMismatch, &link.to.at, message);
    finding.remedy(remedy).related(&link.from.at, "from here")
}

/// `type Scan`, or `any type`.
pub(super) fn describe_type(input: &PortManifest) -> String {
    match input.is_any() {
        true => "any type".to_owned(),
        false => format!("type {}", input.type_name),
    }
}

/// The source of the system's time: an output of type `Clock`.
pub(super) fn check_clock(
    source: &Port,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let Some(output) = find_output(source, kinds, findings) else { return };
    let (data, name, schema) = (source.data(), &output.type_name, Clock::schema().to_string());
    let is_clock = |it: &&PortManifest| it.type_name == Clock::NAME && it.schema == schema;
    if is_clock(&output) {
        return;
    }
    let message = if name == Clock::NAME {
        let differ = difference((&data, &output.schema), ("a clock", &schema));
        format!("{data} cannot be the clock: {}", differ.lines().collect::<Vec<_>>().join("; "))
    } else {
        format!(
            "{data} cannot be the clock: it publishes {name}, and a clock publishes {}",
            Clock::NAME
        )
    };
    let finding = Finding::new(Code::TypeMismatch, &source.at, message);
    let clocks = kinds.iter().flat_map(|(component, manifest)| {
        let clocks = manifest.outputs.iter().filter(is_clock);
        clocks.map(move |output| format!("{component}.{}", output.id))
    });
    let clocks: Vec<_> = clocks.collect();
    let remedy = match clocks.as_slice() {
        [] => "no component here publishes a clock; without <clock> the time is the host's".into(),
        clocks => format!("these publish a clock: {}", listed(clocks.iter().map(String::as_str))),
    };
    findings.push(finding.remedy(remedy));
}

fn find_output<'a>(
    port: &Port,
    kinds: &BTreeMap<&str, &'a Manifest>,
    findings: &mut Findings,
) -> Option<&'a PortManifest> {
    let manifest = kinds.get(port.component.value.as_str())?;
    let found = manifest.outputs.iter().find(|output| output.id == port.port.value);
    if found.is_none() {
        missing_port(
            port,
            manifest,
            &manifest.inputs,
            &manifest.outputs,
            ["output", "input"],
            findings,
        );
    }
    found
}

fn find_input<'a>(
    port: &Port,
    kinds: &BTreeMap<&str, &'a Manifest>,
    findings: &mut Findings,
) -> Option<&'a PortManifest> {
    let manifest = kinds.get(port.component.value.as_str())?;
    let found = manifest.inputs.iter().find(|input| input.id == port.port.value);
    if found.is_none() {
        missing_port(
            port,
            manifest,
            &manifest.outputs,
            &manifest.inputs,
            ["input", "output"],
            findings,
        );
    }
    found
}

fn missing_port(
    port: &Port,
    manifest: &Manifest,
    others: &[PortManifest],
    wanted: &[PortManifest],
    [noun, other_noun]: [&str; 2],
    findings: &mut Findings,
) {
    if others.iter().any(|other| other.id == port.port.value) {
        let message = format!("{} is an {other_noun}", port.data());
        let finding = Finding::new(Code::WrongDirection, &port.at, message);
        findings.push(finding.remedy("a link goes from=\"an output\" to=\"an input\""));
    } else {
        let noun = format!("{noun} of {}", manifest.kind);
        report_unknown(
            Code::UnknownPort,
            &port.port,
            &noun,
            wanted.iter().map(|port| port.id.as_str()),
            findings,
        );
    }
}

pub(super) fn find_port<'a>(
    port: &Port,
    kinds: &BTreeMap<&str, &'a Manifest>,
    is_output: bool,
) -> Option<&'a PortManifest> {
    let manifest = kinds.get(port.component.value.as_str())?;
    let ports = if is_output { &manifest.outputs } else { &manifest.inputs };
    ports.iter().find(|known| known.id == port.port.value)
}
