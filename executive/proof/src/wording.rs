//! Firing sequences, markings and times in words and as data.

use armor_petri::analysis::{Exhausted, ExplorationEnd};
use armor_petri::{PlaceId, TransitionId};
use armor_robotfile::FiringTrace;

use crate::proof::Proof;
use crate::witness::Witness;

/// Firings of a path that a message names; the finding's data has all of them.
const MAX_NAMED: usize = 12;

impl Proof<'_> {
    /// "after a, b" for firings from the start.
    pub(super) fn after_firings(&self, path: &[TransitionId]) -> String {
        if path.is_empty() { "at the start".into() } else { format!("after {}", self.names(path)) }
    }

    /// "after a, b tokens are in x, y".
    pub(super) fn comes_to(&self, seen: &Witness) -> String {
        format!("{} there {}", self.after_firings(&seen.path), self.marked_in_words(&seen.marking))
    }

    /// "is a token in x", "are tokens in x, y".
    pub(super) fn marked_in_words(&self, marking: &[u32]) -> String {
        match self.analysed.tokens(marking).iter().sum::<u32>() {
            1 => format!("is a token in {}", self.marked_names(marking)),
            0 => format!("is no token{}", self.counters_in_words(marking)),
            _ => format!("are tokens in {}", self.marked_names(marking)),
        }
    }

    /// The marked places.
    pub(super) fn marked_names(&self, marking: &[u32]) -> String {
        let tokens = self.analysed.tokens(marking);
        let marked = tokens.iter().enumerate().filter(|(_, tokens)| **tokens > 0);
        let name = |(place, tokens): (usize, &u32)| match tokens {
            1 => self.net.place(PlaceId(place as u32)).to_owned(),
            n => format!("{} ({n})", self.net.place(PlaceId(place as u32))),
        };
        let names: Vec<_> = marked.map(name).collect();
        let names = if names.is_empty() { "no place".into() } else { names.join(", ") };
        names + &self.counters_in_words(marking)
    }

    /// ", with round at 2": the variables that are followed.
    fn counters_in_words(&self, marking: &[u32]) -> String {
        let values =
            self.analysed.values(marking).map(|(name, value)| format!("{name} at {value}"));
        let values: Vec<_> = values.collect();
        if values.is_empty() { String::new() } else { format!(", with {}", values.join(", ")) }
    }

    /// The first firings by name, and how many more there are.
    pub(super) fn names(&self, path: &[TransitionId]) -> String {
        let path = self.all_names(path);
        let named: Vec<_> = path.iter().take(MAX_NAMED).map(String::as_str).collect();
        let more = path.len().saturating_sub(MAX_NAMED);
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        named.join(", ") + &rest
    }

    pub(super) fn name(&self, transition: TransitionId) -> &str {
        &self.analysed.shown[transition.index()]
    }

    /// All firings by name.
    pub(super) fn all_names(&self, path: &[TransitionId]) -> Vec<String> {
        // Second halves of firings have none.
        let names = path.iter().map(|id| self.name(*id)).filter(|name| !name.is_empty());
        names.map(ToOwned::to_owned).collect()
    }

    /// A firing sequence as data.
    pub(super) fn trace_of(&self, path: &[TransitionId], circle: &[TransitionId]) -> FiringTrace {
        FiringTrace {
            firings: self.all_names(path),
            circle: self.all_names(circle),
            is_late: false,
        }
    }

    /// What a budget that ran out means for what was asked.
    pub(super) fn budget_ran_out(&self, why: Exhausted) -> String {
        match self.exploration.ending {
            ExplorationEnd::Unbounded(_) => {
                format!("the mission fills places without end, and {why}")
            }
            _ => why.to_string(),
        }
    }
}
