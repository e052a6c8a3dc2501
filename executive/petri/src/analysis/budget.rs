//! Limits on the cost of an analysis. The library reads no clock: the caller decides when to stop.

use std::cell::Cell;

/// The limits of an analysis.
#[derive(Clone, Copy)]
pub struct AnalysisBudget<'a> {
    /// Most states that are stored.
    pub states: u64,
    /// Most bytes for states, their index and the firings that lead to them.
    pub memory_bytes: u64,
    /// Called every few thousand states; returning true ends the analysis.
    pub stop: &'a dyn Fn() -> bool,
    /// Counts what is explored: states, state classes, and classes of a search for durations.
    pub explored: Option<&'a Cell<u64>>,
}

impl std::fmt::Debug for AnalysisBudget<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Budget")
            .field("states", &self.states)
            .field("memory_bytes", &self.memory_bytes)
            .finish_non_exhaustive()
    }
}

impl AnalysisBudget<'_> {
    /// No limits.
    pub const UNLIMITED: AnalysisBudget<'static> = AnalysisBudget {
        states: u64::MAX,
        memory_bytes: u64::MAX,
        stop: &|| false,
        explored: None,
    };

    /// Counts one more.
    pub(super) fn count_explored(&self) {
        if let Some(explored) = self.explored {
            explored.set(explored.get() + 1);
        }
    }
}

/// Which budget ran out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Exhausted {
    /// The limit of states.
    #[error("more states than allowed")]
    States,
    /// The limit of memory.
    #[error("more memory than allowed")]
    Memory,
    /// The caller ended the analysis.
    #[error("more time than allowed")]
    Time,
    /// A place would hold more than 4,294,967,295 tokens.
    #[error("a place would hold more tokens than can be counted")]
    Tokens,
    /// The times of the net, in their common unit, do not fit an integer.
    #[error("times too far apart to be counted in one unit")]
    Scale,
}
