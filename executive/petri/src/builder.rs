//! Describing a net piece by piece, and the checks that make the description a net.

use crate::net::{
    FiringClass, FiringInterval, Net, NetError, NetTransition, PlaceId, Test, TransitionId,
};
use std::collections::HashMap;

/// Describes a net piece by piece; [`NetBuilder::build`] checks it whole.
#[derive(Clone, Debug, Default)]
pub struct NetBuilder {
    places: Vec<String>,
    initial: Vec<u32>,
    transitions: Vec<NetTransition>,
}

impl NetBuilder {
    /// Adds a place with `tokens` in the initial marking.
    pub fn place(&mut self, name: impl Into<String>, tokens: u32) -> PlaceId {
        self.places.push(name.into());
        self.initial.push(tokens);
        PlaceId(self.places.len() as u32 - 1)
    }

    /// Adds an ordinary, immediate transition without arcs; the returned builder adds the rest.
    pub fn transition(&mut self, name: impl Into<String>) -> TransitionBuilder<'_> {
        self.transitions.push(NetTransition {
            name: name.into(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            reads: Vec::new(),
            inhibitors: Vec::new(),
            resets: Vec::new(),
            class: FiringClass::Ordinary,
            priority: 0,
            interval: FiringInterval::IMMEDIATE,
            gated: false,
        });
        let id = TransitionId(self.transitions.len() as u32 - 1);
        let transition = self.transitions.last_mut().expect("pushed a moment ago");
        TransitionBuilder { transition, id }
    }

    /// Builds the net; the weights of parallel arcs are added up.
    ///
    /// # Errors
    /// The first fault found.
    pub fn build(mut self) -> Result<Net, NetError> {
        check_unique(self.places.iter())?;
        check_unique(self.transitions.iter().map(|t| &t.name))?;
        for transition in &mut self.transitions {
            check_transition(transition, self.places.len() as u32)?;
            let name = transition.name.clone();
            let merged =
                |arcs: &[_]| merge_arcs(arcs).ok_or(NetError::WeightTooLarge(name.clone()));
            transition.inputs = merged(&transition.inputs)?;
            transition.outputs = merged(&transition.outputs)?;
        }
        let mut watchers = vec![Vec::new(); self.places.len()];
        for (index, transition) in self.transitions.iter().enumerate() {
            let id = TransitionId(index as u32);
            for &(place, weight) in transition.inputs.iter().chain(&transition.reads) {
                watchers[place.index()].push((id, Test::AtLeast(weight)));
            }
            for &(place, weight) in &transition.inhibitors {
                watchers[place.index()].push((id, Test::Below(weight)));
            }
        }
        Ok(Net {
            ranks: compute_ranks(&self.transitions),
            places: self.places,
            initial: self.initial,
            transitions: self.transitions,
            watchers,
        })
    }
}

/// Completes one transition of a [`NetBuilder`].
#[derive(Debug)]
pub struct TransitionBuilder<'a> {
    transition: &'a mut NetTransition,
    id: TransitionId,
}

impl TransitionBuilder<'_> {
    /// Takes `weight` tokens from `place`.
    pub fn input(self, place: PlaceId, weight: u32) -> Self {
        self.transition.inputs.push((place, weight));
        self
    }

    /// Puts `weight` tokens into `place`.
    pub fn output(self, place: PlaceId, weight: u32) -> Self {
        self.transition.outputs.push((place, weight));
        self
    }

    /// Requires `weight` tokens in `place` and leaves them.
    pub fn read(self, place: PlaceId, weight: u32) -> Self {
        self.transition.reads.push((place, weight));
        self
    }

    /// Is disabled while `place` holds `weight` or more tokens.
    pub fn inhibitor(self, place: PlaceId, weight: u32) -> Self {
        self.transition.inhibitors.push((place, weight));
        self
    }

    /// Empties `place`.
    pub fn reset(self, place: PlaceId) -> Self {
        self.transition.resets.push(place);
        self
    }

    /// Sets the class.
    pub fn class(self, class: FiringClass) -> Self {
        self.transition.class = class;
        self
    }

    /// Sets the priority; the greater one fires first.
    pub fn priority(self, priority: i32) -> Self {
        self.transition.priority = priority;
        self
    }

    /// Sets when it may and must fire.
    pub fn interval(self, interval: FiringInterval) -> Self {
        self.transition.interval = interval;
        self
    }

    /// Gives it a gate, which [`crate::NetState::set_gate`] opens and closes.
    pub fn gated(self) -> Self {
        self.transition.gated = true;
        self
    }

    /// Returns its id.
    pub fn id(self) -> TransitionId {
        self.id
    }
}

fn check_unique<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), NetError> {
    let mut seen = std::collections::HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(NetError::DuplicateName(name.clone()));
        }
    }
    Ok(())
}

fn check_transition(transition: &NetTransition, places: u32) -> Result<(), NetError> {
    let name = || transition.name.clone();
    let weighted =
        [&transition.inputs, &transition.outputs, &transition.reads, &transition.inhibitors];
    for &(place, weight) in weighted.into_iter().flatten() {
        if weight == 0 {
            return Err(NetError::ZeroWeight(name()));
        }
        if place.0 >= places {
            return Err(NetError::UnknownPlace { transition: name(), place: place.0 });
        }
    }
    if let Some(place) = transition.resets.iter().find(|place| place.0 >= places) {
        return Err(NetError::UnknownPlace { transition: name(), place: place.0 });
    }
    match transition.interval.latest {
        Some(latest) if latest < transition.interval.earliest => {
            Err(NetError::EmptyInterval(name()))
        }
        _ => Ok(()),
    }
}

/// Merges parallel arcs into one per place, in the order of first mention; `None` if a sum
/// overflows.
fn merge_arcs(arcs: &[(PlaceId, u32)]) -> Option<Vec<(PlaceId, u32)>> {
    let mut merged: Vec<(PlaceId, u32)> = Vec::with_capacity(arcs.len());
    let mut position = HashMap::new();
    for &(place, weight) in arcs {
        let index = *position.entry(place).or_insert(merged.len());
        match merged.get_mut(index) {
            Some(arc) => arc.1 = arc.1.checked_add(weight)?,
            None => merged.push((place, weight)),
        }
    }
    Some(merged)
}

/// Returns class and priority of each transition as one number, so that comparing two is cheap.
fn compute_ranks(transitions: &[NetTransition]) -> Vec<u32> {
    let standing = |t: &NetTransition| (t.class, std::cmp::Reverse(t.priority));
    let mut order: Vec<_> = transitions.iter().map(standing).collect();
    order.sort_unstable();
    order.dedup();
    let rank = |t| order.partition_point(|other| *other < standing(t)) as u32;
    transitions.iter().map(rank).collect()
}
