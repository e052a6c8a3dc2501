//! Finds deadlocks without exploring all states: each state fires only a stubborn set (Valmari,
//! 1988). Transitions outside of the set neither enable nor disable those in it, and commute with
//! them, so every deadlock is still reached by another order of the same firings.

use super::budget::{AnalysisBudget, Exhausted};
use super::explore::rooms_of;
use super::invariants::PlaceBounds;
use super::layout::MarkingLayout;
use super::rules::FiringRules;
use super::store::{Insertion, MOST_STATES, StateStore, hash_of};
use crate::net::{Net, TransitionId};

/// The result of a reduced search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Deadlocks {
    /// The number of deadlocks.
    pub deadlocks: u64,
    /// The marking of one deadlock, and firings that lead to it; not necessarily the fewest.
    pub first: Option<(Vec<TransitionId>, Vec<u32>)>,
    /// The number of states explored.
    pub states: u64,
}

/// Finds all deadlocks of a net. Returns `None` if a bound is unknown, or if the net has inhibitor
/// or reset arcs, whose firings do not commute.
///
/// # Errors
/// If a budget ran out.
pub fn find_deadlocks(
    net: &Net,
    bounds: &PlaceBounds,
    budget: &AnalysisBudget<'_>,
) -> Result<Option<Deadlocks>, Exhausted> {
    find_wanted_deadlocks(net, bounds, &|_| true, budget)
}

/// As [`find_deadlocks`], but counts only deadlocks with a wanted marking.
///
/// # Errors
/// If a budget ran out.
pub fn find_wanted_deadlocks(
    net: &Net,
    bounds: &PlaceBounds,
    wanted: &dyn Fn(&[u32]) -> bool,
    budget: &AnalysisBudget<'_>,
) -> Result<Option<Deadlocks>, Exhausted> {
    let plain = net.transitions().iter().all(|t| t.inhibitors.is_empty() && t.resets.is_empty());
    if !plain || !bounds.is_bounded() {
        return Ok(None);
    }
    let rules = FiringRules::new(net);
    let layout = MarkingLayout::new(&rooms_of(net, &rules, bounds));
    let mut stubborn = Stubborn::new(net, &rules);
    let mut store = StateStore::new(layout.words());
    let mut marking = net.initial().to_vec();
    let mut words = vec![0; layout.words()];
    layout.pack(&marking, &mut words);
    store.insert(&words, hash_of(&words));
    let mut from = vec![(0u32, 0u32)];
    let (mut deadlocks, mut first) = (0, None);
    let mut next = 0;
    while next < store.len() {
        if next.is_multiple_of(STATES_BETWEEN_STOP_CHECKS) && (budget.stop)() {
            return Err(Exhausted::Time);
        }
        layout.unpack(store.state(next as u32), &mut marking);
        let firing = stubborn.enabled_subset(&rules, &marking);
        if firing.is_empty() && wanted(&marking) {
            deadlocks += 1;
            first.get_or_insert(next as u32);
        }
        for transition in firing {
            let mut after = marking.clone();
            rules.fire(&mut after, TransitionId(transition)).ok_or(Exhausted::Tokens)?;
            layout.pack(&after, &mut words);
            let paths = from.capacity() as u64 * 16;
            if store.is_about_to_grow() && store.bytes_with_one_more() + paths > budget.memory_bytes
            {
                return Err(Exhausted::Memory);
            }
            if let Insertion::New(number) = store.insert(&words, hash_of(&words)) {
                if u64::from(number) >= budget.states || number as usize >= MOST_STATES {
                    return Err(Exhausted::States);
                }
                from.push((next as u32, transition));
            }
        }
        next += 1;
    }
    let first = first.map(|state| {
        let mut path = Vec::new();
        let mut current = state;
        while current != 0 {
            let (before, transition) = from[current as usize];
            path.push(TransitionId(transition));
            current = before;
        }
        path.reverse();
        layout.unpack(store.state(state), &mut marking);
        (path, marking)
    });
    Ok(Some(Deadlocks { deadlocks, first, states: store.len() as u64 }))
}

/// Stop is checked after this many states.
const STATES_BETWEEN_STOP_CHECKS: usize = 1 << 10;
/// How many enabled transitions are tried as the start of a set; the smallest set is used.
const SEEDS: usize = 6;

struct Stubborn {
    /// Per transition, those that it may disable or that may disable it.
    against: Vec<Vec<u32>>,
    /// Per place, the transitions that add tokens to it.
    filling: Vec<Vec<u32>>,
    /// Per transition, the round in which it was last added to a set.
    taken: Vec<u32>,
    round: u32,
}

impl Stubborn {
    fn new(net: &Net, rules: &FiringRules) -> Self {
        let mut taking = vec![Vec::new(); net.places().len()];
        let mut testing = vec![Vec::new(); net.places().len()];
        let mut filling = vec![Vec::new(); net.places().len()];
        for (index, t) in net.transitions().iter().enumerate() {
            let index = index as u32;
            t.inputs.iter().for_each(|arc| taking[arc.0.index()].push(index));
            t.outputs.iter().for_each(|arc| filling[arc.0.index()].push(index));
            let tested = &rules.rule(index).at_least;
            tested.iter().for_each(|(place, _)| testing[*place as usize].push(index));
        }
        let against = net.transitions().iter().enumerate().map(|(index, t)| {
            let tested = &rules.rule(index as u32).at_least;
            let takers = tested.iter().flat_map(|(place, _)| &taking[*place as usize]);
            let testers = t.inputs.iter().flat_map(|arc| &testing[arc.0.index()]);
            let mut against: Vec<u32> = takers.chain(testers).copied().collect();
            against.sort_unstable();
            against.dedup();
            against
        });
        let against = against.collect();
        Self { against, filling, taken: vec![0; net.transitions().len()], round: 0 }
    }

    /// Returns the enabled transitions of a small stubborn set; empty if no transition is enabled.
    fn enabled_subset(&mut self, rules: &FiringRules, marking: &[u32]) -> Vec<u32> {
        let mut enabled = Vec::new();
        rules.for_each_enabled(marking, |transition| enabled.push(transition));
        enabled.sort_unstable();
        let mut best: Vec<u32> = enabled.clone();
        for &beginning in enabled.iter().take(SEEDS) {
            if best.len() <= 1 {
                break;
            }
            if let Some(smaller) = self.close_set(rules, marking, beginning, best.len()) {
                best = smaller;
            }
        }
        best
    }

    /// Returns the enabled transitions of the smallest stubborn set that contains `beginning`, if
    /// they are fewer than `than`.
    fn close_set(
        &mut self,
        rules: &FiringRules,
        marking: &[u32],
        beginning: u32,
        than: usize,
    ) -> Option<Vec<u32>> {
        self.round += 1;
        let mut waiting = vec![beginning];
        self.taken[beginning as usize] = self.round;
        let mut enabled = Vec::new();
        while let Some(transition) = waiting.pop() {
            let mut missing = rules.rule(transition).at_least.iter();
            let missing = missing.find(|(place, weight)| marking[*place as usize] < *weight);
            let needed = match missing {
                // Only transitions that fill this place can enable it. One such place is enough,
                // and any one will do.
                Some((place, _)) => &self.filling[*place as usize],
                // Enabled: those that it competes with for tokens must not be postponed.
                None => {
                    enabled.push(transition);
                    if enabled.len() >= than {
                        return None;
                    }
                    &self.against[transition as usize]
                }
            };
            for &other in needed {
                if self.taken[other as usize] != self.round {
                    self.taken[other as usize] = self.round;
                    waiting.push(other);
                }
            }
        }
        Some(enabled)
    }
}
