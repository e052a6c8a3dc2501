//! What a net is: places, transitions, the arcs between them, and when a transition may fire.
//!
//! A built net is immutable; [`crate::NetState`] has what changes.

use crate::builder::NetBuilder;
use std::time::Duration;

/// A place of one net, numbered in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PlaceId(pub u32);

/// A transition of one net, numbered in the order of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TransitionId(pub u32);

impl PlaceId {
    /// Returns the position in [`Net::places`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl TransitionId {
    /// Returns the position in [`Net::transitions`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The class of a transition, which decides conflicts before its priority does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FiringClass {
    /// Fires before every ordinary one.
    Safety,
    /// Every other transition.
    #[default]
    Ordinary,
}

/// How long after becoming enabled a transition may and must fire (Merlin): `[earliest, latest]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FiringInterval {
    /// The earliest moment.
    pub earliest: Duration,
    /// The latest moment; `None` for no limit.
    pub latest: Option<Duration>,
}

impl FiringInterval {
    /// `[0, 0]`: as soon as it is enabled.
    pub const IMMEDIATE: Self = Self { earliest: Duration::ZERO, latest: Some(Duration::ZERO) };

    /// `[0, w[`: at any time, as in a net without times.
    pub const UNTIMED: Self = Self { earliest: Duration::ZERO, latest: None };

    /// `[after, after]`: a timeout.
    pub fn exactly(after: Duration) -> Self {
        Self { earliest: after, latest: Some(after) }
    }
}

/// One transition: its arcs and its firing conditions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetTransition {
    /// Its name, unique among the transitions of the net.
    pub name: String,
    /// Tokens it takes, and so requires; each place at most once.
    pub inputs: Vec<(PlaceId, u32)>,
    /// Tokens it puts; each place at most once.
    pub outputs: Vec<(PlaceId, u32)>,
    /// Tokens it requires and leaves in place (read arcs).
    pub reads: Vec<(PlaceId, u32)>,
    /// It is disabled while a place holds this many tokens or more (inhibitor arcs).
    pub inhibitors: Vec<(PlaceId, u32)>,
    /// Places it empties, after taking its inputs and before putting its outputs.
    pub resets: Vec<PlaceId>,
    /// Decides conflicts first: safety before ordinary.
    pub class: FiringClass,
    /// Decides conflicts within a class: the greater one fires first.
    pub priority: i32,
    /// When it may and must fire, counted from the moment it became enabled.
    pub interval: FiringInterval,
    /// Whether it is enabled only while the caller keeps its gate open (an event, a guard, an
    /// operator).
    pub gated: bool,
}

/// Why a description is not a valid net.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetError {
    /// Two places or two transitions with one name.
    #[error("the name `{0}` is used twice")]
    DuplicateName(String),
    /// An arc to a place that the net does not have.
    #[error("transition `{transition}` has an arc to place number {place}, which does not exist")]
    UnknownPlace {
        /// The transition with the arc.
        transition: String,
        /// The number of the place.
        place: u32,
    },
    /// An arc that moves or tests nothing.
    #[error("transition `{0}` has an arc of weight 0")]
    ZeroWeight(String),
    /// Parallel arcs whose weights add up to more than a place can hold.
    #[error("the arcs of transition `{0}` together weigh more than 4,294,967,295")]
    WeightTooLarge(String),
    /// The latest moment is before the earliest.
    #[error("transition `{0}` has a latest moment before its earliest")]
    EmptyInterval(String),
}

impl NetError {
    /// Returns the transition it is about, if it is about one.
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

/// A condition on the tokens of one place, which a transition requires.
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
    pub(crate) transitions: Vec<NetTransition>,
    /// Per place, the transitions to check when its tokens change, each with its condition.
    pub(crate) watchers: Vec<Vec<(TransitionId, Test)>>,
    /// Per transition, its rank by class and priority; the smaller rank fires first.
    pub(crate) ranks: Vec<u32>,
}

impl Net {
    /// Returns an empty description.
    pub fn builder() -> NetBuilder {
        NetBuilder::default()
    }

    /// Returns the names of the places, in order.
    pub fn places(&self) -> &[String] {
        &self.places
    }

    /// Returns the transitions, in order.
    pub fn transitions(&self) -> &[NetTransition] {
        &self.transitions
    }

    /// Returns one transition.
    pub fn transition(&self, id: TransitionId) -> &NetTransition {
        &self.transitions[id.index()]
    }

    /// Returns the name of one place.
    pub fn place(&self, id: PlaceId) -> &str {
        &self.places[id.index()]
    }

    /// Returns the initial marking: tokens per place.
    pub fn initial(&self) -> &[u32] {
        &self.initial
    }

    /// Returns the same net with the initial marking `marking`: one number of tokens per place.
    ///
    /// # Panics
    /// If the numbers are not as many as the places.
    #[must_use]
    pub fn starting_at(&self, marking: Vec<u32>) -> Self {
        assert_eq!(marking.len(), self.places.len(), "one number of tokens per place");
        Self { initial: marking, ..self.clone() }
    }

    /// Returns the ids of all transitions, in order.
    pub fn transition_ids(&self) -> impl Iterator<Item = TransitionId> + use<> {
        (0..self.transitions.len() as u32).map(TransitionId)
    }
}
