//! Values that places give parameters. They belong to an activation: decided when it begins, by the
//! places that are marked then or about to be, and handed over before its first call. Whoever is to
//! go on with others is stopped and started afresh.

use crate::ledger::Ledger;
use crate::plan::{ComponentId, Plan};
use armor_petri::PlaceId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;

/// A value that a place gives a parameter of one of its components.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GivenValue {
    /// The parameter.
    pub parameter: String,
    /// The value, as written.
    pub text: String,
    /// The folder that a relative path in it starts from.
    pub folder: PathBuf,
    /// Where it is written, `file:line:column`.
    pub origin: String,
}

impl GivenValue {
    /// What it says, wherever that is written.
    fn terms(&self) -> (&str, &str, &PathBuf) {
        (&self.parameter, &self.text, &self.folder)
    }
}

impl fmt::Display for GivenValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.parameter, self.text)
    }
}

/// Two places that give one parameter of a component different values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contradiction<'a> {
    pub(crate) component: ComponentId,
    pub(crate) places: [PlaceId; 2],
    pub(crate) values: [&'a GivenValue; 2],
}

impl Plan {
    /// The values that a component has while these places are marked. Of several for one parameter
    /// that of the place that is first in the file counts.
    pub(crate) fn values_in(
        &self,
        component: ComponentId,
        is_marked: impl Fn(PlaceId) -> bool,
    ) -> Vec<GivenValue> {
        let mut places: Vec<_> = self.component(component).places.clone();
        places.sort_unstable();
        let mut found: Vec<GivenValue> = Vec::new();
        for place in places.into_iter().filter(|place| is_marked(*place)) {
            for value in self.values_of(place, component) {
                if !found.iter().any(|known| known.parameter == value.parameter) {
                    found.push(value.clone());
                }
            }
        }
        // Two places that say the same in another order do not disturb anybody.
        found.sort_by(|one, other| one.parameter.cmp(&other.parameter));
        found
    }

    fn values_of(
        &self,
        place: PlaceId,
        component: ComponentId,
    ) -> impl Iterator<Item = &GivenValue> {
        let values = &self.place(place).values;
        values.iter().filter(move |given| given.0 == component).map(|given| &given.1)
    }

    /// The pairs of places that would contradict each other if both were marked.
    pub(crate) fn contradictions(&self) -> Vec<Contradiction<'_>> {
        let mut found = Vec::new();
        for component in self.component_ids() {
            let mut places = self.component(component).places.clone();
            places.sort_unstable();
            for (index, one) in places.iter().enumerate() {
                for other in &places[index + 1..] {
                    let first = self.values_of(*one, component).find_map(|value| {
                        let mut others = self.values_of(*other, component);
                        let other = others.find(|other| other.parameter == value.parameter)?;
                        (value.terms() != other.terms()).then_some([value, other])
                    });
                    let places = [*one, *other];
                    found.extend(first.map(|values| Contradiction { component, places, values }));
                }
            }
        }
        found
    }
}

impl Ledger {
    /// The values of an activation that begins now.
    pub(crate) fn values_for(&self, component: ComponentId) -> Vec<GivenValue> {
        self.values_with(component, &[], None)
    }

    /// The components of a firing's places that run and have to be started afresh: those that have
    /// finished, and those that get other values. `firing` is its number, if it is in flight.
    pub(crate) fn to_renew(
        &self,
        to: &[(PlaceId, u32)],
        firing: Option<u64>,
    ) -> BTreeSet<ComponentId> {
        let mut renewed = self.finished_in(to);
        let components = to.iter().flat_map(|arc| &self.plan.place(arc.0).components);
        renewed.extend(components.filter(|component| {
            let last = &self.activations[component.index()];
            let is_same = |values: &[GivenValue]| {
                let terms = values.iter().map(GivenValue::terms);
                terms.eq(last.values.iter().map(GivenValue::terms))
            };
            let runs = last.open && self.plan.component(**component).is_controlled();
            runs && last.number > 0 && !is_same(&self.values_with(**component, to, firing))
        }));
        renewed
    }

    /// By the places that are marked, those that firings lead to (but for `except`), and `to`.
    fn values_with(
        &self,
        component: ComponentId,
        to: &[(PlaceId, u32)],
        except: Option<u64>,
    ) -> Vec<GivenValue> {
        let flights = self.firings.iter().filter(|(number, _)| Some(**number) != except);
        let arriving: BTreeSet<_> =
            flights.flat_map(|(_, firing)| &firing.to).chain(to).map(|arc| arc.0).collect();
        let is_marked = |place: PlaceId| self.state.tokens(place) > 0 || arriving.contains(&place);
        self.plan.values_in(component, is_marked)
    }
}
