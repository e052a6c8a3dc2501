//! What transitions set counters to, and a plan that begins where a mission stands.

use crate::counters::{PlannedCounter, PlannedSet, Stand};
use crate::plan::Plan;
use armor_petri::TransitionId;
use std::sync::Arc;

impl Plan {
    /// The same, beginning where a mission stands.
    #[must_use]
    pub fn starting_at(mut self, stand: Stand) -> Self {
        self.net = Arc::new(self.net.starting_at(stand.marking));
        for (counter, value) in self.counters.iter_mut().zip(stand.counters) {
            counter.counts.initial = value;
        }
        self
    }

    /// The values that a transition sets counters to, by those that they have; or in words, why it
    /// cannot.
    pub fn sets_of(&self, id: TransitionId, counters: &[i64]) -> Result<Vec<(usize, i64)>, String> {
        if let Some((_, why)) = self.outside(id, counters) {
            return Err(why);
        }
        let one = |set: &PlannedSet| Some((set.counter, set.of(counters)?));
        Ok(self.transition(id).sets.iter().filter_map(one).collect())
    }

    /// The first of what a transition sets that would be outside of its domain, by its number, and
    /// how.
    pub fn outside(&self, id: TransitionId, counters: &[i64]) -> Option<(usize, String)> {
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
}
