//! Places whose components exclude each other.

use std::collections::BTreeSet;

use armor_petri::PlaceId;
use armor_plan::{ComponentId, Plan};

/// The pairs of places of which each activates one of two exclusive components.
pub(crate) fn list_exclusive_places(plan: &Plan) -> Vec<([ComponentId; 2], [PlaceId; 2])> {
    let mut known = BTreeSet::new();
    let mut pairs = Vec::new();
    for one in plan.component_ids() {
        let component = &plan.components()[one.index()];
        for other in component.peers.iter().filter(|other| **other > one) {
            for place in &component.places {
                for second in &plan.components()[other.index()].places {
                    let pair = (*place.min(second), *place.max(second));
                    if place != second && known.insert(pair) {
                        pairs.push(([one, *other], [*place, *second]));
                    }
                }
            }
        }
    }
    pairs
}
