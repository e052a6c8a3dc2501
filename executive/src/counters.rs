//! Variables that transitions set, called counters: whole numbers with a domain, part of the ledger.
//! They change with the taking of a firing, in its record.

use crate::builder::PlanBuilder;
use crate::guards::{Operand, mission_of};
use crate::ledger::{Ledger, LedgerError};
use crate::plan::Plan;
use crate::record::{GuardTurned, ValueSet};
use armor_petri::TransitionId;
use armor_robotfile::guard::{Count, Name};
use armor_robotfile::mission::Counts;
use std::sync::Arc;

/// A variable that transitions set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedCounter {
    /// Its name.
    pub name: String,
    /// What it may be.
    pub counts: Counts,
}

/// What a transition sets a counter to when it fires.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedSet {
    /// An index into the plan's counters.
    pub(crate) counter: usize,
    /// As written.
    pub value: Count,
    /// The counters that its names stand for, in their order.
    pub(crate) operands: Vec<usize>,
}

impl PlannedSet {
    /// What it comes to, by the values of all counters before; none beyond all that is counted.
    pub(crate) fn of(&self, counters: &[i64]) -> Option<i64> {
        let values: Vec<_> = self.operands.iter().map(|index| counters[*index]).collect();
        self.value.of(&values)
    }
}

/// Where a mission stands as far as its net goes.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stand {
    /// Tokens per place.
    pub marking: Vec<u32>,
    /// The values of the variables that transitions set.
    pub counters: Vec<i64>,
}

impl PlanBuilder {
    /// What a transition sets a counter to, with its names resolved; they are those of its mission.
    ///
    /// # Errors
    /// The name of a counter that there is not.
    pub(crate) fn set(
        &self,
        transition: &str,
        counter: usize,
        value: Count,
    ) -> Result<PlannedSet, Name> {
        let mission = mission_of(transition);
        let operands: Result<_, _> =
            value.names().iter().map(|name| self.counter_named(mission, name)).collect();
        Ok(PlannedSet { counter, operands: operands?, value })
    }

    pub(crate) fn counter_named(&self, mission: &str, name: &Name) -> Result<usize, Name> {
        let named =
            |counter: &PlannedCounter| counter.name.strip_prefix(mission) == Some(name.as_str());
        self.counters.iter().position(named).ok_or_else(|| name.clone())
    }

    /// For each counter, the transitions whose guards look at it.
    pub(crate) fn counter_readers(&self) -> Vec<Vec<TransitionId>> {
        let mut readers = vec![Vec::new(); self.counters.len()];
        for (id, transition) in (0..).map(TransitionId).zip(&self.transitions) {
            for operand in transition.guard.iter().flat_map(|guard| &guard.operands) {
                if let Operand::Counter(index) = operand {
                    let readers: &mut Vec<_> = &mut readers[*index];
                    if readers.last() != Some(&id) {
                        readers.push(id);
                    }
                }
            }
        }
        readers
    }
}

impl Plan {
    /// The same, beginning where a mission stands.
    #[must_use]
    pub(crate) fn starting_at(mut self, stand: Stand) -> Self {
        self.net = Arc::new(self.net.starting_at(stand.marking));
        for (counter, value) in self.counters.iter_mut().zip(stand.counters) {
            counter.counts.initial = value;
        }
        self
    }

    /// The values that a transition sets counters to, by those that they have; or in words, why it
    /// cannot.
    pub(crate) fn sets_of(
        &self,
        id: TransitionId,
        counters: &[i64],
    ) -> Result<Vec<(usize, i64)>, String> {
        if let Some((_, why)) = self.outside(id, counters) {
            return Err(why);
        }
        let one = |set: &PlannedSet| Some((set.counter, set.of(counters)?));
        Ok(self.transition(id).sets.iter().filter_map(one).collect())
    }

    /// The first of what a transition sets that would be outside of its domain, by its number, and
    /// how.
    pub(crate) fn outside(&self, id: TransitionId, counters: &[i64]) -> Option<(usize, String)> {
        self.transition(id).sets.iter().enumerate().find_map(|(number, set)| {
            let PlannedCounter { name, counts } = &self.counters[set.counter];
            let value = set.of(counters);
            if value.is_some_and(|value| (counts.minimum..=counts.maximum).contains(&value)) {
                return None;
            }
            let value = value.map_or("more than is counted".into(), |value| value.to_string());
            let (transition, low, high) =
                (&self.net.transition(id).name, counts.minimum, counts.maximum);
            Some((
                number,
                format!("{transition} would set {name} to {value}, and it is {low} to {high}"),
            ))
        })
    }

    /// Where a mission of this plan stands, in the words of the plan that follows.
    pub(crate) fn stand_in(&self, next: &Self, stand: &Stand) -> Option<Stand> {
        let marking = self.marking_in(next, &stand.marking)?;
        let counters = self.counters_in(next, &stand.counters).ok()?;
        Some(Stand { marking, counters })
    }

    /// The values of the counters of the plan that follows: those that they have, or else begin
    /// with; or in words, which of them has another domain there.
    pub(crate) fn counters_in(&self, next: &Self, counters: &[i64]) -> Result<Vec<i64>, String> {
        let carried = |after: &PlannedCounter| {
            let (name, counts) = (&after.name, after.counts);
            let known = self.counters.iter().position(|before| before.name == *name);
            let value = known.map_or(counts.initial, |index| counters[index]);
            let is_inside = (counts.minimum..=counts.maximum).contains(&value);
            is_inside.then_some(value).ok_or_else(|| {
                let (low, high) = (counts.minimum, counts.maximum);
                format!("`{name}` is {value}, and the new file lets it be {low} to {high}")
            })
        };
        next.counters.iter().map(carried).collect()
    }
}

impl Ledger {
    /// The variables that transitions set, and their values.
    pub fn values(&self) -> impl Iterator<Item = (&str, i64)> {
        let names = self.plan.counters.iter().map(|counter| counter.name.as_str());
        names.zip(self.counters.iter().copied())
    }

    /// Variables are set with the taking: what is decided next is decided by their new values.
    pub(crate) fn set_values(
        &mut self,
        sets: &[ValueSet],
        guards: &[GuardTurned],
    ) -> Result<(), LedgerError> {
        for set in sets {
            let named = |counter: &PlannedCounter| counter.name == set.variable;
            let index = self.plan.counters.iter().position(named);
            let index = index.ok_or_else(|| LedgerError::UnknownName(set.variable.clone()))?;
            self.counters[index] = set.value;
        }
        guards.iter().try_for_each(|turned| self.weighed(&turned.transition, turned.holds))
    }
}
