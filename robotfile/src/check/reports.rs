//! The reports that transitions wait for, against the events that the components' kinds declare.

use std::collections::{BTreeMap, BTreeSet};

use armor_wire::manifest::{Manifest, RESERVED_EVENTS};

use crate::check::graph::CheckGraph;
use crate::check::names::listed;
use crate::code::Code;
use crate::finding::{Finding, short};
use crate::findings::Findings;
use crate::manifests::Manifests;
use crate::mission::ReportRef;
use crate::model::{Component, Configuration};
use crate::source::Spanned;
use crate::suggestion::suggest_similar;

pub(super) fn check(
    configuration: &Configuration,
    manifests: Option<&Manifests>,
    findings: &mut Findings,
) {
    let components = configuration.system.components.iter();
    let components: BTreeMap<&str, &Component> =
        components.map(|component| (component.name.value.as_str(), component)).collect();
    let transitions = configuration.missions().flat_map(|mission| &mission.transitions);
    let mut unknown = BTreeSet::new();
    for on in transitions.filter_map(|transition| transition.on.as_ref()) {
        // An unknown component is a finding already.
        let Some(component) = components.get(on.component.value.as_str()) else { continue };
        let manifest = manifests.and_then(|manifests| manifests.get(&component.kind.value));
        let reports = manifest.map_or(&RESERVED_EVENTS[..], Manifest::common_reports);
        if reports.contains(&on.event.value.as_str()) {
            continue;
        }
        // The reports of an unknown kind, which is a finding already, are not known.
        if manifests.is_some() && manifest.is_none() {
            continue;
        }
        match manifest {
            Some(manifest) if manifest.events.is_some() || is_never_done(manifest, on) => {
                check_declared(on, component, manifest, configuration, findings);
            }
            manifest => {
                let is_misspelt = report_misspelt(&on.event, findings);
                let is_new = unknown.insert((&on.component.value, &on.event.value));
                if manifest.is_some() && !is_misspelt && is_new {
                    report_undeclared_event(on, component, findings);
                }
            }
        }
    }
}

/// Reports transitions that wait for the `done` of a component which the mission does not activate,
/// although it could: it is always active, and has perhaps finished long before. One that is meant to
/// be so has `controllable="false"`.
pub(super) fn check_always_active(configuration: &Configuration, findings: &mut Findings) {
    let places = || configuration.missions().flat_map(|mission| &mission.places);
    let activated: BTreeSet<&str> =
        places().flat_map(|place| &place.components).map(|name| name.value.as_str()).collect();
    for transition in configuration.missions().flat_map(|mission| &mission.transitions) {
        let Some(on) = transition.on.as_ref().filter(|on| on.event.value == "done") else {
            continue;
        };
        let name = on.component.value.as_str();
        let is_controllable =
            configuration.system.component(name).is_some_and(|component| component.controllable);
        if activated.contains(name) || !is_controllable {
            continue;
        }
        let is_later = |place: &str| places().any(|it| it.name.value == place && it.initial == 0);
        let mut from = transition.inputs().map(|arc| &arc.place.value);
        let (place, message) =
            match (from.find(|place| is_later(place)), transition.inputs().next()) {
                (Some(place), _) => {
                    let why = format!("that it was done before {place} was marked counts, too");
                    (place, format!("{name} is in no place, so it is always active: {why}"))
                }
                (None, Some(first)) => {
                    let Some(frozen) = find_frozen_means(name, &activated, configuration) else {
                        continue;
                    };
                    let why = format!(
                        "where {frozen}, through which its data come back to it, is frozen"
                    );
                    let place = &first.place.value;
                    (place, format!("{name} is in no place, so it is always active, also {why}"))
                }
                (None, None) => continue,
            };
        let finding = Finding::new(Code::DoneAtAnyTime, &on.component.at, message);
        findings.push(finding.remedy(format!(
            "activate it in {place}; or write controllable=\"false\" on the component, if it works \
             all the time"
        )));
    }
}

/// Returns a component without which the data of `name` never come back to it, and that is frozen in some
/// place where the mission continues.
fn find_frozen_means<'a>(
    name: &'a str,
    activated: &BTreeSet<&'a str>,
    configuration: &'a Configuration,
) -> Option<&'a str> {
    let system = &configuration.system;
    let names = system.components.iter().map(|component| component.name.value.as_str());
    let links = system
        .links
        .iter()
        .map(|link| (link.from.component.value.as_str(), link.to.component.value.as_str(), ()));
    let is_frozen = |component: &str| {
        configuration.missions().any(|mission| {
            let ends = [&mission.goal, &mission.safe].map(|end| end.as_ref().map(|it| &it.value));
            mission.places.iter().any(|place| {
                !ends.contains(&Some(&place.name.value)) && !place.activates(component)
            })
        })
    };
    let is_means = |component: &str| activated.contains(component) && is_frozen(component);
    // The circle with the fewest of them: if it has one, every circle has.
    let cost = |component: &str| if is_means(component) { system.components.len() + 1 } else { 1 };
    let circle = CheckGraph::new(names, links).cheapest_circle(name, cost)?;
    circle.into_iter().find(|component| is_means(component))
}

fn is_never_done(manifest: &Manifest, on: &ReportRef) -> bool {
    on.event.value == "done" && !manifest.reports_done
}

/// A component that declares events reports no others.
fn check_declared(
    on: &ReportRef,
    component: &Component,
    manifest: &Manifest,
    configuration: &Configuration,
    findings: &mut Findings,
) {
    let name = on.event.value.as_str();
    let assigned = |parameter: &str| {
        let value = component.parameter(parameter);
        value.map(|parameter| parameter.value.value.as_str())
    };
    let mut known = manifest.event_names(assigned);
    // A place may assign another value for the duration of an activation.
    let places = configuration.missions().flat_map(|mission| &mission.places);
    for given in places.flat_map(|place| &place.parameters) {
        let names = |parameter: &str| {
            (parameter == given.parameter.name.value)
                .then_some(given.parameter.value.value.as_str())
        };
        if given.component.value == on.component.value {
            known.extend(manifest.event_names(names));
        }
    }
    if known.contains(name) {
        return;
    }
    let mut events = manifest.events.iter().flatten();
    let naming = events.find(|it| !it.named_by.is_empty()).map(|it| it.named_by.as_str());
    if naming.is_some_and(|naming| is_unreadable(naming, component, manifest)) {
        return;
    }
    let message = match is_never_done(manifest, on) {
        true => format!("{} never reports that it is done", on.component.value),
        false => format!("{} reports no event called {}", on.component.value, short(name)),
    };
    let known: Vec<_> =
        known.into_iter().chain(manifest.common_reports().iter().copied()).collect();
    let known = || known.iter().copied();
    let guess = if findings.is_full() { None } else { suggest_similar(name, known()) };
    let remedy = guess.unwrap_or_else(|| format!("it reports: {}", listed(known())));
    let mut finding = Finding::new(Code::UnknownEvent, &on.event.at, message);
    let remedy = match naming.and_then(|it| Some((it, component.parameter(it)?))) {
        Some((naming, given)) => {
            finding = finding.related(&given.value.at, "these names are given here");
            let stop = if remedy.ends_with('?') { "" } else { ";" };
            let otherwise = if stop.is_empty() { "Otherwise" } else { "otherwise" };
            let of = &on.component.value;
            format!("{remedy}{stop} {otherwise} add {} to {naming} of {of}", short(name))
        }
        None => match naming {
            Some(naming) => format!(
                "add <parameter name=\"{naming}\" value=\"{}\"/> to {}; {remedy}",
                short(name),
                on.component.value
            ),
            None => remedy,
        },
    };
    findings.push(finding.remedy(remedy));
}

/// Returns whether the parameter that names events has a value that is a finding of its own, or is
/// given under a misspelt name.
fn is_unreadable(naming: &str, component: &Component, manifest: &Manifest) -> bool {
    let of_name = |name: &str| manifest.parameters.iter().find(|it| it.name == name);
    let is_malformed = |value: &str| of_name(naming).is_some_and(|it| it.parse(value).is_err());
    let is_misspelt = |given: &str| {
        of_name(given).is_none() && suggest_similar(given, std::iter::once(naming)).is_some()
    };
    match component.parameter(naming) {
        Some(given) => is_malformed(&given.value.value),
        None => component.parameters.iter().any(|given| is_misspelt(&given.name.value)),
    }
}

/// A name that differs from `done` or `failed` by one or two letters is probably a mistake. Returns
/// whether it does.
fn report_misspelt(event: &Spanned<String>, findings: &mut Findings) -> bool {
    let name = event.value.to_ascii_lowercase();
    let Some(guess) = suggest_similar(&name, RESERVED_EVENTS.into_iter()) else { return false };
    let message = format!(
        "the report {} is probably misspelt: the usual ones are done and failed",
        event.value
    );
    findings.push(Finding::new(Code::ReportMisspelt, &event.at, message).remedy(guess));
    true
}

fn report_undeclared_event(on: &ReportRef, component: &Component, findings: &mut Findings) {
    let message = format!(
        "the manifest of the kind {} lists no events, so it is not known whether {} reports {}",
        short(&component.kind.value),
        on.component.value,
        short(&on.event.value)
    );
    let finding = Finding::new(Code::EventsUndeclared, &on.event.at, message);
    findings.push(finding.remedy(
        "build it with this SDK; or list its events in its manifest, \"events\": [] if it has none; or \
         ignore this note",
    ));
}
