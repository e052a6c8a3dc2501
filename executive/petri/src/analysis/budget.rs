//! How much an analysis may cost. The library reads no clock: whoever asks says when to stop.

/// What an analysis may use.
#[derive(Clone, Copy)]
pub struct Budget<'a> {
    /// Most states that are kept.
    pub states: u64,
    /// Most bytes that states, their index and the way to them may take.
    pub memory_bytes: u64,
    /// Asked every few thousand states; true ends the analysis.
    pub stop: &'a dyn Fn() -> bool,
}

impl std::fmt::Debug for Budget<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Budget")
            .field("states", &self.states)
            .field("memory_bytes", &self.memory_bytes)
            .finish_non_exhaustive()
    }
}

impl Budget<'_> {
    /// As much as it takes.
    pub const UNLIMITED: Budget<'static> =
        Budget { states: u64::MAX, memory_bytes: u64::MAX, stop: &|| false };
}

/// Which budget ran out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Exhausted {
    /// More states than were allowed.
    #[error("more states than allowed")]
    States,
    /// More memory than was allowed.
    #[error("more memory than allowed")]
    Memory,
    /// The caller said stop.
    #[error("more time than allowed")]
    Time,
    /// A place would hold more than 4,294,967,295 tokens.
    #[error("a place would hold more tokens than can be counted")]
    Tokens,
    /// The times of the net, in their common unit, are more than can be counted.
    #[error("times too far apart to be counted in one unit")]
    Scale,
}
