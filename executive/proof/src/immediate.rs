//! Transitions whose report was forgotten: their guards, over variables alone, do not change while their
//! place is marked, so they fire immediately or never, although the place waits for the end of a task.

use std::collections::BTreeSet;

use armor_petri::analysis::rules::FiringRules;
use armor_petri::{PlaceId, TransitionId};
use armor_robotfile::mission::Autonomy;
use armor_robotfile::{Code, Finding, Findings};

use crate::proof::Proof;

/// Most states that are looked at: each is looked at for every such transition.
const MAX_STATES: u64 = 20_000;

impl Proof<'_> {
    /// Finds those of which other transitions set the variables, but never while the place is marked. Where
    /// only those set them that move its token, the check of the file has found it.
    pub(super) fn find_immediate(&self, findings: &mut Findings) {
        let is_small = self.is_whole() && self.exploration.space.states() <= MAX_STATES;
        if self.analysed.open.is_none() && !self.plan.counters().is_empty() && is_small {
            let ids = self.plan.net().transition_ids();
            findings.extend(ids.filter_map(|id| self.find_immediate_exit(id)));
        }
    }

    fn find_immediate_exit(&self, id: TransitionId) -> Option<Finding> {
        let (net, planned) = (self.plan.net(), self.plan.transition(id));
        let arcs = net.transition(id);
        let guard = planned.guard.as_ref().filter(|_| planned.on.is_none())?;
        let counters: Option<BTreeSet<_>> = guard.operands.iter().map(|it| it.counter()).collect();
        let counters = counters.filter(|counters| !counters.is_empty())?;
        let [(place, 1)] = arcs.inputs[..] else { return None };
        let is_plain = planned.autonomy == Autonomy::Auto
            && planned.dates.is_none()
            && arcs.interval.earliest.is_zero()
            && arcs.reads.is_empty()
            && arcs.inhibitors.is_empty();
        if !is_plain || !self.is_set_elsewhere(place, &counters) {
            return None;
        }
        let active = &self.plan.place(place).components;
        let waits = |other: &TransitionId| {
            let on = self.plan.transition(*other).on.as_ref();
            let takes = net.transition(*other).inputs.iter().any(|arc| arc.0 == place);
            takes && on.is_some_and(|(of, event)| active.contains(of) && event == "done")
        };
        let other = net.transition_ids().find(waits)?;
        let (rules, copies) = (FiringRules::new(self.net), self.copies(id));
        let fires = |marking: &[u32]| copies.iter().any(|copy| rules.enabled(marking, *copy));
        if !self.keeps_values(place, &counters) || self.exploration.space.find(fires).is_none() {
            return None;
        }
        let (name, other) = (&arcs.name, &net.transition(other).name);
        let written = self.mission.transitions.iter().find(|it| it.name.value == *name)?;
        let (when, place) = (&written.when.as_ref()?.value, net.place(place));
        let message = format!(
            "{name} waits for nothing: where `{when}` is true, it fires as soon as {place} is marked, \
             before {other} can"
        );
        let finding = Finding::new(Code::ImmediateExit, self.at_transition(name), message);
        Some(finding.related(self.at_transition(other), "this one waits").may_follow().remedy(format!(
            "write on=\"…\" for the report that it waits for, or decide in a place before {place}, \
             without components"
        )))
    }

    /// Whether a transition without an arc to the place sets one of the variables, and none that returns
    /// its token there does.
    fn is_set_elsewhere(&self, place: PlaceId, counters: &BTreeSet<usize>) -> bool {
        let net = self.plan.net();
        let sets = |id: &TransitionId| {
            let mut sets = self.plan.transition(*id).sets.iter();
            sets.any(|set| counters.contains(&set.counter))
        };
        let has_arcs = |id: TransitionId| {
            let arcs = net.transition(id);
            [&arcs.inputs, &arcs.outputs].map(|arcs| arcs.iter().any(|arc| arc.0 == place))
        };
        let setters: Vec<_> = net.transition_ids().filter(sets).map(has_arcs).collect();
        setters.contains(&[false, false]) && !setters.contains(&[true, true])
    }
}
