//! A plan that follows another one while its mission runs: what is carried over, by names.

use crate::canonical::text_without_values;
use crate::counters::{PlannedCounter, Stand};
use crate::dates::PlannedDates;
use crate::plan::Plan;
use crate::planned::ComponentId;
use crate::version::{Version, in_words};
use armor_petri::{FiringClass, PlaceId, TransitionId};
use std::collections::BTreeSet;

/// The plan of a new version over the components that run.
pub fn read(version: &Version, running: &Plan) -> Result<Plan, String> {
    let configuration = version.configuration().map_err(in_words)?;
    let plan = Plan::over(&configuration, running).map_err(in_words)?;
    let plan = plan.ok_or_else(|| "it has no mission any more".to_owned())?;
    fits(&plan, running)?;
    Ok(plan.numbered(version.number))
}

/// Checks that no component changes between commanded and always active: a component learns only
/// when it starts whether a mission commands it.
pub fn fits(next: &Plan, running: &Plan) -> Result<(), String> {
    for (was, is) in running.components.iter().zip(&next.components) {
        let name = &was.name;
        match (was.is_controlled(), is.is_controlled()) {
            (true, false) => {
                return Err(format!(
                    "`{name}` would be in no place, and so always active, which it becomes only \
                     when it starts: keep it in a place, or run the system again"
                ));
            }
            (false, true) => {
                return Err(format!(
                    "`{name}` is in no place now, and so always active until it is started again: \
                     leave it out of all places, or run the system again"
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

/// What a transition needs to be enabled: while that stays the same, its clock keeps running.
#[derive(PartialEq, Eq)]
struct Terms<'a> {
    inputs: Vec<(&'a str, u32)>,
    reads: Vec<(&'a str, u32)>,
    inhibitors: Vec<(&'a str, u32)>,
    /// Components have the same numbers in both.
    on: Option<&'a (ComponentId, String)>,
    guard: Option<String>,
    dates: Option<PlannedDates>,
    class: FiringClass,
}

impl Plan {
    fn terms(&self, id: TransitionId) -> Terms<'_> {
        let (transition, planned) = (self.net.transition(id), self.transition(id));
        let named = |arcs: &[(PlaceId, u32)]| {
            let mut named: Vec<_> = arcs.iter().map(|arc| (self.net.place(arc.0), arc.1)).collect();
            named.sort_unstable();
            named
        };
        Terms {
            inputs: named(&transition.inputs),
            reads: named(&transition.reads),
            inhibitors: named(&transition.inhibitors),
            on: planned.on.as_ref(),
            dates: planned.dates,
            guard: planned.guard.as_ref().map(|guard| guard.guard.to_string()),
            class: transition.class,
        }
    }

    /// Returns the transition of `self` that continues as `id` of the plan that follows.
    pub fn continues_as(&self, next: &Self, id: TransitionId) -> Option<TransitionId> {
        let known = self.transition_named(&next.net.transition(id).name)?;
        (self.terms(known) == next.terms(id)).then_some(known)
    }

    /// Whether the plan that follows is this one with other values in its places, and no two places of it
    /// contradict each other that do not do so here. Then whatever is known of the markings of one plan
    /// is so of the other.
    pub fn differs_in_values_alone(&self, next: &Self) -> bool {
        // The ids of both plans are the same then: their names are in the same order.
        text_without_values(self) == text_without_values(next) && {
            let known = self.contradicting_places();
            next.contradicting_places().is_subset(&known)
        }
    }

    fn contradicting_places(&self) -> BTreeSet<(&str, [PlaceId; 2])> {
        let found = self.contradictions();
        let name = |component| self.component(component).name.as_str();
        found.iter().map(|it| (name(it.component), it.places)).collect()
    }

    /// The tokens per place of the plan that follows, if each of them has a place there.
    pub fn marking_in(&self, next: &Self, marking: &[u32]) -> Option<Vec<u32>> {
        let mut carried = vec![0; next.places.len()];
        for (name, tokens) in self.net.places().iter().zip(marking).filter(|it| *it.1 > 0) {
            carried[next.place_named(name)?.index()] = *tokens;
        }
        Some(carried)
    }

    /// Where a mission of this plan stands, in the words of the plan that follows.
    pub fn stand_in(&self, next: &Self, stand: &Stand) -> Option<Stand> {
        let marking = self.marking_in(next, &stand.marking)?;
        let counters = self.counters_in(next, &stand.counters).ok()?;
        Some(Stand { marking, counters })
    }

    /// The values of the counters of the plan that follows: those that they have, or else begin
    /// with; or in words, which of them has another domain there.
    pub fn counters_in(&self, next: &Self, counters: &[i64]) -> Result<Vec<i64>, String> {
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

    /// Exclusive components that belong to marked places together, each pair once.
    pub fn clashes(&self, is_marked: &dyn Fn(PlaceId) -> bool) -> Vec<String> {
        let place_of = |component: ComponentId| {
            let mut places = self.component(component).places.iter();
            places.find(|place| is_marked(**place)).map(|place| self.net.place(*place))
        };
        let pairs = self.component_ids().flat_map(|one| {
            let peers = self.component(one).peers.iter();
            peers.filter(move |other| one < **other).map(move |other| (one, *other))
        });
        let clash = |(one, other)| {
            let (here, there) = (place_of(one)?, place_of(other)?);
            let (one, other) = (&self.component(one).name, &self.component(other).name);
            Some(format!("`{one}` of `{here}` and `{other}` of `{there}` exclude each other"))
        };
        pairs.filter_map(clash).collect()
    }
}
