//! Checks the values that transitions set variables to and that places give to components, from the
//! journal and the plan alone.

use super::Play;
use crate::ledger::MissionStage;
use crate::terms::{Cause, Tokens, ValueSet};
use armor_plan::{ComponentId, GivenValue, PlannedCounter, PlannedPlace};

impl Play {
    pub(super) fn note_guard(&mut self, transition: &str, holds: bool) {
        let is_news = if holds {
            self.holding.insert(transition.to_owned())
        } else {
            self.holding.remove(transition)
        };
        assert!(is_news, "a guard that has not changed");
    }

    /// Checks that a firing sets its variables to the values computed from those before it.
    pub(super) fn note_sets(&mut self, cause: &Cause, sets: &[ValueSet]) {
        let Cause::Transition(name) = cause else {
            return assert!(sets.is_empty());
        };
        let planned = self.plan.transition(self.plan.transition_named(name).unwrap());
        let mut wanted = Vec::new();
        for set in &planned.sets {
            let values: Vec<_> =
                set.value.names().iter().map(|name| self.counters[name.as_str()]).collect();
            let PlannedCounter { name, counts } = &self.plan.counters()[set.counter];
            let value = set.value.of(&values).unwrap();
            assert!((counts.minimum..=counts.maximum).contains(&value), "{name} is set to {value}");
            wanted.push(ValueSet { variable: name.clone(), value });
        }
        assert_eq!(sets, wanted, "{name}");
        self.counters.extend(wanted.into_iter().map(|set| (set.variable, set.value)));
    }

    /// Checks that an activation has the values of the places that are marked or about to be; of
    /// two places that give the same parameter, the first in the file has priority.
    pub(super) fn check_values(&self, component: ComponentId, values: &[GivenValue]) {
        let playing =
            self.controller.as_ref().map(|it| it.ledger().stage()) == Some(MissionStage::Playing);
        if !playing {
            return;
        }
        let comes = |place: &str| {
            self.in_flight.values().any(|flight| flight.1.iter().any(|it| it.place == place))
        };
        let mut wanted: Vec<GivenValue> = Vec::new();
        for (index, place) in self.plan.places().iter().enumerate() {
            if self.oracle[index] > 0 || comes(&self.plan.net().places()[index]) {
                for (_, value) in place.values.iter().filter(|given| given.0 == component) {
                    if wanted.iter().all(|known| known.parameter != value.parameter) {
                        wanted.push(value.clone());
                    }
                }
            }
        }
        wanted.sort_by(|one, other| one.parameter.cmp(&other.parameter));
        assert_eq!(values, wanted, "{}", self.plan.component(component).name);
    }

    /// Checks that a component that runs when a firing ends has the values of the firing's places,
    /// unless another place gives the parameter a different value.
    pub(super) fn check_given(&self, to: &[Tokens]) {
        for it in to {
            let place = self.plan.place_named(&it.place).unwrap();
            for (component, value) in &self.plan.place(place).values {
                let process = &self.world.processes[component.index()];
                let is_only = |place: &PlannedPlace| {
                    place.values.iter().all(|(other, given)| {
                        let is_same = given.terms() == value.terms();
                        other != component || given.parameter != value.parameter || is_same
                    })
                };
                let is_asked = process.active
                    && self.plan.component(*component).is_controlled()
                    && self.plan.places().iter().all(is_only);
                // The same value may be at another place in another version of the file.
                let has = process.values.iter().any(|given| given.terms() == value.terms());
                let name = &self.plan.component(*component).name;
                assert!(!is_asked || has, "{name} is without {value} in {}", it.place);
            }
        }
    }
}
