//! The strongly connected components of a net's states (Tarjan, 1972). A marking is reachable from
//! every state exactly if every bottom component contains it. A run that enters a bottom component
//! without a wanted state can never reach one.
//!
//! Not by petgraph: its `tarjan_scc` recurses, which overflows the stack on chains of a few hundred
//! thousand states, and its `kosaraju_scc` needs every edge in memory, in both directions (32 bytes
//! an edge). This search computes successors when it needs them and stores 24 bytes per state.

use super::budget::{AnalysisBudget, Exhausted};
use super::space::Space;

/// The strongly connected components of a complete space.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// The number of components.
    pub components: u64,
    /// The bottom components, which no firing leaves.
    pub bottoms: Vec<Bottom>,
}

/// A component that no firing leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bottom {
    /// Its state with the fewest firings from the initial one.
    pub nearest: u32,
    /// The number of its states.
    pub states: u64,
    /// Whether one of them is wanted.
    pub has_wanted: bool,
}

impl Components {
    /// Returns whether the initial state is reachable from every state.
    pub fn is_reversible(&self) -> bool {
        self.components == 1
    }

    /// Returns the number of states that are reachable from every state.
    pub fn home_states(&self) -> u64 {
        match self.bottoms.as_slice() {
            [only] => only.states,
            _ => 0,
        }
    }

    /// Returns the nearest state of a bottom component without a wanted state; `None` if a wanted
    /// state is reachable from every state.
    pub fn lost(&self) -> Option<u32> {
        self.bottoms.iter().filter(|bottom| !bottom.has_wanted).map(|bottom| bottom.nearest).min()
    }
}

/// Most bytes per state that the search takes.
const BYTES_PER_STATE: u64 = 24;
const STEPS_BETWEEN_STOP_CHECKS: u64 = 1 << 12;
const UNSEEN: u32 = 0;
const DONE: u32 = u32::MAX;

/// Returns the components of `space`, which must be complete; `wanted` selects the wanted markings.
///
/// # Errors
/// If memory or time ran out.
pub fn find_components(
    space: &Space,
    budget: &AnalysisBudget<'_>,
    wanted: impl FnMut(&[u32]) -> bool,
) -> Result<Components, Exhausted> {
    if space.bytes() + space.states() * BYTES_PER_STATE > budget.memory_bytes {
        return Err(Exhausted::Memory);
    }
    let mut search = ComponentSearch {
        space,
        wanted,
        order: vec![UNSEEN; space.states() as usize],
        seen: 0,
        stack: Vec::new(),
        frames: Vec::new(),
        marking: space.marking(0),
        after: space.marking(0),
        words: vec![0; space.layout.words()],
        found: Components { components: 0, bottoms: Vec::new() },
    };
    search.search_all(budget)?;
    Ok(search.found)
}

/// A state on the search path.
struct PathState {
    state: u32,
    next_transition: u32,
    low: u32,
    is_bottom: bool,
}

struct ComponentSearch<'a, F> {
    space: &'a Space,
    wanted: F,
    /// Per state, its number in the order of discovery, from 1.
    order: Vec<u32>,
    seen: u32,
    stack: Vec<u32>,
    frames: Vec<PathState>,
    marking: Vec<u32>,
    after: Vec<u32>,
    words: Vec<u64>,
    found: Components,
}

impl<F: FnMut(&[u32]) -> bool> ComponentSearch<'_, F> {
    fn search_all(&mut self, budget: &AnalysisBudget<'_>) -> Result<(), Exhausted> {
        self.enter_state(0);
        let mut steps = 0u64;
        while !self.frames.is_empty() {
            steps += 1;
            if steps.is_multiple_of(STEPS_BETWEEN_STOP_CHECKS) && (budget.stop)() {
                return Err(Exhausted::Time);
            }
            match self.next_successor() {
                None => self.leave_state(),
                Some(successor) => {
                    let order = self.order[successor as usize];
                    let frame = self.frames.last_mut().expect("the search path is not empty");
                    match order {
                        UNSEEN => self.enter_state(successor),
                        DONE => frame.is_bottom = false,
                        _ => frame.low = frame.low.min(order),
                    }
                }
            }
        }
        Ok(())
    }

    fn enter_state(&mut self, state: u32) {
        self.seen += 1;
        self.order[state as usize] = self.seen;
        self.stack.push(state);
        self.frames.push(PathState { state, next_transition: 0, low: self.seen, is_bottom: true });
    }

    /// Returns the next successor of the last state on the path.
    fn next_successor(&mut self) -> Option<u32> {
        let space = self.space;
        let frame = self.frames.last_mut().expect("the search path is not empty");
        space.read_marking(frame.state, &mut self.marking);
        let rules = space.rules.all_rules();
        while let Some(rule) = rules.get(frame.next_transition as usize) {
            frame.next_transition += 1;
            if rule.is_enabled(&self.marking) {
                self.after.copy_from_slice(&self.marking);
                rule.fire(&mut self.after).expect("it was fired when the state was explored");
                space.layout.pack(&self.after, &mut self.words);
                let found = space.store.find(&self.words);
                return Some(found.expect("a complete space holds every successor"));
            }
        }
        None
    }

    /// Removes the last state from the path, after all its firings were followed.
    fn leave_state(&mut self) {
        let frame = self.frames.pop().expect("the search path is not empty");
        let is_root = frame.low == self.order[frame.state as usize];
        if is_root {
            self.close_component(&frame);
        }
        if let Some(parent) = self.frames.last_mut() {
            parent.low = parent.low.min(frame.low);
            parent.is_bottom &= frame.is_bottom && !is_root;
        }
    }

    fn close_component(&mut self, root: &PathState) {
        self.found.components += 1;
        let mut bottom = Bottom { nearest: root.state, states: 0, has_wanted: false };
        while let Some(state) = self.stack.pop() {
            self.order[state as usize] = DONE;
            bottom.states += 1;
            bottom.nearest = bottom.nearest.min(state);
            if root.is_bottom && !bottom.has_wanted {
                self.space.read_marking(state, &mut self.marking);
                bottom.has_wanted = (self.wanted)(&self.marking);
            }
            if state == root.state {
                break;
            }
        }
        if root.is_bottom {
            self.found.bottoms.push(bottom);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::explore_states;
    use crate::analysis::invariants::PlaceBounds;
    use crate::analysis::walker::space_of_walker;
    use crate::net::Net;

    fn check(places: usize, edges: &[(usize, usize)], expected: (u64, &[u64], bool)) {
        let space = space_of_walker(places, edges);
        let found =
            find_components(&space, &AnalysisBudget::UNLIMITED, |m| m[places - 1] > 0).unwrap();
        let mut sizes: Vec<_> = found.bottoms.iter().map(|bottom| bottom.states).collect();
        sizes.sort_unstable();
        assert_eq!((found.components, &sizes[..], found.lost().is_none()), expected, "{edges:?}");
    }

    #[test]
    fn bottom_components_are_found_with_their_wanted_states() {
        check(1, &[], (1, &[1], true));
        check(3, &[(0, 1), (1, 2), (2, 0)], (1, &[3], true));
        check(3, &[(0, 1), (1, 0), (1, 2)], (2, &[1], true));
        check(3, &[(0, 1), (0, 2)], (3, &[1, 1], false));
        check(5, &[(0, 1), (1, 2), (2, 1), (0, 3), (3, 4), (4, 3), (4, 0)], (2, &[2], false));
        check(5, &[(0, 1), (1, 2), (2, 1), (2, 3), (3, 4), (4, 3), (3, 1)], (2, &[4], true));
    }

    #[test]
    fn the_firings_to_a_lost_state_are_the_fewest() {
        let space = space_of_walker(4, &[(0, 1), (1, 2), (2, 2), (0, 3), (1, 3)]);
        let found = find_components(&space, &AnalysisBudget::UNLIMITED, |m| m[3] > 0).unwrap();
        let lost = found.lost().unwrap();
        assert_eq!(space.marking(lost), [0, 0, 1, 0]);
        assert_eq!(space.path_to(lost).unwrap().len(), 2);
    }

    #[test]
    fn a_chain_of_300_000_states_does_not_overflow_the_stack() {
        let mut net = Net::builder();
        let (a, b) = (net.place("a", 300_000), net.place("b", 0));
        net.transition("t").input(a, 1).output(b, 1);
        let net = net.build().unwrap();
        let space =
            explore_states(&net, &PlaceBounds::unknown(&net), false, &AnalysisBudget::UNLIMITED)
                .space;
        let found = find_components(&space, &AnalysisBudget::UNLIMITED, |m| m[0] == 0).unwrap();
        assert_eq!((found.components, found.lost()), (300_001, None));
    }
}
