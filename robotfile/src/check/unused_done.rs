//! Places in which a component is done without effect: transitions wait for its failure and not for its
//! end, or for its end only under a guard, where `failed` was probably written for `done`.

use std::collections::BTreeSet;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::guard::Guard;
use crate::manifests::Manifests;
use crate::mission::{Mission, Place, Transition};
use crate::model::{Component, Configuration};

/// Returns the components that report that they are done, although no transition waits for it.
pub(super) fn find_unawaited<'a>(
    configuration: &'a Configuration,
    manifests: &Manifests,
) -> BTreeSet<&'a str> {
    let awaited: BTreeSet<&str> = configuration
        .missions()
        .flat_map(|mission| &mission.transitions)
        .filter_map(|transition| transition.on.as_ref())
        .filter(|on| on.event.value == "done")
        .map(|on| on.component.value.as_str())
        .collect();
    let is_done = |component: &&Component| {
        let kind = manifests.get(&component.kind.value);
        kind.is_some_and(|kind| kind.reports_done)
            && !awaited.contains(component.name.value.as_str())
    };
    let components = configuration.system.components.iter().filter(is_done);
    components.map(|component| component.name.value.as_str()).collect()
}

/// Checks a mission; `unawaited` as of [`find_unawaited`].
pub(super) fn check(mission: &Mission, unawaited: &BTreeSet<&str>, findings: &mut Findings) {
    // A transition whose condition is missing, which is a finding already, may be the one for it.
    if !findings.iter().any(|it| it.code == Code::ImmediateExit) {
        check_unused(mission, unawaited, findings);
        check_guarded(mission, findings);
    }
}

/// A place waits for the failure of a component and not for its end, although other places with it
/// wait for that, or none does: once it is done there, only a timeout leads on.
fn check_unused(mission: &Mission, unawaited: &BTreeSet<&str>, findings: &mut Findings) {
    let waits_for = |place: &Place, component: &str, event: &str| {
        mission.transitions.iter().any(|transition| {
            let is_from = transition.inputs().any(|arc| arc.place.value == place.name.value);
            let is_on = transition
                .on
                .as_ref()
                .is_some_and(|on| on.component.value == component && on.event.value == event);
            is_from && is_on
        })
    };
    let mut reported = BTreeSet::new();
    for transition in &mission.transitions {
        let Some(on) = transition.on.as_ref().filter(|on| on.event.value == "failed") else {
            continue;
        };
        let component = on.component.value.as_str();
        let is_active = |place: &Place| place.components.iter().any(|it| it.value == component);
        let [from] = transition.inputs().collect::<Vec<_>>()[..] else { continue };
        let Some(place) = mission.place(&from.place.value).filter(|place| is_active(place)) else {
            continue;
        };
        if leads_to_failure(mission, transition) {
            continue;
        }
        let others = mission.places.iter().filter(|it| it.name.value != place.name.value);
        let mut others = others.filter(|other| is_active(other));
        let is_missing = !waits_for(place, component, "done");
        let is_usual = unawaited.contains(component)
            || others.any(|other| waits_for(other, component, "done"));
        // Otherwise the end of another component of the place may be meant.
        let names = place.components.iter().map(|it| it.value.as_str());
        let silent: Vec<_> =
            names.filter(|it| unawaited.contains(it) && *it != component).collect();
        let mut active = place.components.iter().map(|it| it.value.as_str());
        let waits_for_none = !active.any(|name| waits_for(place, name, "done"));
        let (meant, why) = match silent[..] {
            _ if is_missing && is_usual => (component, "its done".to_owned()),
            [only] if waits_for_none => (only, format!("the done of {only}")),
            _ => continue,
        };
        let name = &place.name.value;
        // Of the transitions from one place, the first is enough.
        if !reported.insert((name.as_str(), meant.to_owned())) {
            continue;
        }
        let message = format!(
            "{} waits in {name} for a failure of {component}, but no transition waits there for {why}",
            transition.name.value
        );
        let finding = Finding::new(Code::DoneUnused, &on.event.at, message);
        findings.push(finding.remedy(format!(
            "did you mean on=\"{meant}.done\"? Otherwise add a transition for it from {name}"
        )));
    }
}

/// Where the end of a component is waited for under one guard alone, a transition with another guard
/// over the same variables that waits for its failure was probably to be the one for the other case.
fn check_guarded(mission: &Mission, findings: &mut Findings) {
    for transition in mission.transitions.iter().filter(|it| it.is_on_failure()) {
        let (Some(on), Some(when)) = (&transition.on, &transition.when) else { continue };
        let [from] = transition.inputs().collect::<Vec<_>>()[..] else { continue };
        let is_rival = |it: &&Transition| {
            let is_its = |other: &crate::mission::ReportRef| {
                other.component.value == on.component.value && other.event.value == "done"
            };
            it.on.as_ref().is_some_and(is_its)
                && it.inputs().any(|arc| arc.place.value == from.place.value)
        };
        let rivals: Vec<_> = mission.transitions.iter().filter(is_rival).collect();
        let [rival] = rivals[..] else { continue };
        let Some(other) = &rival.when else { continue };
        if other.value == when.value || !shares_names(&when.value, &other.value) {
            continue;
        }
        let component = &on.component.value;
        let message = format!(
            "{} waits in {} for a failure of {component} where `{}`; its done is waited for only where \
             `{}`",
            transition.name.value, from.place.value, when.value, other.value
        );
        let finding = Finding::new(Code::DoneUnused, &on.event.at, message);
        findings.push(
            finding
                .remedy(format!(
                    "did you mean on=\"{component}.done\"? Otherwise add a transition for its done \
                     under this guard"
                ))
                .related(&rival.name.at, "this one waits for its done"),
        );
    }
}

/// Returns whether two guards name the same values.
fn shares_names(one: &str, other: &str) -> bool {
    let names = |text: &str| {
        let guard = Guard::parse(text).ok();
        let names = guard.iter().flat_map(|guard| guard.names()).map(|it| it.as_str().to_owned());
        names.collect::<BTreeSet<_>>()
    };
    let names_of_one = names(one);
    !names_of_one.is_empty() && names_of_one == names(other)
}

/// Whether the transition leads to the safe place, as one for a failure usually does.
fn leads_to_failure(mission: &Mission, transition: &Transition) -> bool {
    let safe = mission.safe.as_ref().map(|safe| safe.value.as_str());
    transition.outputs().any(|arc| Some(arc.place.value.as_str()) == safe)
}
