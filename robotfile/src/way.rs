//! What a proof shows as data: a firing sequence, and how long a mission takes.

use serde::Serialize;

/// Firings from the start of the mission, by name, and those that can go on for ever after them.
///
/// A name is a transition's, or `transition/on-stop-fail`, `transition/on-start-fail` and
/// `place/on-failure` for what the file says of components that do not stop, start or last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// In their order.
    pub firings: Vec<String>,
    /// Repeated without end after that; mostly none.
    pub circle: Vec<String>,
    /// Whether each fires as late as it may, as what takes too long does; else as early.
    pub is_late: bool,
}

/// How soon the goal can come, and how late the mission must be over.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Takes {
    /// Least time to the goal, in seconds.
    pub shortest_s: f64,
    /// A way that takes it.
    pub shortest_way: Vec<String>,
    /// Most time until the goal or the safe place is marked, in seconds; none if there is no most.
    pub longest_s: Option<f64>,
    /// A way that takes it; without a most, the way after which nothing ends it.
    pub longest_way: Vec<String>,
    /// Without a most, what can go on for ever after that way.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub longest_circle: Vec<String>,
    /// Whether the mission can only end at the goal.
    pub always_goal: bool,
}
