//! Places of components that exclude each other, where they can be marked together.

use armor_petri::PlaceId;
use armor_petri::analysis::invariants::excluding_sum;

use crate::proof::Proof;
use crate::starts::DelayedStart;

impl Proof<'_> {
    /// The pairs of places with components that exclude each other of which it is not known that
    /// they are never marked together.
    pub(super) fn meeting_places(&self) -> Vec<[PlaceId; 2]> {
        let mut pairs: Vec<_> = self.exclusive_places().into_iter().map(|pair| pair.1).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs.retain(|[one, other]| {
            let together = |marking: &[u32]| marking[one.index()] > 0 && marking[other.index()] > 0;
            if self.is_whole() {
                self.find_witness(&together).is_some()
            } else {
                excluding_sum(self.token_sums(), self.net, *one, *other).is_none()
            }
        });
        pairs
    }

    /// The starts that are under way in a marking, to follow its marked places.
    pub(super) fn waiting_starts(&self, marking: &[u32]) -> String {
        let is_first = |start: &&DelayedStart| marking[start.place.index()] > 0;
        let mut waits = self.analysed.starts.iter().filter(is_first);
        let waiting = waits.find_map(|start| Some((start, start.waits_for(marking)?)));
        let Some((start, place)) = waiting else { return String::new() };
        let to: Vec<_> = start.to.iter().map(|arc| self.net.place(arc.0)).collect();
        format!(
            ", and one on its way into {}, which waits until {} is left: their components exclude each other",
            to.join(" "),
            self.net.place(place)
        )
    }
}
