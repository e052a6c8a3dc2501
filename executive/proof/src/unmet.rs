//! Variables that are set and never change, and conditions over variables that no value meets which they
//! have: the guard as a whole can be true, so that the transition fires all the same.

use std::collections::BTreeSet;
use std::ops::Range;

use armor_petri::TransitionId;
use armor_robotfile::guard::{Guard, Scalar};
use armor_robotfile::{Code, Finding, Findings, within};

use crate::dead::values_in_words;
use crate::proof::Proof;

/// Most states that are looked at: each is looked at for every guard.
const MAX_STATES: u64 = 20_000;
/// Most guards that are looked at.
const MAX_GUARDS: usize = 32;

impl Proof<'_> {
    pub(super) fn find_unmet(&self, findings: &mut Findings) {
        let space = &self.exploration.space;
        let is_small = self.is_whole() && space.states() <= MAX_STATES;
        if self.analysed.open.is_some() || self.plan.counters().is_empty() || !is_small {
            return;
        }
        let mut seen = vec![BTreeSet::new(); self.plan.counters().len()];
        space.find(|marking| {
            for (seen, (_, value)) in seen.iter_mut().zip(self.analysed.values(marking)) {
                seen.insert(value);
            }
            false
        });
        let changes = |counter: &usize| seen[*counter].len() > 1;
        for (counter, values) in seen.iter().enumerate().filter(|(counter, _)| !changes(counter)) {
            findings
                .extend(values.first().and_then(|value| self.report_unchanged(counter, *value)));
        }
        let guarded = self.plan.net().transition_ids().filter(|id| {
            let guard = self.plan.transition(*id).guard.as_ref();
            let counters = guard.into_iter().flat_map(|guard| &guard.operands);
            counters.filter_map(|operand| operand.counter()).any(|counter| changes(&counter))
        });
        for id in guarded.take(MAX_GUARDS) {
            findings.extend(self.find_unmet_alternative(id, &changes));
        }
    }

    /// Transitions set the variable, always to the value that it has.
    fn report_unchanged(&self, counter: usize, value: i64) -> Option<Finding> {
        let net = self.plan.net();
        let mut setting = net.transition_ids().filter(|id| {
            let mut sets = self.plan.transition(*id).sets.iter();
            let fires = !self.copies(*id).is_empty();
            fires && sets.any(|set| set.counter == counter)
        });
        let name = &self.plan.counters()[counter].name;
        let transition = &net.transition(setting.next()?).name;
        let written = self.mission.transitions.iter().find(|it| it.name.value == *transition)?;
        let set = written.sets.iter().find(|set| set.variable.value == *name)?;
        let message = format!(
            "{name} never changes: {transition} sets it to `{}`, which is {value}, and it is {value} \
             from the start",
            set.value.value
        );
        let finding = Finding::new(Code::SetUnchanged, &set.value.at, message).may_follow();
        Some(finding.remedy(format!(
            "write the value that it is to have then, such as `{name} + 1`; or remove the variable"
        )))
    }

    /// The first condition of an `or` that is false whenever the places of the transition are marked.
    fn find_unmet_alternative(
        &self,
        id: TransitionId,
        changes: &dyn Fn(&usize) -> bool,
    ) -> Option<Finding> {
        let planned = self.plan.transition(id).guard.as_ref()?;
        let arcs = self.plan.net().transition(id);
        let needed = || arcs.inputs.iter().chain(&arcs.reads);
        let open: Vec<_> = planned.operands.iter().map(|it| it.counter().is_none()).collect();
        let all = planned.guard.alternatives();
        let mut alternatives = all.clone();
        let mut seen = vec![BTreeSet::new(); self.plan.counters().len()];
        let mut is_marked = false;
        self.exploration.space.find(|marking| {
            if !needed().all(|(place, count)| marking[place.index()] >= *count) {
                return false;
            }
            is_marked = true;
            let counters: Vec<_> = self.analysed.values(marking).map(|(_, value)| value).collect();
            for (seen, value) in seen.iter_mut().zip(&counters) {
                seen.insert(*value);
            }
            let values = planned.operands.iter().map(|operand| {
                operand.counter().map(|counter| Scalar::Number(counters[counter] as f64))
            });
            let values: Vec<_> = values.collect();
            alternatives.retain(|(_, it)| it.holds_whatever(&values, &open) == Some(false));
            alternatives.is_empty()
        });
        // `n == 2 or n == 3` covers more than it needs to.
        let is_covered = |(at, unmet): &(Range<usize>, Guard)| {
            let met = all.iter().filter(|it| !alternatives.iter().any(|unmet| unmet.0 == it.0));
            let names = (0..planned.operands.len()).filter(|name| unmet.contains(*name));
            let mut others = met.filter(|other| other.0 != *at);
            let names: Vec<_> = names.filter(|name| !open[*name]).collect();
            others.any(|(_, other)| names.iter().any(|name| other.contains(*name)))
        };
        let found = alternatives.iter().find(|it| !is_covered(it)).filter(|_| is_marked);
        let (at, unmet) = found.cloned()?;
        let written = self.mission.transitions.iter().find(|it| it.name.value == arcs.name)?;
        let when = written.when.as_ref()?;
        let text = when.value.get(at.clone())?.to_owned();
        // The names that are in this condition.
        let operands = unmet.names().iter().zip(&planned.operands).enumerate();
        let operands = operands.filter(|(index, _)| unmet.contains(*index));
        let compared = operands.filter_map(|(_, (name, operand))| {
            Some((name.as_str().to_owned(), operand.counter().filter(changes)?))
        });
        let compared: Vec<_> = compared.collect();
        let shown: Vec<_> = compared
            .iter()
            .map(|(name, counter)| format!("{name} is {}", values_in_words(&seen[*counter])))
            .collect();
        if shown.is_empty() {
            return None;
        }
        let message = format!(
            "`{text}` is never true where {} can fire: {} there",
            arcs.name,
            shown.join(" and ")
        );
        let names: Vec<_> = compared.into_iter().map(|(name, _)| name).collect();
        let finding = Finding::new(Code::NeverEqual, &within(when, at), message).may_follow();
        Some(finding.remedy(format!(
            "compare {} with a value that it has there, or let a transition set it to this one",
            names.join(" and ")
        )))
    }
}
