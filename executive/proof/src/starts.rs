//! The second halves of firings that may have to wait: components that exclude each other, in
//! places that can be marked together.

use std::borrow::Cow;

use armor_petri::PlaceId;

use crate::analysed::Analysed;

/// Tokens that are put once nothing is in their way.
#[derive(Clone, Debug)]
pub(super) struct DelayedStart {
    /// Where they are until then.
    pub place: PlaceId,
    /// Places that have to be empty.
    pub unless: Vec<PlaceId>,
    /// Goal and safe place: where they are marked it is over, and nothing is put any more.
    pub ends: Vec<PlaceId>,
    /// Where they go.
    pub to: Vec<(PlaceId, u32)>,
}

impl DelayedStart {
    /// Whether it is in its own way.
    pub fn is_impossible(&self) -> bool {
        self.to.iter().any(|arc| self.unless.contains(&arc.0))
    }

    /// What it waits for in a marking, if it is under way.
    pub fn waits_for(&self, marking: &[u32]) -> Option<PlaceId> {
        let own = self.to.iter().map(|arc| arc.0).find(|place| self.unless.contains(place));
        let mut unless = self.unless.iter().chain(&self.ends).copied();
        let marked = || unless.find(|place| marking[place.index()] > 0);
        if marking[self.place.index()] > 0 { own.or_else(marked) } else { None }
    }
}

impl Analysed {
    /// A marking with all tokens put that nothing is in the way of: that takes no time.
    pub(super) fn settle_marking<'a>(&self, marking: &'a [u32]) -> Cow<'a, [u32]> {
        let mut settled = Cow::Borrowed(marking);
        for start in &self.starts {
            while settled[start.place.index()] > 0 && start.waits_for(&settled).is_none() {
                let settled = settled.to_mut();
                settled[start.place.index()] -= 1;
                for &(place, tokens) in &start.to {
                    settled[place.index()] = settled[place.index()].saturating_add(tokens);
                }
            }
        }
        settled
    }
}
