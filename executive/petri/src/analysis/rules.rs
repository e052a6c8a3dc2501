//! The untimed firing rule: which transitions a marking enables, and the marking after a firing.

use crate::net::{Net, PlaceId, TransitionId};
use std::collections::{BTreeMap, BTreeSet};

/// What a transition requires and does, precomputed for many firings.
#[derive(Clone, Debug)]
pub struct Rule {
    /// Place, and the least tokens required in it.
    pub(crate) at_least: Vec<(u32, u32)>,
    /// Place, and the tokens it must stay below.
    pub(crate) below: Vec<(u32, u32)>,
    /// Place, and by how much a firing changes it; without reset places.
    pub(crate) change: Vec<(u32, i64)>,
    /// Reset place, and the tokens put into it after the reset.
    pub(crate) reset_to: Vec<(u32, u32)>,
}

/// The rules of all transitions of a net.
#[derive(Clone, Debug)]
pub struct FiringRules {
    rules: Vec<Rule>,
    /// Per place, transitions that require it marked; each transition is listed at one place.
    waiting_at: Vec<Vec<u32>>,
    /// Transitions that require no token.
    needing_nothing: Vec<u32>,
}

impl FiringRules {
    /// Precomputes the rules of `net`.
    pub fn new(net: &Net) -> Self {
        let rules: Vec<_> = net.transition_ids().map(|id| rule_of(net, id)).collect();
        let mut needed_by = vec![0u32; net.places().len()];
        for (place, _) in rules.iter().flat_map(|rule: &Rule| &rule.at_least) {
            needed_by[*place as usize] += 1;
        }
        let mut waiting_at = vec![Vec::new(); net.places().len()];
        let mut needing_nothing = Vec::new();
        for (index, rule) in rules.iter().enumerate() {
            // List it at an initially empty place with few others, where it is checked least often.
            let rarest = rule.at_least.iter().map(|(place, _)| *place).min_by_key(|place| {
                (net.initial()[*place as usize] > 0, needed_by[*place as usize])
            });
            match rarest {
                Some(place) => waiting_at[place as usize].push(index as u32),
                None => needing_nothing.push(index as u32),
            }
        }
        Self { rules, waiting_at, needing_nothing }
    }

    pub(crate) fn rule(&self, transition: u32) -> &Rule {
        &self.rules[transition as usize]
    }

    pub(crate) fn all_rules(&self) -> &[Rule] {
        &self.rules
    }

    /// Calls `found` with each transition that `marking` enables, in no particular order.
    pub(crate) fn for_each_enabled(&self, marking: &[u32], mut found: impl FnMut(u32)) {
        for (tokens, waiting) in marking.iter().zip(&self.waiting_at) {
            if *tokens > 0 {
                for &transition in waiting {
                    if self.rules[transition as usize].is_enabled(marking) {
                        found(transition);
                    }
                }
            }
        }
        for &transition in &self.needing_nothing {
            if self.rules[transition as usize].is_enabled(marking) {
                found(transition);
            }
        }
    }

    /// Returns whether `marking` enables a transition.
    pub fn enabled(&self, marking: &[u32], transition: TransitionId) -> bool {
        self.rules[transition.index()].is_enabled(marking)
    }

    /// Fires a transition that `marking` enables. Returns `None` if a place would overflow; the
    /// marking is then invalid.
    pub fn fire(&self, marking: &mut [u32], transition: TransitionId) -> Option<()> {
        self.rules[transition.index()].fire(marking)
    }

    /// Returns the marking after a sequence of firings; `None` if one of them is not enabled.
    pub fn play(&self, marking: &[u32], sequence: &[TransitionId]) -> Option<Vec<u32>> {
        let mut marking = marking.to_vec();
        for &transition in sequence {
            if !self.enabled(&marking, transition) {
                return None;
            }
            self.fire(&mut marking, transition)?;
        }
        Some(marking)
    }
}

impl Rule {
    #[inline]
    pub(crate) fn is_enabled(&self, marking: &[u32]) -> bool {
        self.at_least.iter().all(|&(place, weight)| marking[place as usize] >= weight)
            && self.below.iter().all(|&(place, weight)| marking[place as usize] < weight)
    }

    pub(crate) fn fire(&self, marking: &mut [u32]) -> Option<()> {
        for &(place, change) in &self.change {
            let tokens = &mut marking[place as usize];
            *tokens = u32::try_from(i64::from(*tokens) + change).ok()?;
        }
        for &(place, tokens) in &self.reset_to {
            marking[place as usize] = tokens;
        }
        Some(())
    }
}

fn rule_of(net: &Net, id: TransitionId) -> Rule {
    let t = net.transition(id);
    let mut at_least: BTreeMap<u32, u32> = BTreeMap::new();
    for &(PlaceId(place), weight) in t.inputs.iter().chain(&t.reads) {
        let needed = at_least.entry(place).or_default();
        *needed = weight.max(*needed);
    }
    let mut below: BTreeMap<u32, u32> = BTreeMap::new();
    for &(PlaceId(place), weight) in &t.inhibitors {
        let limit = below.entry(place).or_insert(weight);
        *limit = weight.min(*limit);
    }
    // Tokens taken and put. The builder has merged parallel arcs, so each place occurs once per
    // side.
    let mut moved: BTreeMap<u32, (u32, u32)> = BTreeMap::new();
    t.inputs.iter().for_each(|arc| moved.entry(arc.0.0).or_default().0 = arc.1);
    t.outputs.iter().for_each(|arc| moved.entry(arc.0.0).or_default().1 = arc.1);
    let resets: BTreeSet<u32> = t.resets.iter().map(|place| place.0).collect();
    let put = |place: &u32| moved.get(place).map_or(0, |moved| moved.1);
    let reset_to = resets.iter().map(|place| (*place, put(place))).collect();
    let change = moved
        .iter()
        .filter(|(place, (taken, put))| taken != put && !resets.contains(place))
        .map(|(place, (taken, put))| (*place, i64::from(*put) - i64::from(*taken)))
        .collect();
    let (at_least, below) = (at_least.into_iter().collect(), below.into_iter().collect());
    Rule { at_least, below, change, reset_to }
}
