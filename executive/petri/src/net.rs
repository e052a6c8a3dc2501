//! What a net is: places, transitions, the arcs between them, and when a transition may fire.
//!
//! A net never changes once built; [`crate::State`] holds what does.

use crate::builder::NetBuilder;
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

    /// `[0, w[`: at any time, as in a net that says nothing about time.
    pub const UNTIMED: Self = Self { earliest: Duration::ZERO, latest: None };

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

impl NetError {
    /// The transition it is about, if it is about one.
    pub fn transition(&self) -> Option<&str> {
        match self {
            Self::DuplicateName(_) => None,
            Self::UnknownPlace { transition: name, .. }
            | Self::ZeroWeight(name)
            | Self::WeightTooLarge(name)
            | Self::EmptyInterval(name) => Some(name),
        }
    }
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
    pub(crate) places: Vec<String>,
    pub(crate) initial: Vec<u32>,
    pub(crate) transitions: Vec<Transition>,
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

    /// The same net, beginning with `marking`: one number of tokens per place.
    ///
    /// # Panics
    /// If there are not as many numbers as places.
    #[must_use]
    pub fn starting_at(&self, marking: Vec<u32>) -> Self {
        assert_eq!(marking.len(), self.places.len(), "one number of tokens per place");
        Self { initial: marking, ..self.clone() }
    }

    /// All transition ids, in order.
    pub fn transition_ids(&self) -> impl Iterator<Item = TransitionId> + use<> {
        (0..self.transitions.len() as u32).map(TransitionId)
    }
}
