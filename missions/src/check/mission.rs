//! What a mission must hold: names once, places and components that exist, a start, and
//! exclusions that the places themselves keep.

use std::collections::BTreeMap;

use crate::check::{Names, reach};
use crate::code::Code;
use crate::finding::{Finding, Findings};
use crate::mission::{Mission, Place, Transition};
use crate::model::System;
use crate::source::Spanned;

pub(super) fn check(mission: &Mission, system: &System, findings: &mut Findings) {
    let places = mission.places.iter().map(|place| &place.name);
    let places = Names::collect("a place", Code::DuplicatePlace, places, findings);
    let transitions = mission.transitions.iter().map(|transition| &transition.name);
    Names::collect("a transition", Code::DuplicateTransition, transitions, findings);
    let variables = mission.variables.iter().map(|variable| &variable.name);
    Names::collect("a variable", Code::DuplicateVariable, variables, findings);
    // Duplicates among the components are the system's findings.
    let components = system.components.iter().map(|component| &component.name);
    let components = Names::collect(
        "a component",
        Code::DuplicateComponent,
        components,
        &mut Findings::default(),
    );

    for place in [&mission.goal, &mission.safe].into_iter().flatten() {
        places.expect(place, Code::UnknownPlace, findings);
    }
    for place in &mission.places {
        check_place(place, &places, &components, system, findings);
    }
    for transition in &mission.transitions {
        check_transition(transition, mission, &places, &components, findings);
    }
    for exclusive in &mission.exclusives {
        if exclusive.components.len() < 2 {
            let message = "an exclusive set of one component excludes nothing";
            let finding = Finding::new(Code::ExclusiveAlone, &exclusive.at, message);
            findings.push(finding.remedy("name at least two components"));
        }
        expect_controllable(&exclusive.components, &components, system, findings);
    }
    start_and_end(mission, findings);
    exclusives_kept(mission, findings);
    reach::check(mission, findings);
}

fn check_place(
    place: &Place,
    places: &Names<'_>,
    components: &Names<'_>,
    system: &System,
    findings: &mut Findings,
) {
    expect_controllable(&place.components, components, system, findings);
    if let Some(target) = &place.on_failure {
        places.expect(target, Code::UnknownPlace, findings);
    }
    let mut assigned = BTreeMap::new();
    for given in &place.parameters {
        let known = components.expect(&given.component, Code::UnknownComponent, findings);
        if known && !place.activates(&given.component.value) {
            let message =
                format!("{} does not activate {}", place.name.value, given.component.value);
            let finding = Finding::new(Code::ForeignParameter, &given.component.at, message);
            let remedy =
                "name the component in the place's components, or set the parameter in the system";
            findings.push(finding.remedy(remedy));
        }
        let name = &given.parameter.name;
        let key = (given.component.value.as_str(), name.value.as_str());
        if let Some(first) = assigned.insert(key, &name.at) {
            let message = format!("{}.{} is set twice in one place", key.0, key.1);
            let finding = Finding::new(Code::DuplicateParameter, &name.at, message);
            findings.push(finding.remedy("keep one of them").related(first, "first here"));
        }
    }
}

fn expect_controllable(
    names: &[Spanned<String>],
    components: &Names<'_>,
    system: &System,
    findings: &mut Findings,
) {
    for name in names {
        let known = components.expect(name, Code::UnknownComponent, findings);
        let fixed =
            known && system.component(&name.value).is_some_and(|component| !component.controllable);
        if fixed {
            let message = format!("{} has controllable=\"false\"", name.value);
            let finding = Finding::new(Code::NotControllable, &name.at, message);
            findings.push(finding.remedy("take it out of here, or let the mission control it"));
        }
    }
}

fn check_transition(
    transition: &Transition,
    mission: &Mission,
    places: &Names<'_>,
    components: &Names<'_>,
    findings: &mut Findings,
) {
    if transition.arcs.is_empty() {
        let message = format!("{} joins no places", transition.name.value);
        let finding = Finding::new(Code::NoArcs, &transition.name.at, message);
        findings.push(finding.remedy("write from=\"…\" and to=\"…\""));
    }
    let targets = [&transition.on_stop_fail, &transition.on_start_fail, &transition.overrun];
    let targets = targets.into_iter().flatten();
    for place in transition.arcs.iter().map(|arc| &arc.place).chain(targets) {
        places.expect(place, Code::UnknownPlace, findings);
    }
    let Some(on) = &transition.on else { return };
    let reporter = &on.component;
    if !components.expect(reporter, Code::UnknownComponent, findings) {
        return;
    }
    // A component in no place is always active and may report at any time.
    let heard =
        |name: &str| mission.place(name).is_some_and(|place| place.activates(&reporter.value));
    if mission.controls(&reporter.value)
        && !transition.arcs.iter().any(|arc| heard(&arc.place.value))
    {
        let message = format!(
            "{} is active in no place that {} starts from",
            reporter.value, transition.name.value
        );
        let finding = Finding::new(Code::ReportNeverSent, &reporter.at, message);
        findings.push(finding.remedy("a frozen component reports nothing; activate it there"));
    }
}

fn start_and_end(mission: &Mission, findings: &mut Findings) {
    if !mission.places.iter().any(|place| place.initial > 0) {
        let finding =
            Finding::new(Code::NoInitialPlace, &mission.at, "no place is marked at the start");
        findings.push(finding.remedy("write initial=\"true\" on the place to start in"));
    }
    if mission.safe.is_none() {
        let message = "the mission has no safe place to go to when something fails";
        let finding = Finding::new(Code::NoSafePlace, &mission.at, message);
        findings.push(finding.remedy("name one: <mission safe=\"hold\">"));
    }
}

/// Exclusive components neither in one place nor in two places of the start.
fn exclusives_kept(mission: &Mission, findings: &mut Findings) {
    let mut sets: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (set, exclusive) in mission.exclusives.iter().enumerate() {
        for component in &exclusive.components {
            sets.entry(&component.value).or_default().push(set);
        }
    }
    let mut at_start = BTreeMap::new();
    for place in &mission.places {
        let mut here = BTreeMap::new();
        for component in &place.components {
            for set in sets.get(component.value.as_str()).into_iter().flatten() {
                let other = here.insert(*set, component);
                let other = other.or_else(|| {
                    if place.initial > 0 { at_start.insert(*set, component) } else { None }
                });
                if let Some(other) = other.filter(|other| other.value != component.value) {
                    together(component, other, mission, *set, findings);
                }
            }
        }
    }
}

fn together(
    component: &Spanned<String>,
    other: &Spanned<String>,
    mission: &Mission,
    set: usize,
    findings: &mut Findings,
) {
    let message = format!("{} would be active together with {}", component.value, other.value);
    let finding = Finding::new(Code::ExclusiveTogether, &component.at, message);
    findings.push(
        finding
            .remedy("activate them in different places, or do not declare them exclusive")
            .related(&other.at, "with this one")
            .related(&mission.exclusives[set].at, "declared exclusive here"),
    );
}
