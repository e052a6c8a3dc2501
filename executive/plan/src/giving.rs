//! The values that a component has while places are marked, and places that contradict each other.

use crate::plan::Plan;
use crate::planned::ComponentId;
use crate::values::GivenValue;
use armor_petri::PlaceId;

/// Two places that give one parameter of a component different values.
#[derive(Clone, Copy, Debug)]
pub struct Contradiction<'a> {
    /// The component.
    pub component: ComponentId,
    /// The two places.
    pub places: [PlaceId; 2],
    /// What each of them gives.
    pub values: [&'a GivenValue; 2],
}

impl Plan {
    /// The values that a component has while these places are marked. Of several for one parameter
    /// that of the place that is first in the file counts.
    pub fn values_in(
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
        // Two places that give the same values in another order are no reason to start a component
        // again.
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
    pub fn contradictions(&self) -> Vec<Contradiction<'_>> {
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
