//! The system against the manifests of its kinds: ports, types and parameters.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, ParameterManifest, ParameterType, PortManifest};
use armor_wire::schema::difference;

use crate::check::unused::Used;
use crate::check::{Manifests, listed};
use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::model::{Component, Configuration, Link, Parameter, Port};
use crate::nearest::did_you_mean;
use crate::source::Spanned;

pub(super) fn check(configuration: &Configuration, manifests: &Manifests, findings: &mut Findings) {
    let system = &configuration.system;
    let mut kinds: BTreeMap<&str, &Manifest> = BTreeMap::new();
    for component in &system.components {
        match manifests.get(&component.kind.value) {
            Some(manifest) => {
                kinds.insert(&component.name.value, manifest);
            }
            None => unknown(
                Code::UnknownKind,
                &component.kind,
                "kind of component",
                manifests.keys().map(String::as_str),
                findings,
            ),
        }
    }
    for link in &system.links {
        check_link(link, &kinds, findings);
    }
    if let Some(clock) = &system.clock {
        find_output(&clock.source, &kinds, findings);
    }
    let ends = system.links.iter().map(|link| &link.to);
    let fed = ends.map(|to| (to.component.value.as_str(), to.port.value.as_str())).collect();
    for component in &system.components {
        if let Some(manifest) = kinds.get(component.name.value.as_str()) {
            check_parameters(component, manifest, findings);
            required_inputs(component, manifest, &fed, findings);
        }
    }
    let places = configuration.missions().flat_map(|mission| &mission.places);
    for given in places.flat_map(|place| &place.parameters) {
        if let Some(manifest) = kinds.get(given.component.value.as_str()) {
            check_value(&given.parameter, manifest, findings);
        }
    }
    // With a mistake in a name, what it meant only seems to be unused.
    if !findings.has_errors() {
        let used = Used::of(configuration);
        for component in &system.components {
            if let Some(manifest) = kinds.get(component.name.value.as_str()) {
                used.check(component, manifest, findings);
            }
        }
    }
}

fn unknown<'a>(
    code: Code,
    name: &Spanned<String>,
    noun: &str,
    known: impl Iterator<Item = &'a str> + Clone,
    findings: &mut Findings,
) {
    let message = format!("there is no {noun} called {}", name.value);
    let guess = if findings.is_full() { None } else { did_you_mean(&name.value, known.clone()) };
    let remedy = guess.unwrap_or_else(|| format!("there are: {}", listed(known)));
    findings.push(Finding::new(code, &name.at, message).remedy(remedy));
}

fn check_link(link: &Link, kinds: &BTreeMap<&str, &Manifest>, findings: &mut Findings) {
    let output = find_output(&link.from, kinds, findings);
    let input = find_input(&link.to, kinds, findings);
    let (Some(output), Some(input)) = (output, input) else { return };
    if (&output.type_name, output.schema_hash) != (&input.type_name, input.schema_hash) {
        findings.push(mismatch(link, output, input));
    }
}

fn mismatch(link: &Link, output: &PortManifest, input: &PortManifest) -> Finding {
    let (from, to) = (link.from.data(), link.to.data());
    let (message, remedy) = if output.type_name == input.type_name {
        // Two builds of one type: its fields are what the reader has to look at.
        let differ = difference((&from, &output.schema), (&to, &input.schema));
        (
            format!(
                "{from} cannot feed {to}: both call it {}, but it is not the same",
                output.type_name
            ),
            format!(
                "build both components against the same message; {}",
                differ.lines().collect::<Vec<_>>().join("; ")
            ),
        )
    } else {
        (
            format!(
                "{from} cannot feed {to}: it gives {}, and {to} takes {}",
                output.type_name, input.type_name
            ),
            format!("link an output of type {} here; `armor describe` lists them", input.type_name),
        )
    };
    let finding = Finding::new(Code::TypeMismatch, &link.to.at, message);
    finding.remedy(remedy).related(&link.from.at, "from here")
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
        unknown(
            Code::UnknownPort,
            &port.port,
            &noun,
            wanted.iter().map(|port| port.id.as_str()),
            findings,
        );
    }
}

fn required_inputs(
    component: &Component,
    manifest: &Manifest,
    fed: &BTreeSet<(&str, &str)>,
    findings: &mut Findings,
) {
    let name = &component.name;
    let fed = |input: &PortManifest| fed.contains(&(name.value.as_str(), input.id.as_str()));
    for input in manifest.inputs.iter().filter(|input| input.required && !fed(input)) {
        let message =
            format!("nothing feeds {}.{}, which {} needs", name.value, input.id, manifest.kind);
        let finding = Finding::new(Code::InputUnfed, &name.at, message);
        let remedy = format!(
            "add <link from=\"…\" to=\"{}.{}\"/> with a {}",
            name.value, input.id, input.type_name
        );
        findings.push(finding.remedy(remedy));
    }
}

fn check_parameters(component: &Component, manifest: &Manifest, findings: &mut Findings) {
    for parameter in &component.parameters {
        check_value(parameter, manifest, findings);
    }
    let name = &component.name;
    for wanted in manifest.parameters.iter().filter(|parameter| parameter.default.is_none()) {
        if component.parameter(&wanted.name).is_none() {
            let message = format!("{} has no value for {}", name.value, wanted.name);
            let finding = Finding::new(Code::ParameterUnassigned, &name.at, message);
            let about =
                if wanted.doc.is_empty() { String::new() } else { format!(" ({})", wanted.doc) };
            let remedy = format!("add <parameter name=\"{}\" value=\"…\"/>{about}", wanted.name);
            findings.push(finding.remedy(remedy));
        }
    }
}

fn check_value(parameter: &Parameter, manifest: &Manifest, findings: &mut Findings) {
    let Some(wanted) =
        manifest.parameters.iter().find(|wanted| wanted.name == parameter.name.value)
    else {
        let noun = format!("parameter of {}", manifest.kind);
        let known = manifest.parameters.iter().map(|wanted| wanted.name.as_str());
        return unknown(Code::UnknownParameter, &parameter.name, &noun, known, findings);
    };
    let Err(problem) = wanted.parse(&parameter.value.value) else { return };
    let code = if unbounded(wanted).parse(&parameter.value.value).is_ok() {
        Code::ParameterRange
    } else {
        Code::ParameterType
    };
    let message = format!("{}: {problem}", parameter.name.value);
    let remedy = if wanted.doc.is_empty() {
        expected(wanted)
    } else {
        format!("{}; {}", wanted.doc, expected(wanted))
    };
    findings.push(Finding::new(code, &parameter.value.at, message).remedy(remedy));
}

/// The parameter without its range and choices.
fn unbounded(parameter: &ParameterManifest) -> ParameterManifest {
    let kind = match parameter.kind {
        ParameterType::Choice => ParameterType::Text,
        kind => kind,
    };
    ParameterManifest { minimum: None, maximum: None, kind, ..parameter.clone() }
}

fn expected(parameter: &ParameterManifest) -> String {
    let mut text = match parameter.kind {
        ParameterType::Number if parameter.unit.is_empty() => "a number".to_owned(),
        ParameterType::Number => format!("a number in {}", parameter.unit),
        ParameterType::Integer => "a whole number".to_owned(),
        ParameterType::Text => "a text".to_owned(),
        ParameterType::Choice => format!("one of {}", parameter.choices.join(", ")),
        ParameterType::Path => "a path".to_owned(),
        ParameterType::Flag => "true or false".to_owned(),
        ParameterType::Colour => "a colour such as #ff8000".to_owned(),
    };
    let range = parameter.range();
    if !range.is_empty() {
        text += &format!(", {range},");
    }
    text += " is expected";
    if let Some(default) = parameter.default.as_deref().filter(|default| !default.is_empty()) {
        text += &format!("; its default is {default}");
    }
    text
}
