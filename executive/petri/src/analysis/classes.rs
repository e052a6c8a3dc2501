//! The graph of state classes of a time Petri net. A class is a marking with all possible firing
//! times of its enabled transitions (Berthomieu and Menasche, 1983; Berthomieu and Diaz, 1991). The
//! graph has the markings and firing sequences of the timed net, and is finite if the net is
//! bounded.
//!
//! Priorities and safety classes are ignored, and gates may open at any time, so whatever the graph
//! excludes never happens in a run.

use super::budget::{AnalysisBudget, Exhausted};
use super::domain::{Domain, Times};
use super::rules::FiringRules;
use crate::net::{Net, TransitionId};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::rc::Rc;

/// State classes in breadth-first order; 0 is the initial one.
#[derive(Debug)]
pub struct StateClasses {
    classes: Vec<Rc<StateClass>>,
    parents: Vec<(u32, TransitionId)>,
    /// Per class, its firings.
    successors: Vec<Vec<(TransitionId, u32)>>,
    edges: u64,
}

#[derive(Debug, PartialEq, Eq, Hash)]
struct StateClass {
    marking: Box<[u32]>,
    domain: Domain,
}

impl StateClasses {
    /// Returns the number of classes.
    pub fn classes(&self) -> u64 {
        self.classes.len() as u64
    }

    /// Returns the number of pairs of a class and a transition that can fire first in it.
    pub fn edges(&self) -> u64 {
        self.edges
    }

    /// Returns the number of distinct markings.
    pub fn markings(&self) -> u64 {
        let markings: std::collections::HashSet<_> =
            self.classes.iter().map(|class| &class.marking).collect();
        markings.len() as u64
    }

    /// Returns the tokens per place in a class.
    pub fn marking(&self, class: u32) -> &[u32] {
        &self.classes[class as usize].marking
    }

    /// Returns the transitions that can fire first in a class, each with the class after it.
    pub fn successors(&self, class: u32) -> &[(TransitionId, u32)] {
        &self.successors[class as usize]
    }

    /// Returns the classes in which no transition can fire.
    pub fn deadlocks(&self) -> impl Iterator<Item = u32> {
        (0..self.successors.len() as u32).filter(|class| self.successors(*class).is_empty())
    }

    /// Returns the transitions that never fire, of a net with `transitions` many.
    pub fn dead_transitions(&self, transitions: usize) -> Vec<TransitionId> {
        let mut fired = vec![false; transitions];
        self.successors.iter().flatten().for_each(|(id, _)| fired[id.index()] = true);
        (0..transitions as u32).map(TransitionId).filter(|id| !fired[id.index()]).collect()
    }

    /// Returns a firing sequence to a class, with the fewest firings.
    pub fn path_to(&self, class: u32) -> Vec<TransitionId> {
        let mut path = Vec::new();
        let mut current = class;
        while current != 0 {
            let (parent, transition) = self.parents[current as usize];
            path.push(transition);
            current = parent;
        }
        path.reverse();
        path
    }
}

/// Returns the classes of `net`, and which budget ran out, if one did.
pub fn find_state_classes(
    net: &Net,
    budget: &AnalysisBudget<'_>,
) -> (StateClasses, Option<Exhausted>) {
    let mut found =
        StateClasses { classes: Vec::new(), parents: Vec::new(), successors: Vec::new(), edges: 0 };
    let exhausted = match TimedRules::new(net) {
        Ok(firing) => explore_classes(&mut found, &firing, net, budget).err(),
        Err(exhausted) => Some(exhausted),
    };
    (found, exhausted)
}

/// Returns whether the times of `net` allow this firing sequence from the initial marking.
///
/// # Errors
/// If the times are too far apart to be counted, or a place cannot count its tokens.
pub fn is_possible(net: &Net, sequence: &[TransitionId]) -> Result<bool, Exhausted> {
    let firing = TimedRules::new(net)?;
    let mut marking: Box<[u32]> = net.initial().into();
    let mut domain =
        Domain::newly_enabled(&firing.times, &firing.enabled_transitions(&marking), false);
    for wanted in sequence {
        let next =
            firing.first_firings(&marking, &domain)?.into_iter().find(|fired| fired.0 == *wanted);
        let Some(next) = next else { return Ok(false) };
        (marking, domain) = (next.1, next.2);
    }
    Ok(true)
}

/// A class costs far more than a state, so the check is frequent.
const CLASSES_BETWEEN_STOP_CHECKS: u32 = 256;
/// Bytes of a class besides its numbers: pointers, the table entry, its parent.
const BYTES_OVERHEAD: u64 = 160;

fn explore_classes(
    found: &mut StateClasses,
    firing: &TimedRules,
    net: &Net,
    budget: &AnalysisBudget<'_>,
) -> Result<(), Exhausted> {
    let mut numbers: HashMap<Rc<StateClass>, u32> = HashMap::new();
    let marking: Box<[u32]> = net.initial().into();
    let domain = Domain::newly_enabled(&firing.times, &firing.enabled_transitions(&marking), false);
    let initial = Rc::new(StateClass { marking, domain });
    numbers.insert(Rc::clone(&initial), 0);
    found.classes.push(initial);
    found.parents.push((0, TransitionId(0)));
    let mut bytes = 0;
    while let Some(class) = found.classes.get(found.successors.len()).cloned() {
        let number = found.successors.len() as u32;
        if number.is_multiple_of(CLASSES_BETWEEN_STOP_CHECKS) && (budget.stop)() {
            return Err(Exhausted::Time);
        }
        budget.count_explored();
        let mut successors = Vec::new();
        for (transition, marking, domain) in firing.first_firings(&class.marking, &class.domain)? {
            let next = Rc::new(StateClass { marking, domain });
            let new = found.classes.len() as u32;
            let next_number = match numbers.entry(next) {
                Entry::Occupied(known) => *known.get(),
                Entry::Vacant(place) => {
                    let size = place.key().marking.len() as u64 * 4 + place.key().domain.bytes();
                    bytes += size + BYTES_OVERHEAD;
                    if u64::from(new) >= budget.states {
                        return Err(Exhausted::States);
                    }
                    if bytes > budget.memory_bytes {
                        return Err(Exhausted::Memory);
                    }
                    found.classes.push(Rc::clone(place.key()));
                    found.parents.push((number, transition));
                    *place.insert(new)
                }
            };
            successors.push((transition, next_number));
            bytes += 8;
        }
        found.edges += successors.len() as u64;
        found.successors.push(successors);
    }
    Ok(())
}

/// The timed firing rule between classes.
pub(super) struct TimedRules {
    pub rules: FiringRules,
    pub times: Times,
    taking: Vec<Taking>,
}

/// The first half of a firing.
struct Taking {
    /// Place and tokens taken.
    inputs: Vec<(u32, u32)>,
    /// Places emptied.
    resets: Vec<u32>,
}

/// A firing, the marking after it and the domain after it.
pub(super) type TimedFiring = (TransitionId, Box<[u32]>, Domain);

impl TimedRules {
    pub fn new(net: &Net) -> Result<Self, Exhausted> {
        let taking = net.transitions().iter().map(|t| {
            let inputs = t.inputs.iter().map(|(place, weight)| (place.0, *weight)).collect();
            Taking { inputs, resets: t.resets.iter().map(|place| place.0).collect() }
        });
        Ok(Self { rules: FiringRules::new(net), times: Times::of(net)?, taking: taking.collect() })
    }

    /// Returns the transitions that a marking enables, in order.
    pub fn enabled_transitions(&self, marking: &[u32]) -> Vec<u32> {
        let mut enabled = Vec::new();
        self.rules.for_each_enabled(marking, |transition| enabled.push(transition));
        enabled.sort_unstable();
        enabled
    }

    /// Returns all possible first firings of a class.
    pub fn first_firings(
        &self,
        marking: &[u32],
        domain: &Domain,
    ) -> Result<Vec<TimedFiring>, Exhausted> {
        let enabled = self.enabled_transitions(marking);
        let mut fired = Vec::new();
        for (index, &transition) in enabled.iter().enumerate() {
            if !domain.can_be_first(index + 1, enabled.len()) {
                continue;
            }
            let mut between = marking.to_vec();
            let Taking { inputs, resets } = &self.taking[transition as usize];
            inputs.iter().for_each(|(place, weight)| between[*place as usize] -= weight);
            resets.iter().for_each(|place| between[*place as usize] = 0);
            let mut after = marking.to_vec();
            self.rules.rule(transition).fire(&mut after).ok_or(Exhausted::Tokens)?;
            // Intermediate semantics: a clock continues if its transition did not fire itself and
            // stayed enabled, also between the taking and the putting of tokens.
            let persists = |other: u32| {
                let old = enabled.binary_search(&other).ok()?;
                let continues = other != transition && self.rules.rule(other).is_enabled(&between);
                continues.then_some(old + 1)
            };
            let then: Vec<_> = self
                .enabled_transitions(&after)
                .into_iter()
                .map(|other| (other, persists(other)))
                .collect();
            let domain = domain.after_firing(&self.times, index + 1, enabled.len(), &then);
            fired.push((TransitionId(transition), after.into(), domain));
        }
        Ok(fired)
    }
}
