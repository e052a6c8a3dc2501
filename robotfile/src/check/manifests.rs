//! The system against the manifests of its kinds: existence and parameters; the links are
//! in `ports.rs`, `fed_inputs.rs` and `meant_inputs.rs`.

use std::collections::BTreeMap;

use armor_wire::manifest::{Manifest, ParameterManifest, ParameterType, RESERVED_EVENTS};
use armor_wire::name::is_name;
use armor_wire::text_format::TextFormat;

use crate::check::fed_inputs::FedInputs;
use crate::check::names::{listed, report_unknown};
use crate::check::uses::{ComponentUses, Use, has};
use crate::check::{fed_inputs, frames, kinds, meant_inputs, needed_frames, ports};
use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::mission::PlaceParameter;
use crate::model::{Component, Configuration, Parameter, System};
use crate::source::Location;
use crate::suggestion::{suggest_choice, suggest_similar};
use crate::typed_manifests::TypedManifests;

pub(super) fn check(configuration: &Configuration, manifests: &Manifests, findings: &mut Findings) {
    let system = &configuration.system;
    let typed = TypedManifests::of(system, manifests);
    let mut kinds: BTreeMap<&str, &Manifest> = typed.iter().collect();
    let uses = ComponentUses::collect(configuration);
    for component in &system.components {
        // That it is malformed is a finding already.
        if manifests.contains_key(&component.kind.value) || !is_name(&component.kind.value) {
            continue;
        }
        let known = manifests.keys().map(String::as_str);
        let before = findings.total();
        report_unknown(Code::UnknownKind, &component.kind, "kind of component", known, findings);
        if findings.total() > before {
            kinds::advise_by_uses(component, &uses, manifests, findings);
        }
    }
    // What a component of another kind has is not known, as that of an unknown kind.
    kinds::check(configuration, manifests, &mut kinds, findings);
    for link in &system.links {
        ports::check_link(link, &kinds, &typed, system, findings);
    }
    meant_inputs::explain_fed_twice(system, &kinds, findings);
    if let Some(clock) = &system.clock {
        ports::check_clock(&clock.source, &kinds, findings);
    }
    let fed = FedInputs::of(system, &kinds);
    for component in &system.components {
        if let Some(manifest) = kinds.get(component.name.value.as_str()) {
            let is_whole = !system.unreadable.is_half_read(&component.name.value);
            check_parameters(component, manifest, is_whole, findings);
            check_sources(component, manifest, configuration, &fed, findings);
            fed_inputs::check_required(component, manifest, &fed, findings);
        }
    }
    meant_inputs::explain_unfed(system, &kinds, findings);
    needed_frames::check(configuration, &kinds, findings);
    let places = configuration.missions().flat_map(|mission| &mission.places);
    for place in places {
        // The parameter of a component that is not active there is a finding already.
        let is_active = |given: &&PlaceParameter| {
            place.components.iter().any(|component| component.value == given.component.value)
        };
        // Of two values of one name, which is a finding already, one has probably a wrong name.
        let is_single = |given: &&PlaceParameter| {
            let is_same = |other: &&PlaceParameter| {
                other.component.value == given.component.value
                    && other.parameter.name.value == given.parameter.name.value
            };
            place.parameters.iter().filter(is_same).count() == 1
        };
        for given in place.parameters.iter().filter(is_active).filter(is_single) {
            if let Some(manifest) = kinds.get(given.component.value.as_str()) {
                check_value(&given.parameter, manifest, findings);
            }
        }
    }
    explain_foreign_parameters(system, &kinds, findings);
    kinds::advise_complete_kind(system, &uses, manifests, findings);
}

/// Attributes that a `<component>` does not have, and that are parameters of its kind.
pub(super) fn explain_attributes(system: &System, manifests: &Manifests, findings: &mut Findings) {
    let is_unknown = |finding: &&mut Finding| finding.code == Code::UnknownAttribute;
    for finding in findings.iter_mut().filter(is_unknown) {
        let Some(at) = &finding.at else { continue };
        let line = |other: &Location| {
            (other.source.path() == at.source.path()).then(|| other.line_column().0)
        };
        // The element of the component is the one whose name is nearest.
        let near = system.components.iter().filter_map(|component| {
            let there = line(&component.name.at)?;
            Some((there.abs_diff(at.line_column().0), component))
        });
        let Some((_, component)) = near.min_by_key(|(lines, _)| *lines) else { continue };
        let name = at.text();
        let is_parameter = |kind: &&Manifest| has(kind, (Use::Parameter, name));
        if !finding.message.starts_with("<component>")
            || manifests.get(&component.kind.value).filter(is_parameter).is_none()
        {
            continue;
        }
        finding.remedy = format!(
            "{name} is a parameter of {}: write <parameter name=\"{name}\" value=\"…\"/> between \
             <component> and </component>",
            component.name.value
        );
    }
}

/// Names the other components that have a parameter which is unknown where it is given.
fn explain_foreign_parameters(
    system: &System,
    kinds: &BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    for finding in findings.iter_mut().filter(|it| it.code == Code::UnknownParameter) {
        let is_guessed = finding.remedy.starts_with("did you mean");
        let Some(name) = finding.at.as_ref().map(|at| at.text().to_owned()) else { continue };
        let has_it = |component: &&Component| {
            let kind = kinds.get(component.name.value.as_str());
            kind.is_some_and(|kind| has(kind, (Use::Parameter, &name)))
        };
        let is_free = |component: &&Component| component.parameter(&name).is_none();
        let all: Vec<_> = system.components.iter().filter(has_it).collect();
        let free: Vec<_> = all.iter().copied().filter(is_free).collect();
        let others = if free.is_empty() { &all } else { &free };
        let names: Vec<_> = others.iter().map(|it| it.name.value.as_str()).collect();
        // A similar name is a better guess than a component that has its value already.
        if names.is_empty() || names.len() > MAX_OTHERS || (is_guessed && free.is_empty()) {
            continue;
        }
        let (verb, names) = (if names.len() > 1 { "have" } else { "has" }, names.join(" or "));
        finding.remedy = match free.is_empty() {
            false => format!("was it meant for {names}? Otherwise {}", finding.remedy),
            true => format!(
                "was it meant for {names}, which {verb} a value for it already? Otherwise {}",
                finding.remedy
            ),
        };
    }
}

/// Most components that are named as those for which a parameter may be meant.
const MAX_OTHERS: usize = 3;

/// A component that needs one of several inputs or parameters has none.
fn check_sources(
    component: &Component,
    manifest: &Manifest,
    configuration: &Configuration,
    fed: &FedInputs<'_>,
    findings: &mut Findings,
) {
    let name = component.name.value.as_str();
    let system = &configuration.system;
    let places = configuration.missions().flat_map(|mission| &mission.places);
    let in_places: Vec<_> = places
        .flat_map(|place| &place.parameters)
        .filter(|given| given.component.value == name)
        .map(|given| &given.parameter)
        .collect();
    let is_given = |id: &str| {
        let mut given = component.parameters.iter().chain(in_places.iter().copied());
        let mut links = system.links.iter();
        system.unreadable.may_feed(name, id)
            || given.any(|it| it.name.value == id && !it.value.value.is_empty())
            || links.any(|it| {
                // A component that does not exist may be this one, under its former name.
                let to = it.to.component.value.as_str();
                (to == name || system.component(to).is_none()) && it.to.port.value == id
            })
    };
    for group in &manifest.needs_one_of {
        // A link that ends at no input of the component, which is a finding already, may be meant.
        if group.is_empty() || fed.has_mistaken(name) || group.iter().any(|id| is_given(id)) {
            continue;
        }
        let is_input = |id: &&String| manifest.inputs.iter().any(|input| input.id == **id);
        let (inputs, parameters): (Vec<_>, Vec<_>) = group.iter().partition(is_input);
        let links = inputs.iter().map(|id| format!("a link to {name}.{id}"));
        let parameters = parameters.iter().map(|id| format!("the parameter {id}"));
        let ways: Vec<_> = links.chain(parameters).collect();
        let message = format!("{name} has none of what a {} needs one of", manifest.kind);
        let finding = Finding::new(Code::InputUnfed, &component.name.at, message);
        findings.push(finding.remedy(format!("add {}", ways.join(", or "))));
    }
}

fn check_parameters(
    component: &Component,
    manifest: &Manifest,
    is_whole: bool,
    findings: &mut Findings,
) {
    let mut times: BTreeMap<&str, usize> = BTreeMap::new();
    for parameter in &component.parameters {
        *times.entry(&parameter.name.value).or_default() += 1;
    }
    // Of two values of one name, which is a finding already, one has probably a wrong name.
    let is_single = |parameter: &&Parameter| times[parameter.name.value.as_str()] == 1;
    let exchanged = find_exchanged(component, manifest);
    if let Some((one, other)) = exchanged {
        findings.push(report_exchanged(one, other));
    }
    let is_exchanged = |it: &&Parameter| {
        exchanged.is_some_and(|(one, other)| {
            it.name.at.is_at(&one.name.at) || it.name.at.is_at(&other.name.at)
        })
    };
    for parameter in component.parameters.iter().filter(is_single) {
        if !is_exchanged(&parameter) {
            check_value(parameter, manifest, findings);
        }
    }
    let meant = find_meant(component, manifest);
    if let Some((given, wanted)) = meant {
        let is_it = |it: &&mut Finding| {
            it.code == Code::UnknownParameter
                && it.at.as_ref().is_some_and(|at| at.is_at(&given.name.at))
        };
        for finding in findings.iter_mut().filter(is_it) {
            finding.remedy =
                format!("did you mean {}? It is needed, and has no value", wanted.name);
        }
    }
    let name = &component.name;
    for wanted in manifest.parameters.iter().filter(|wanted| is_whole && wanted.default.is_none()) {
        let is_meant = meant.is_some_and(|(_, it)| it.name == wanted.name);
        if component.parameter(&wanted.name).is_none()
            && !is_meant
            && !is_misspelt(wanted, component, manifest)
        {
            let message = format!("{} has no value for {}", name.value, wanted.name);
            let finding = Finding::new(Code::ParameterUnassigned, &name.at, message);
            let about =
                if wanted.doc.is_empty() { String::new() } else { format!(" ({})", wanted.doc) };
            let remedy = format!("add <parameter name=\"{}\" value=\"…\"/>{about}", wanted.name);
            findings.push(finding.remedy(remedy));
        }
    }
}

/// Returns the only parameter of an unknown name, and the only one that is needed and not given: the
/// one is probably meant for the other.
fn find_meant<'a>(
    component: &'a Component,
    manifest: &'a Manifest,
) -> Option<(&'a Parameter, &'a ParameterManifest)> {
    let of_name = |name: &str| manifest.parameters.iter().find(|it| it.name == name);
    let mut unknown = component.parameters.iter().filter(|it| of_name(&it.name.value).is_none());
    let needed = manifest.parameters.iter().filter(|it| it.default.is_none());
    let mut missing = needed.filter(|it| component.parameter(&it.name).is_none());
    let (given, wanted) = (unknown.next()?, missing.next()?);
    let is_only = unknown.next().is_none() && missing.next().is_none();
    (is_only && wanted.parse(&given.value.value).is_ok()).then_some((given, wanted))
}

/// Returns two parameters each of which has a value that only the other one takes.
fn find_exchanged<'a>(
    component: &'a Component,
    manifest: &Manifest,
) -> Option<(&'a Parameter, &'a Parameter)> {
    let takes = |parameter: &Parameter, value: &str| {
        let wanted = manifest.parameters.iter().find(|it| it.name == parameter.name.value);
        wanted.map(|wanted| wanted.parse(value).is_ok())
    };
    let is_wrong = |it: &&Parameter| takes(it, &it.value.value) == Some(false);
    let mut wrong = component.parameters.iter().filter(is_wrong);
    let (one, other) = (wrong.next()?, wrong.next()?);
    let fit = [takes(one, &other.value.value), takes(other, &one.value.value)];
    (wrong.next().is_none() && fit == [Some(true); 2]).then_some((one, other))
}

fn report_exchanged(one: &Parameter, other: &Parameter) -> Finding {
    let (first, second) = (&one.name.value, &other.name.value);
    let message = format!("the values of {first} and {second} are exchanged");
    let remedy = format!(
        "write value=\"{}\" for {first} and value=\"{}\" for {second}",
        short(&other.value.value),
        short(&one.value.value)
    );
    let finding = Finding::new(Code::ParameterType, &one.value.at, message).remedy(remedy);
    finding.related(&other.value.at, "the other value")
}

/// Returns whether the parameter is given with a misspelt name: that is an error already.
fn is_misspelt(wanted: &ParameterManifest, component: &Component, manifest: &Manifest) -> bool {
    let given = component.parameters.iter().map(|parameter| parameter.name.value.as_str());
    let mut unknown = given.filter(|name| !manifest.parameters.iter().any(|p| p.name == *name));
    unknown.any(|name| suggest_similar(name, std::iter::once(wanted.name.as_str())).is_some())
}

fn check_value(parameter: &Parameter, manifest: &Manifest, findings: &mut Findings) {
    let Some(wanted) =
        manifest.parameters.iter().find(|wanted| wanted.name == parameter.name.value)
    else {
        let noun = format!("parameter of {}", manifest.kind);
        let known = manifest.parameters.iter().map(|wanted| wanted.name.as_str());
        return report_unknown(Code::UnknownParameter, &parameter.name, &noun, known, findings);
    };
    if frames::is_filled(wanted) {
        let name = &parameter.name.value;
        let message = format!("{name}: its value is the <frame>s of the file");
        let finding = Finding::new(Code::ParameterType, &parameter.value.at, message);
        let remedy =
            "remove the parameter, and write <frame name=\"…\" in=\"…\" x=\"…\"/> in the system";
        return findings.push(finding.remedy(remedy));
    }
    let Err(problem) = wanted.parse(&parameter.value.value) else {
        return check_event_names(parameter, manifest, findings);
    };
    let code = if without_bounds(wanted).parse(&parameter.value.value).is_ok() {
        Code::ParameterRange
    } else {
        Code::ParameterType
    };
    let message = format!("{}: {problem}", parameter.name.value);
    let mut remedy = describe_expected(wanted);
    if !wanted.doc.is_empty() {
        remedy = format!("{}; {remedy}", wanted.doc);
    }
    let words: Vec<_> = match wanted.kind {
        ParameterType::Choice => wanted.choices.iter().map(String::as_str).collect(),
        ParameterType::Flag => vec!["true", "false"],
        _ => Vec::new(),
    };
    if let Some(guess) = suggest_choice(&parameter.value.value, words.iter().copied()) {
        remedy = format!("{guess} {remedy}");
    }
    findings.push(Finding::new(code, &parameter.value.at, message).remedy(remedy));
}

/// Finds the words of a text that names events which are names of other events.
fn check_event_names(parameter: &Parameter, manifest: &Manifest, findings: &mut Findings) {
    let events = manifest.events.as_deref().unwrap_or_default();
    if !events.iter().any(|event| event.named_by == parameter.name.value) {
        return;
    }
    let own = events.iter().filter(|event| event.named_by.is_empty());
    let own = own.map(|event| event.name.as_str());
    let taken: Vec<_> = own.chain(RESERVED_EVENTS).collect();
    let mut words = parameter.value.value.split_whitespace();
    if let Some(word) = words.find(|word| taken.contains(word)) {
        let name = &parameter.name.value;
        let message = format!("{name}: {} is the name of another event", short(word));
        let remedy =
            format!("choose another name; these are taken: {}", listed(taken.iter().copied()));
        let finding = Finding::new(Code::ParameterType, &parameter.value.at, message);
        findings.push(finding.remedy(remedy));
    }
}

/// The parameter without its range and choices.
fn without_bounds(parameter: &ParameterManifest) -> ParameterManifest {
    let kind = match parameter.kind {
        ParameterType::Choice => ParameterType::Text,
        kind => kind,
    };
    ParameterManifest { minimum: None, maximum: None, kind, ..parameter.clone() }
}

fn describe_expected(parameter: &ParameterManifest) -> String {
    let mut text = match parameter.kind {
        ParameterType::Number if parameter.unit.is_empty() => "a number".to_owned(),
        ParameterType::Number => format!("a number in {}", parameter.unit),
        ParameterType::Integer => "a whole number".to_owned(),
        ParameterType::Text => {
            parameter.format.map_or("a text", TextFormat::describe_value).to_owned()
        }
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
