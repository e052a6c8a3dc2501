//! When the components of a mission are active, from its arcs alone.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use crate::check::concurrency::PlaceConcurrency;
use crate::mission::{ArcKind, Mission, Place, Transition};

/// Pairs of places that are looked at, so that the checks take milliseconds for any file.
const MAX_PAIRS: usize = 2_000_000;

/// When the components of a mission are active. Where two places might be marked together, it takes
/// for granted that they may.
pub(super) struct Activity<'a> {
    pub(super) mission: &'a Mission,
    pub(super) together: PlaceConcurrency<'a>,
    /// The places of each component that the mission controls.
    active_in: BTreeMap<&'a str, Vec<&'a str>>,
    /// The pairs of places that were looked at.
    pairs: Cell<usize>,
}

impl<'a> Activity<'a> {
    /// Of a mission, which contains its sub-missions; none if it is too large.
    pub(super) fn of(mission: &'a Mission) -> Option<Self> {
        let together = PlaceConcurrency::of(mission)?;
        let mut active_in: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for place in &mission.places {
            for component in &place.components {
                active_in.entry(&component.value).or_default().push(&place.name.value);
            }
        }
        Some(Self { mission, together, active_in, pairs: Cell::new(0) })
    }

    /// The places that activate the component; none if the mission does not control it.
    pub(super) fn places_of(&self, component: &str) -> Option<&[&'a str]> {
        self.active_in.get(component).map(Vec::as_slice)
    }

    /// Whether the component may be active while all of these places are marked; none if the mission
    /// does not control it, or if too much was looked at.
    pub(super) fn may_be_active(&self, component: &str, places: &BTreeSet<&str>) -> Option<bool> {
        let active = self.active_in.get(component)?;
        self.count_pairs(active.len() * places.len())?;
        let may =
            |active: &&str| places.iter().all(|place| self.together.may_be_together(active, place));
        Some(active.iter().any(may))
    }

    /// Counts pairs that are to be looked at; none if they are too many.
    pub(super) fn count_pairs(&self, more: usize) -> Option<()> {
        self.pairs.set(self.pairs.get().saturating_add(more));
        (self.pairs.get() <= MAX_PAIRS).then_some(())
    }

    pub(super) fn place(&self, name: &str) -> Option<&'a Place> {
        self.mission.place(name)
    }
}

/// The places that must be marked for the transition to fire.
pub(super) fn needed_places(transition: &Transition) -> BTreeSet<&str> {
    let arcs = transition.arcs.iter();
    let needed = arcs.filter(|arc| matches!(arc.kind, ArcKind::Take | ArcKind::Read));
    needed.map(|arc| arc.place.value.as_str()).collect()
}
