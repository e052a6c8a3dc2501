//! The states that an exploration found, in breadth-first order, and queries on them.

use super::layout::MarkingLayout;
use super::rules::FiringRules;
use super::store::StateStore;
use crate::net::{PlaceId, TransitionId};

/// States, numbered by distance from the initial one, which is 0.
#[derive(Debug)]
pub struct Space {
    pub(crate) rules: FiringRules,
    pub(crate) layout: MarkingLayout,
    pub(crate) store: StateStore,
    pub(crate) parents: Option<Vec<u32>>,
    pub(crate) most_in_place: Vec<u32>,
    pub(crate) most_in_marking: u64,
    pub(crate) edges: u64,
    pub(crate) expanded: usize,
    pub(crate) deadlocks: u64,
    pub(crate) first_deadlock: Option<u32>,
    pub(crate) fired: Vec<bool>,
}

impl Space {
    /// Returns the number of states.
    pub fn states(&self) -> u64 {
        self.store.len() as u64
    }

    /// Returns the number of pairs of a state and a transition it enables.
    pub fn edges(&self) -> u64 {
        self.edges
    }

    /// Returns the most tokens of a place in any state.
    pub fn most_in(&self, place: PlaceId) -> u32 {
        self.most_in_place[place.index()]
    }

    /// Returns the most tokens of any place in any state; 0 without places.
    pub fn max_tokens_in_place(&self) -> u32 {
        self.most_in_place.iter().copied().max().unwrap_or(0)
    }

    /// Returns the most tokens of any state, summed over its places.
    pub fn max_tokens_per_marking(&self) -> u64 {
        self.most_in_marking
    }

    /// Returns the number of states that enable no transition.
    pub fn deadlocks(&self) -> u64 {
        self.deadlocks
    }

    /// Returns the nearest state that enables no transition.
    pub fn first_deadlock(&self) -> Option<u32> {
        self.first_deadlock
    }

    /// Returns the transitions that no state enables.
    pub fn dead_transitions(&self) -> impl Iterator<Item = TransitionId> {
        let unfired = self.fired.iter().enumerate().filter(|(_, fired)| !**fired);
        unfired.map(|(index, _)| TransitionId(index as u32))
    }

    /// Returns the tokens per place in a state.
    pub fn marking(&self, state: u32) -> Vec<u32> {
        let mut marking = vec![0; self.most_in_place.len()];
        self.read_marking(state, &mut marking);
        marking
    }

    /// Reads the tokens per place of a state into a buffer with one number per place.
    pub fn read_marking(&self, state: u32, marking: &mut [u32]) {
        self.layout.unpack(self.store.state(state), marking);
    }

    /// Returns the number of the state with this marking, if there is one.
    pub fn state_of(&self, marking: &[u32]) -> Option<u32> {
        let fits = marking.len() == self.most_in_place.len();
        if !fits || marking.iter().zip(&self.most_in_place).any(|(tokens, most)| tokens > most) {
            return None;
        }
        let mut words = vec![0; self.layout.words()];
        self.layout.pack(marking, &mut words);
        // A constant place has no bits; reading the state back compares its tokens too.
        let state = self.store.find(&words)?;
        (self.marking(state) == marking).then_some(state)
    }

    /// Returns the firings of a state that lead to states of the space, sorted by transition.
    pub fn successors(&self, state: u32) -> Vec<(TransitionId, u32)> {
        let marking = self.marking(state);
        let mut successors = Vec::new();
        self.rules.for_each_enabled(&marking, |transition| {
            let mut after = marking.clone();
            let fired = self.rules.rule(transition).fire(&mut after);
            if let Some(next) = fired.and_then(|()| self.state_of(&after)) {
                successors.push((TransitionId(transition), next));
            }
        });
        successors.sort_unstable();
        successors
    }

    /// Returns the nearest state with a wanted marking.
    pub fn find(&self, mut wanted: impl FnMut(&[u32]) -> bool) -> Option<u32> {
        let mut marking = vec![0; self.most_in_place.len()];
        (0..self.store.len() as u32).find(|&state| {
            self.read_marking(state, &mut marking);
            wanted(&marking)
        })
    }

    /// Returns the nearest state in which two places are marked.
    pub fn together(&self, one: PlaceId, other: PlaceId) -> Option<u32> {
        self.find(|marking| marking[one.index()] > 0 && marking[other.index()] > 0)
    }

    /// Returns a shortest firing sequence from the initial state to `state`; `None` if the
    /// exploration did not record how states were reached.
    pub fn path_to(&self, state: u32) -> Option<Vec<TransitionId>> {
        let states = self.states_on_path(state)?;
        Some(states.windows(2).map(|step| self.between(step[0], step[1])).collect())
    }

    /// Returns the states of that sequence, including both ends.
    pub(crate) fn states_on_path(&self, state: u32) -> Option<Vec<u32>> {
        let parents = self.parents.as_ref()?;
        let mut path = vec![state];
        let mut current = state;
        while current != 0 {
            current = parents[current as usize];
            path.push(current);
        }
        path.reverse();
        Some(path)
    }

    /// Returns the bytes that the states and their index take.
    pub fn bytes(&self) -> u64 {
        let paths = self.parents.as_ref().map_or(0, |paths| paths.capacity() as u64 * 4);
        self.store.bytes() + paths
    }
}
