//! The transitions of a mission: places that exist, and reports that can be sent where the transition
//! starts from.

use std::collections::BTreeSet;

use super::MissionNames;
use crate::check::names::listed;
use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::mission::{ArcKind, Transition};
use crate::source::Spanned;

impl MissionNames<'_> {
    /// Returns whether the transition waits for a component that one of its places does not activate,
    /// though it sets parameters of it, or may activate under a misspelt name, or that lost all its
    /// components. That is a finding of the place.
    pub(super) fn waits_for_foreign(&self, transition: &Transition) -> bool {
        let Some(on) = &transition.on else { return false };
        let mut needed = transition.arcs.iter().filter(|arc| arc.kind != ArcKind::Put);
        needed.any(|arc| {
            let (place, component) = (arc.place.value.as_str(), on.component.value.as_str());
            self.doubtful.contains(place)
                || self.assigned.contains(&(place, component))
                || self.lost.contains(place)
        })
    }

    /// A place for components that do not stop, where none could stop.
    fn check_stop(&self, transition: &Transition, findings: &mut Findings) {
        let Some(target) = &transition.on_stop_fail else { return };
        let mut left =
            transition.arcs.iter().filter(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Reset));
        let is_passive = |place: &str| {
            self.places.known.contains_key(place)
                && !self.doubtful.contains(place)
                && !self.active_in.values().any(|places| places.contains(place))
        };
        if !transition.is_doubtful && left.all(|arc| is_passive(&arc.place.value)) {
            let message = "on-stop-fail has no effect here";
            let finding = Finding::new(Code::NoEffect, &target.at, message);
            findings.push(finding.remedy(
                "the transition leaves no place whose components would have to stop: remove it",
            ));
        }
    }

    /// Reports a transition that waits for a component that is frozen where it starts.
    fn report_frozen(
        &self,
        transition: &Transition,
        reporter: &Spanned<String>,
        findings: &mut Findings,
    ) {
        let (name, component) = (&transition.name.value, &reporter.value);
        let message = format!("{component} is frozen in every place that {name} starts from");
        let finding = Finding::new(Code::ReportNeverSent, &reporter.at, message).stops_transition();
        let [takes, puts] = [ArcKind::Take, ArcKind::Put].map(|kind| {
            let arcs = transition.arcs.iter().filter(|arc| arc.kind == kind);
            arcs.map(|arc| arc.place.value.as_str()).collect::<Vec<_>>()
        });
        let mut exchanged = String::new();
        if let ([from], [to]) = (takes.as_slice(), puts.as_slice())
            && self.is_active_in(component, to)
            && let Some(place) = self.places.known.get(from)
        {
            exchanged = format!("did you mean from=\"{to}\" to=\"{from}\"?");
            let event = transition.on.as_ref().map_or("", |on| on.event.value.as_str());
            let is_awaited = self.awaited.contains(&(*to, component, event));
            if !self.entered.contains(from) {
                let finding = finding.related(place, "no transition leads to this place");
                findings.push(finding.remedy(exchanged));
                return;
            }
            // Where another transition waits for the same report, this one does not belong there.
            exchanged = if is_awaited { String::new() } else { exchanged + " Otherwise, " };
        }
        let needed = transition.arcs.iter().filter(|arc| arc.kind != ArcKind::Put);
        let is_there = |places: &BTreeSet<&str>| {
            needed.clone().any(|arc| places.contains(arc.place.value.as_str()))
        };
        let active = self.active_in.iter().filter(|(_, places)| is_there(places));
        // One that few places activate is more probably the one whose report the mission waits for.
        let mut active: Vec<_> = active.collect();
        active.sort_by_key(|(_, places)| places.len());
        let active: Vec<_> = active.into_iter().map(|(component, _)| *component).collect();
        let places = self.active_in.get(component.as_str());
        if let Some(places) = places.filter(|_| exchanged.is_empty() && !active.is_empty()) {
            findings.push(finding.remedy(format!(
                "name a component of the place: {}; or one of the places that activate {component}: {}",
                listed(active.into_iter()),
                listed(places.iter().copied())
            )));
            return;
        }
        let remedy = "a frozen component reports nothing; activate it there";
        findings.push(finding.remedy(match active.is_empty() {
            true => format!("{exchanged}{remedy}"),
            false => format!(
                "{exchanged}{remedy}, or name a component of the place: {}",
                listed(active.into_iter())
            ),
        }));
    }

    pub(super) fn check_transition(&self, transition: &Transition, findings: &mut Findings) {
        let name = &transition.name;
        // What could not be read of it may be its places.
        if transition.arcs.is_empty() && !transition.is_doubtful {
            let message =
                format!("{} takes tokens from no place and puts them into none", name.value);
            let finding = Finding::new(Code::NoArcs, &name.at, message);
            findings.push(finding.remedy("write from=\"…\" and to=\"…\""));
        }
        let targets = [&transition.on_stop_fail, &transition.on_start_fail, &transition.overrun];
        let arcs = transition.arcs.iter().map(|arc| &arc.place);
        arcs.chain(targets.into_iter().flatten())
            .for_each(|place| self.expect_place(place, findings));
        self.check_stop(transition, findings);
        let Some(on) = &transition.on else { return };
        let reporter = &on.component;
        if !self.expect_component(reporter, findings) {
            return;
        }
        let mut needed = transition.arcs.iter().filter(|arc| arc.kind != ArcKind::Put);
        let heard = needed.any(|arc| self.is_active_in(&reporter.value, &arc.place.value));
        let takes =
            transition.arcs.iter().any(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Read));
        let is_frozen = self.controlled.contains(reporter.value.as_str()) && !heard;
        // A missing or unknown place is a finding of its own.
        let are_known = transition
            .arcs
            .iter()
            .all(|arc| self.places.known.contains_key(arc.place.value.as_str()));
        if is_frozen
            && takes
            && are_known
            && !transition.is_doubtful
            && !self.waits_for_foreign(transition)
        {
            self.report_frozen(transition, reporter, findings);
        }
    }
}
