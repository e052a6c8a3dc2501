//! What a net is: places, transitions, the arcs between them, and when a transition may fire.
//!
//! A net never changes once built; [`crate::State`] holds what does.

use std::collections::HashMap;
use std::time::Duration;

/// A place of one net, numbered in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PlaceId(pub u32);

/// A transition of one net, numbered in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TransitionId(pub u32);

impl PlaceId {
    /// The position in [`Net::places`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl TransitionId {
    /// The position in [`Net::transitions`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Which transitions come first, whatever their priority.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Fires before every ordinary one.
    Safety,
    /// What is not about safety.
    #[default]
    Ordinary,
}

/// How long after becoming enabled a transition may and must fire (Merlin): `[earliest, latest]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interval {
    /// Not before this.
    pub earliest: Duration,
    /// Not after this; `None` is without end.
    pub latest: Option<Duration>,
}

impl Interval {
    /// `[0, 0]`: at once.
    pub const IMMEDIATE: Self = Self { earliest: Duration::ZERO, latest: Some(Duration::ZERO) };

    /// `[after, after]`: a timeout.
    pub fn exactly(after: Duration) -> Self {
        Self { earliest: after, latest: Some(after) }
    }
}

/// One transition: its arcs and its terms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transition {
    /// Its name, unique among the transitions of the net.
    pub name: String,
    /// Tokens it takes, and therefore needs; each place once.
    pub inputs: Vec<(PlaceId, u32)>,
    /// Tokens it puts; each place once.
    pub outputs: Vec<(PlaceId, u32)>,
    /// Tokens that must be there and stay.
    pub reads: Vec<(PlaceId, u32)>,
    /// It waits while a place holds this many or more.
    pub inhibitors: Vec<(PlaceId, u32)>,
    /// Places it empties, after taking its inputs and before putting its outputs.
    pub resets: Vec<PlaceId>,
    /// Safety first.
    pub class: Class,
    /// The greater one first, within a class.
    pub priority: i32,
    /// When, counted from the moment it became enabled.
    pub interval: Interval,
    /// True: enabled only while the caller holds its gate open (an event, a guard, an operator).
    pub gated: bool,
}

/// What makes a description of a net not a net.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetError {
    /// Two places or two transitions with one name.
    #[error("the name `{0}` is used twice")]
    DuplicateName(String),
    /// An arc to a place that the net does not have.
    #[error("transition `{transition}` has an arc to place number {place}, which is not there")]
    UnknownPlace {
        /// Whose arc.
        transition: String,
        /// The number.
        place: u32,
    },
    /// An arc that moves or tests nothing.
    #[error("transition `{0}` has an arc of weight 0")]
    ZeroWeight(String),
    /// Arcs between the same two, together more than a place can hold.
    #[error("the arcs of transition `{0}` together weigh more than 4,294,967,295")]
    WeightTooLarge(String),
    /// The latest moment is before the earliest.
    #[error("transition `{0}` must fire before it may")]
    EmptyInterval(String),
}

/// A test of one place's tokens that a transition needs to pass.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Test {
    AtLeast(u32),
    Below(u32),
}

impl Test {
    pub(crate) fn passes(self, tokens: u32) -> bool {
        match self {
            Self::AtLeast(weight) => tokens >= weight,
            Self::Below(weight) => tokens < weight,
        }
    }
}

/// A Petri net with weights, read, inhibitor and reset arcs, classes, priorities and intervals.
#[derive(Clone, Debug)]
pub struct Net {
    places: Vec<String>,
    initial: Vec<u32>,
    transitions: Vec<Transition>,
    /// Per place, who must look again when its tokens change.
    pub(crate) watchers: Vec<Vec<(TransitionId, Test)>>,
    /// Per transition, its standing by class and priority; the smaller one first.
    pub(crate) ranks: Vec<u32>,
}

impl Net {
    /// Begins a description.
    pub fn builder() -> NetBuilder {
        NetBuilder::default()
    }

    /// Place names, in order.
    pub fn places(&self) -> &[String] {
        &self.places
    }

    /// Transitions, in order.
    pub fn transitions(&self) -> &[Transition] {
        &self.transitions
    }

    /// One transition.
    pub fn transition(&self, id: TransitionId) -> &Transition {
        &self.transitions[id.index()]
    }

    /// One place's name.
    pub fn place(&self, id: PlaceId) -> &str {
        &self.places[id.index()]
    }

    /// Tokens per place at the beginning.
    pub fn initial(&self) -> &[u32] {
        &self.initial
    }

    /// All transition ids, in order.
    pub fn transition_ids(&self) -> impl Iterator<Item = TransitionId> + use<> {
        (0..self.transitions.len() as u32).map(TransitionId)
    }
}

/// Describes a net piece by piece; [`NetBuilder::build`] checks it whole.
#[derive(Clone, Debug, Default)]
pub struct NetBuilder {
    places: Vec<String>,
    initial: Vec<u32>,
    transitions: Vec<Transition>,
}

impl NetBuilder {
    /// Adds a place holding `tokens` at the beginning.
    pub fn place(&mut self, name: impl Into<String>, tokens: u32) -> PlaceId {
        self.places.push(name.into());
        self.initial.push(tokens);
        PlaceId(self.places.len() as u32 - 1)
    }

    /// Adds an ordinary, immediate transition without arcs; the answer adds the rest.
    pub fn transition(&mut self, name: impl Into<String>) -> TransitionBuilder<'_> {
        self.transitions.push(Transition {
            name: name.into(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            reads: Vec::new(),
            inhibitors: Vec::new(),
            resets: Vec::new(),
            class: Class::Ordinary,
            priority: 0,
            interval: Interval::IMMEDIATE,
            gated: false,
        });
        let id = TransitionId(self.transitions.len() as u32 - 1);
        let transition = self.transitions.last_mut().expect("pushed a moment ago");
        TransitionBuilder { transition, id }
    }

    /// The net, if the description is one. Parallel arcs are added up.
    ///
    /// # Errors
    /// The first fault found.
    pub fn build(mut self) -> Result<Net, NetError> {
        unique(self.places.iter())?;
        unique(self.transitions.iter().map(|t| &t.name))?;
        for transition in &mut self.transitions {
            check(transition, self.places.len() as u32)?;
            let name = transition.name.clone();
            let merged = |arcs: &[_]| added_up(arcs).ok_or(NetError::WeightTooLarge(name.clone()));
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
            ranks: ranks(&self.transitions),
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
    transition: &'a mut Transition,
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

    /// Needs `weight` tokens in `place` and leaves them there.
    pub fn read(self, place: PlaceId, weight: u32) -> Self {
        self.transition.reads.push((place, weight));
        self
    }

    /// Waits while `place` holds `weight` or more tokens.
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
    pub fn class(self, class: Class) -> Self {
        self.transition.class = class;
        self
    }

    /// Sets the priority; the greater one fires first.
    pub fn priority(self, priority: i32) -> Self {
        self.transition.priority = priority;
        self
    }

    /// Sets when it may and must fire.
    pub fn interval(self, interval: Interval) -> Self {
        self.transition.interval = interval;
        self
    }

    /// Makes it wait for [`crate::State::set_gate`].
    pub fn gated(self) -> Self {
        self.transition.gated = true;
        self
    }

    /// Its id.
    pub fn id(self) -> TransitionId {
        self.id
    }
}

fn unique<'a>(names: impl Iterator<Item = &'a String>) -> Result<(), NetError> {
    let mut seen = std::collections::HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(NetError::DuplicateName(name.clone()));
        }
    }
    Ok(())
}

fn check(transition: &Transition, places: u32) -> Result<(), NetError> {
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

/// One arc per place, in the order of first mention; `None` when a sum does not fit.
fn added_up(arcs: &[(PlaceId, u32)]) -> Option<Vec<(PlaceId, u32)>> {
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

/// Class and priority as one small number, so that comparing two transitions is cheap.
fn ranks(transitions: &[Transition]) -> Vec<u32> {
    let standing = |t: &Transition| (t.class, std::cmp::Reverse(t.priority));
    let mut order: Vec<_> = transitions.iter().map(standing).collect();
    order.sort_unstable();
    order.dedup();
    let rank = |t| order.partition_point(|other| *other < standing(t)) as u32;
    transitions.iter().map(rank).collect()
}
