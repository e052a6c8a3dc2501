//! For each pair of places, the nearest state in which both are marked: found for all pairs together,
//! since missions of many robots have thousands of pairs to ask for.

use std::collections::HashMap;

use armor_petri::PlaceId;
use armor_petri::analysis::Space;

/// The pairs of places that are marked together in some state.
pub(crate) struct MarkedPairs(HashMap<[PlaceId; 2], u32>);

impl MarkedPairs {
    /// Looks at all states once.
    pub(crate) fn of(space: &Space, places: usize) -> Self {
        let mut nearest = HashMap::new();
        let mut marking = vec![0; places];
        let mut marked = Vec::new();
        for state in 0..space.states() as u32 {
            space.read_marking(state, &mut marking);
            marked.clear();
            marked.extend((0..places as u32).filter(|at| marking[*at as usize] > 0).map(PlaceId));
            for (number, one) in marked.iter().enumerate() {
                for other in &marked[number..] {
                    // States are in the order of their distance from the start.
                    nearest.entry([*one, *other]).or_insert(state);
                }
            }
        }
        Self(nearest)
    }

    /// Returns the nearest state in which two places are marked.
    pub(crate) fn nearest(&self, one: PlaceId, other: PlaceId) -> Option<u32> {
        self.0.get(&[one.min(other), one.max(other)]).copied()
    }
}

#[cfg(test)]
mod tests {
    use armor_petri::NetBuilder;
    use armor_petri::analysis::invariants::PlaceBounds;
    use armor_petri::analysis::{AnalysisBudget, explore_states};

    use super::*;

    #[test]
    fn all_pairs_are_those_that_a_search_for_each_finds() {
        let mut builder = NetBuilder::default();
        let names = ["a", "b", "c", "d", "e", "f"];
        let places = names.map(|name| builder.place(name, u32::from(["a", "d"].contains(&name))));
        for (from, to) in [(0, 1), (1, 2), (3, 4), (4, 3)] {
            let name = format!("{from}{to}");
            builder.transition(&name).input(places[from], 1).output(places[to], 1);
        }
        // Two tokens together, then f alone.
        builder.transition("join").input(places[2], 1).input(places[4], 1).output(places[5], 2);
        let net = builder.build().expect("a net");
        let budget =
            AnalysisBudget { states: 1000, memory_bytes: 1 << 20, stop: &|| false, explored: None };
        let bounds = PlaceBounds::of_net(&net, &|| false);
        let space = explore_states(&net, &bounds, true, &budget).space;
        let pairs = MarkedPairs::of(&space, places.len());
        let mut found = 0;
        for one in places {
            for other in places {
                let both = |marking: &[u32]| marking[one.index()] > 0 && marking[other.index()] > 0;
                assert_eq!(pairs.nearest(one, other), space.find(both));
                found += usize::from(pairs.nearest(one, other).is_some());
            }
        }
        assert_eq!(found, 18, "each of a, b, c with d or e, in both orders, and each with itself");
    }
}
