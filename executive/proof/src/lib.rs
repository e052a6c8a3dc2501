//! What is proven of a mission before it runs, with a trace that leads there where a check fails.
//!
//! The state space is explored first without times, priorities, guards and reports. They only
//! remove behaviour, so what is unreachable here is unreachable in every run. What is reachable
//! here is examined again with its times, where these can be followed within the budget.

mod analysed;
mod asking;
mod blamed;
mod claims;
mod dead;
mod durations;
mod exclusive;
mod formula;
mod general;
mod ignored_ends;
mod immediate;
mod large;
mod marked_pairs;
mod meetings;
mod misplaced;
mod outside;
mod precedence;
mod preempted;
mod proof;
mod prove;
mod repair;
mod routes;
mod starts;
mod sums;
#[cfg(test)]
mod tests;
mod ties;
mod unfolding;
mod unmet;
mod values;
mod verdict;
mod witness;
mod wording;

pub use analysed::Analysed;
pub use armor_robotfile::time_in_words;
pub use proof::{MAX_BYTES, MAX_CLASSES, MAX_STATES};
pub use prove::{prove, prove_from_here, prove_without_notes};
pub use repair::{Recheck, explain_by_edit};
