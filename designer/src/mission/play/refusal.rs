//! Why a transition is not fired by hand.

use std::time::Duration;

use armor_petri::{PlaceId, TransitionId};
use armor_proof::time_in_words as time;

use super::Play;

/// Why a transition was not fired by hand.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotNow {
    /// Tokens are missing, or present in an inhibitor place.
    #[error("{transition} cannot fire: {why}")]
    Tokens {
        /// Which one.
        transition: String,
        /// Which tokens.
        why: String,
    },
    /// Another transition must have fired before its time comes.
    #[error("{transition} may fire at {at}, but {first} must fire before, by {by}", at = time(*at), by = time(*by))]
    Overtaken {
        /// Which one.
        transition: String,
        /// When it may.
        at: Duration,
        /// The transition that fires first.
        first: String,
        /// Its deadline.
        by: Duration,
    },
    /// A place would hold more tokens than can be counted.
    #[error("{0} would overflow a place's token count")]
    Overflow(String),
}

impl Play {
    /// Whether no other must fire before `at`.
    pub(super) fn may_wait_until(&self, id: TransitionId, at: Duration) -> Result<(), NotNow> {
        let state = &self.now.state;
        let others = state.enabled().filter(|other| *other != id);
        let first = others.filter_map(|other| Some((state.deadline(other)?, other))).min();
        match first.filter(|(by, _)| *by < at) {
            None => Ok(()),
            Some((by, first)) => Err(NotNow::Overtaken {
                transition: self.stage.name(id).to_owned(),
                at,
                first: self.stage.name(first).to_owned(),
                by,
            }),
        }
    }

    /// Which tokens a transition misses.
    pub(super) fn lacks(&self, id: TransitionId) -> NotNow {
        let transition = self.stage.net.transition(id);
        let name = |place: PlaceId| self.stage.net.place(place);
        let tokens = |place: PlaceId| self.marking()[place.index()];
        let wanted = transition.inputs.iter().chain(&transition.reads);
        let missing =
            wanted.filter(|(place, weight)| tokens(*place) < *weight).map(|(place, n)| {
                let has = tokens(*place);
                match n {
                    1 => format!("no token in {}", name(*place)),
                    n => format!("{} has {has} of {n} tokens", name(*place)),
                }
            });
        let inhibitors = transition.inhibitors.iter();
        let in_the_way = inhibitors.filter(|(place, weight)| tokens(*place) >= *weight);
        let in_the_way = in_the_way.map(|(place, _)| {
            let is_end = [self.stage.goal, self.stage.safe].contains(&Some(*place));
            match is_end {
                true => format!("the mission is over in {}", name(*place)),
                false => format!("the tokens in {} inhibit it", name(*place)),
            }
        });
        let why = missing.chain(in_the_way).collect::<Vec<_>>().join(", ");
        NotNow::Tokens { transition: transition.name.clone(), why }
    }
}
