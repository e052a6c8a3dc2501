//! The places of a mission: what they activate, and of which components they set parameters.

use std::collections::{BTreeMap, BTreeSet};

use super::{MissionNames, report_fixed};
use crate::check::names::joined;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{Place, Transition};
use crate::source::Spanned;

impl MissionNames<'_> {
    pub(super) fn check_place(
        &self,
        place: &Place,
        transitions: &[Transition],
        findings: &mut Findings,
    ) {
        self.expect_controllable(&place.components, findings);
        place.on_failure.iter().for_each(|target| self.expect_place(target, findings));
        // Parameters for components that it does not activate are a finding with the same remedy.
        // So is a transition that waits there for a component that is active elsewhere.
        let waits = |it: &&Transition| {
            let component = it.on.as_ref().map(|on| on.component.value.as_str());
            component.is_some_and(|component| self.controlled.contains(component))
                && it.inputs().any(|arc| arc.place.value == place.name.value)
        };
        let is_passive = place.components.is_empty()
            && place.parameters.is_empty()
            && !transitions.iter().any(|it| waits(&it));
        if let Some(target) = place.on_failure.as_ref().filter(|_| is_passive) {
            let message = "on-failure has no effect here";
            let finding = Finding::new(Code::NoEffect, &target.at, message);
            findings.push(finding.remedy(
                "the place has no components that could fail: name them in components=\"…\", or \
                 remove it",
            ));
        }
        let is_own = |target: &&Spanned<String>| target.value == place.name.value;
        if let Some(target) = place.on_failure.as_ref().filter(is_own)
            && !place.components.is_empty()
        {
            let message = format!("after a failure in {0}, the token stays in {0}", target.value);
            let finding = Finding::new(Code::FailsToItself, &target.at, message);
            findings.push(finding.remedy(
                "name a place without the failed component, or remove on-failure: then the mission goes to its safe place",
            ));
        }
        let mut assigned = BTreeMap::new();
        let mut foreign: BTreeSet<&str> = BTreeSet::new();
        for given in &place.parameters {
            let (component, name) = (&given.component, &given.parameter.name);
            let exists = self.expect_component(component, findings);
            let is_active = self.is_active_in(&component.value, &place.name.value);
            if let Some(by) = self.fixed.get(component.value.as_str()).filter(|_| !is_active) {
                report_fixed(component, *by, "set the parameter in the system", findings);
            } else if exists
                && !is_active
                && !self.doubtful.contains(place.name.value.as_str())
                // All that an empty place lost is one mistake.
                && foreign.insert(if place.components.is_empty() { "" } else { &component.value })
            {
                self.report_foreign(place, component, transitions, findings);
            }
            let key = (component.value.as_str(), name.value.as_str());
            if let Some(first) = assigned.insert(key, &name.at) {
                let message = format!("{}.{} is set twice in one place", key.0, key.1);
                let finding = Finding::new(Code::DuplicateParameter, &name.at, message);
                findings.push(finding.remedy("keep one of them").related(first, "first here"));
            }
        }
    }

    /// Reports parameters of a component that the place does not activate, with what else it seems to
    /// have been forgotten for. A place that activates nothing has lost all its components: those of
    /// its parameters, and those whose reports transitions wait for there.
    fn report_foreign(
        &self,
        place: &Place,
        component: &Spanned<String>,
        transitions: &[Transition],
        findings: &mut Findings,
    ) {
        let is_empty = place.components.is_empty();
        let message = format!(
            "{} does not activate {}, so it cannot set its parameters",
            place.name.value, component.value
        );
        let mut finding = Finding::new(Code::ForeignParameter, &component.at, message);
        let mut lost = vec![component.value.as_str()];
        for other in place.parameters.iter().map(|given| &given.component) {
            if other.at.span == component.at.span || !(is_empty || other.value == component.value) {
                continue;
            }
            finding = finding.related(&other.at, "and here");
            lost.push(&other.value);
        }
        for transition in transitions.iter().filter(|it| self.waits_for_foreign(it)) {
            let Some(on) = &transition.on else { continue };
            let name = on.component.value.as_str();
            let waits_here = is_empty
                && self.controlled.contains(name)
                && transition.inputs().any(|arc| arc.place.value == place.name.value);
            if waits_here || name == component.value {
                finding = finding.related(&on.component.at, "this report is never sent");
                lost.push(name);
            }
        }
        let mut seen = BTreeSet::new();
        lost.retain(|name| seen.insert(*name));
        findings.push(finding.remedy(format!(
            "add {} to the components of {}, or set the parameter in the system",
            joined(lost.into_iter()),
            place.name.value
        )));
    }
}
