//! Components whose kind is probably another one: what the file uses of them is that of another kind.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, PortManifest};

use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::model::{Component, Configuration, System};

/// Checks the kinds of all components, and removes from `kinds` those that are probably wrong.
pub(super) fn check(
    configuration: &Configuration,
    manifests: &Manifests,
    kinds: &mut BTreeMap<&str, &Manifest>,
    findings: &mut Findings,
) {
    let system = &configuration.system;
    for [one, other] in find_exchanged_kinds(system, kinds) {
        findings.push(report_exchanged_kinds(one, other));
        for component in [one, other] {
            kinds.remove(component.name.value.as_str());
            drop_reports_of(&component.name.value, configuration, findings);
        }
    }
    for component in &system.components {
        let name = component.name.value.as_str();
        let Some(manifest) = kinds.get(name) else { continue };
        if report_other_kind(component, manifest, system, manifests, findings) {
            kinds.remove(name);
            drop_reports_of(name, configuration, findings);
        }
    }
}

/// Drops findings about reports of a component whose kind is wrong: they are those of another kind.
fn drop_reports_of(name: &str, configuration: &Configuration, findings: &mut Findings) {
    let transitions = configuration.missions().flat_map(|mission| &mission.transitions);
    let awaited = transitions.filter_map(|transition| transition.on.as_ref());
    let awaited: Vec<_> = awaited.filter(|on| on.component.value == name).collect();
    findings.retain(|finding| {
        let is_it =
            |at| awaited.iter().any(|on| on.event.at.is_at(at) || on.component.at.is_at(at));
        finding.code != Code::UnknownEvent || !finding.at.as_ref().is_some_and(is_it)
    });
}

/// Finds the pairs of components of which one has parameters or links that its kind does not know,
/// and the kind of the other knows all of them, and the same holds in reverse.
fn find_exchanged_kinds<'a>(
    system: &'a System,
    kinds: &BTreeMap<&str, &Manifest>,
) -> Vec<[&'a Component; 2]> {
    let used: Vec<_> = system
        .components
        .iter()
        .filter_map(|component| {
            let kind = *kinds.get(component.name.value.as_str())?;
            Some((component, kind, uses_of(component, system)))
        })
        .collect();
    let mut pairs = Vec::new();
    for (one, kind, uses) in used.iter().filter(|(_, kind, uses)| !knows_all(kind, uses)) {
        // A link in the wrong direction is another mistake.
        if uses.iter().filter(|it| !has(kind, **it)).all(|it| has(kind, reverse(*it))) {
            continue;
        }
        let is_partner = |(other, of_other, by_other): &&(&Component, &Manifest, BTreeSet<_>)| {
            other.name.value != one.name.value
                && of_other.kind != kind.kind
                && is_wrong(of_other, by_other)
                && knows_all(of_other, uses)
                && knows_all(kind, by_other)
        };
        let mut partners = used.iter().filter(is_partner);
        let (Some((other, ..)), None) = (partners.next(), partners.next()) else { continue };
        let is_known =
            |pair: &[&Component; 2]| pair.iter().any(|it| it.name.value == one.name.value);
        if !pairs.iter().any(is_known) {
            pairs.push([*one, *other]);
        }
    }
    pairs
}

/// Returns whether the kind has all that is used of it.
fn knows_all(kind: &Manifest, uses: &BTreeSet<(Use, &str)>) -> bool {
    uses.iter().all(|it| has(kind, *it))
}

/// Returns whether the kind lacks what is used of it, or needs an input that no link feeds.
fn is_wrong(kind: &Manifest, uses: &BTreeSet<(Use, &str)>) -> bool {
    let is_fed = |id: &str| uses.iter().any(|it| *it == (Use::Input, id));
    let needs_input = |it: &PortManifest| it.required && !is_fed(&it.id);
    !knows_all(kind, uses) || kind.inputs.iter().any(needs_input)
}

fn report_exchanged_kinds(one: &Component, other: &Component) -> Finding {
    let message = format!(
        "the kinds of {} and {} seem to be exchanged: each has what the other uses",
        one.name.value, other.name.value
    );
    Finding::new(Code::UnknownPort, &one.kind.at, message)
        .remedy(format!(
            "write kind=\"{}\" here and kind=\"{}\" for {}",
            other.kind.value, one.kind.value, other.name.value
        ))
        .related(&other.kind.at, "exchanged with this one")
}

/// The same port at the other end of a link.
fn reverse((is, name): (Use, &str)) -> (Use, &str) {
    let is = match is {
        Use::Input => Use::Output,
        Use::Output => Use::Input,
        Use::Parameter => Use::Parameter,
    };
    (is, name)
}

/// Returns the parameters and ports that the system uses of a component.
fn uses_of<'a>(component: &'a Component, system: &'a System) -> BTreeSet<(Use, &'a str)> {
    let name = &component.name.value;
    let outputs = system.links.iter().map(|link| (Use::Output, &link.from));
    let inputs = system.links.iter().map(|link| (Use::Input, &link.to));
    let ports = outputs.chain(inputs).filter(|(_, port)| port.component.value == *name);
    let given = component.parameters.iter();
    given
        .map(|given| (Use::Parameter, given.name.value.as_str()))
        .chain(ports.map(|(is, port)| (is, port.port.value.as_str())))
        .collect()
}

/// Reports a component of whose parameters and ports the kind knows two or more not, while exactly
/// one other kind knows all.
fn report_other_kind(
    component: &Component,
    manifest: &Manifest,
    system: &System,
    manifests: &Manifests,
    findings: &mut Findings,
) -> bool {
    let name = &component.name.value;
    let uses = uses_of(component, system);
    let unknown: Vec<_> = uses.iter().filter(|it| !has(manifest, **it)).collect();
    if unknown.len() < 2 {
        return false;
    }
    let is_other = |kind: &&Manifest| uses.iter().all(|it| has(kind, *it));
    let mut others = manifests.values().filter(is_other);
    let (Some(other), None) = (others.next(), others.next()) else { return false };
    let is_parameter = unknown.iter().any(|(is, _)| *is == Use::Parameter);
    let (code, noun) = match is_parameter {
        true if unknown.iter().any(|(is, _)| *is != Use::Parameter) => {
            (Code::UnknownParameter, "parameters and ports")
        }
        true => (Code::UnknownParameter, "parameters"),
        false => (Code::UnknownPort, "ports"),
    };
    let names = listed(unknown.iter().map(|(_, name)| *name));
    let message = format!(
        "a {} has no {noun} called {names}; a {} has all that {name} uses",
        component.kind.value, other.kind
    );
    let finding = Finding::new(code, &component.kind.at, message);
    findings.push(finding.remedy(format!("did you mean kind=\"{}\"?", other.kind)));
    true
}

/// What the file uses of a component.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Use {
    Parameter,
    Input,
    Output,
}

/// Returns whether the kind has this parameter or port.
pub(super) fn has(kind: &Manifest, (is, name): (Use, &str)) -> bool {
    match is {
        Use::Parameter => kind.parameters.iter().any(|it| it.name == name),
        Use::Input => kind.inputs.iter().any(|it| it.id == name),
        Use::Output => kind.outputs.iter().any(|it| it.id == name),
    }
}
