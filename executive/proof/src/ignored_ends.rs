//! Places in which the end of a task is waited for with some values of the variables and not with others
//! that come: the report is lost then, and the component stays active without a task.

use std::collections::BTreeSet;

use armor_petri::analysis::rules::FiringRules;
use armor_petri::{PlaceId, TransitionId};
use armor_plan::ComponentId;
use armor_robotfile::{Code, Finding, Findings};

use crate::dead::values_in_words;
use crate::proof::Proof;

/// Most states that are looked at: each is looked at for every place.
const MAX_STATES: u64 = 20_000;
/// The report about the end of a task.
const DONE: &str = "done";

impl Proof<'_> {
    pub(super) fn find_ignored_ends(&self, findings: &mut Findings) {
        let is_small = self.is_whole() && self.exploration.space.states() <= MAX_STATES;
        if self.analysed.open.is_some() || self.plan.counters().is_empty() || !is_small {
            return;
        }
        for place in self.plan.place_ids() {
            for component in &self.plan.place(place).components {
                findings.extend(self.find_ignored_end(place, *component));
            }
        }
    }

    fn find_ignored_end(&self, place: PlaceId, component: ComponentId) -> Option<Finding> {
        let net = self.plan.net();
        let takes = |id: &TransitionId| net.transition(*id).inputs.iter().any(|arc| arc.0 == place);
        let leaving: Vec<_> = net.transition_ids().filter(takes).collect();
        let report = |id: TransitionId| self.plan.transition(id).on.as_ref();
        let (ending, others): (Vec<_>, Vec<_>) = leaving.into_iter().partition(|id| {
            report(*id).is_some_and(|(of, event)| *of == component && event == DONE)
        });
        let counters: BTreeSet<_> = ending.iter().flat_map(|id| self.counters_of(*id)).collect();
        // The end of another task or another event of this one may be the one that counts.
        let is_reported = |id: &TransitionId| {
            report(*id)
                .is_some_and(|(of, event)| event == DONE || (*of == component && event != "failed"))
        };
        let is_alone = |id: &TransitionId| {
            let arcs = net.transition(*id);
            arcs.inputs.len() == 1 && arcs.reads.is_empty() && arcs.inhibitors.is_empty()
        };
        if counters.is_empty()
            || others.iter().any(is_reported)
            || !ending.iter().all(is_alone)
            || !self.keeps_values(place, &counters)
        {
            return None;
        }
        let rules = FiringRules::new(self.net);
        let is_enabled = |marking: &[u32], id: TransitionId| {
            self.copies(id).into_iter().any(|copy| rules.enabled(marking, copy))
        };
        // One that never fires is a finding of its own.
        let fires = |id: &TransitionId| {
            self.exploration.space.find(|marking| is_enabled(marking, *id)).is_some()
        };
        if !ending.iter().all(fires) {
            return None;
        }
        // What fires immediately, or only with such values, is what the mission does then.
        let decides = |id: TransitionId| {
            let must_fire = self.copies(id).into_iter().any(|copy| {
                let copy = self.net.transition(copy);
                !copy.gated && copy.interval.latest.is_some_and(|latest| latest.is_zero())
            });
            must_fire || self.counters_of(id).any(|counter| counters.contains(&counter))
        };
        let ignores = |marking: &[u32]| {
            marking[place.index()] > 0
                && !self.is_over(marking)
                && !ending.iter().any(|id| is_enabled(marking, *id))
                && !others.iter().any(|id| decides(*id) && is_enabled(marking, *id))
        };
        let seen = self.find_witness(&ignores)?;
        let values = |marking: &[u32]| -> Vec<String> {
            let all = self.analysed.values(marking).enumerate();
            let named = all.filter(|(counter, _)| counters.contains(counter));
            named
                .map(|(_, (name, value))| {
                    format!("{name} is {}", values_in_words(&BTreeSet::from([value])))
                })
                .collect()
        };
        let (name, component) =
            (self.net.place(place), &self.plan.components()[component.index()].name);
        let message = format!(
            "{}, no transition waits in {name} for the end of {component}: {}",
            self.after_firings(&seen.path),
            values(&seen.marking).join(" and ")
        );
        let waiting = &net.transition(*ending.first()?).name;
        let finding = Finding::new(Code::EndUnawaited, self.at(place), message);
        let finding = finding.related(self.at_transition(waiting), "this one waits for it before");
        Some(finding.trace(self.trace_of(&seen.path, &[])).may_follow().remedy(format!(
            "add <transition from=\"{name}\" to=\"…\" on=\"{component}.{DONE}\" when=\"…\"/> for these \
             values, or let the transition before lead to another place"
        )))
    }

    /// The variables that the guard of a transition names.
    fn counters_of(&self, id: TransitionId) -> impl Iterator<Item = usize> {
        let guard = self.plan.transition(id).guard.iter();
        guard.flat_map(|guard| &guard.operands).filter_map(|operand| operand.counter())
    }

    /// Whether the variables change only when the token of the place moves, or while it has none.
    pub(super) fn keeps_values(&self, place: PlaceId, counters: &BTreeSet<usize>) -> bool {
        let net = self.plan.net();
        let rules = FiringRules::new(self.net);
        let fires_meanwhile = |id: TransitionId| {
            let copies = self.copies(id);
            let is_one = |marking: &[u32]| {
                marking[place.index()] > 0 && copies.iter().any(|it| rules.enabled(marking, *it))
            };
            self.exploration.space.find(|marking| is_one(marking)).is_some()
        };
        net.transition_ids().all(|id| {
            let mut sets = self.plan.transition(id).sets.iter();
            let arcs = net.transition(id);
            let moves = || arcs.inputs.iter().chain(&arcs.outputs).any(|arc| arc.0 == place);
            !sets.any(|set| counters.contains(&set.counter)) || moves() || !fires_meanwhile(id)
        })
    }
}
