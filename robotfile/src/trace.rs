//! What a proof shows as data: a sequence of firings, and the duration of a mission.

use serde::Serialize;

/// Firings from the start of the mission, by name, and those that can repeat forever after them.
///
/// A name is a transition's, or `transition/on-stop-fail`, `transition/on-start-fail` and
/// `place/on-failure` for the consequences of a component that does not stop, start or last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FiringTrace {
    /// The firings, in their order.
    pub firings: Vec<String>,
    /// The firings that repeat forever after them; usually none.
    pub circle: Vec<String>,
    /// Whether each transition fires as late as it may, to show that something takes too long;
    /// otherwise as early as it may.
    pub is_late: bool,
}

/// The shortest time until the goal is marked, and the longest until the mission ends.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MissionDuration {
    /// The shortest time to the goal, in seconds.
    pub shortest_s: f64,
    /// Firings that take the shortest time.
    pub shortest_trace: Vec<String>,
    /// The longest time until the goal or the safe place is marked, in seconds; none if there is no
    /// upper bound.
    pub longest_s: Option<f64>,
    /// Firings that take the longest time; without a bound, the firings before the endless part.
    pub longest_trace: Vec<String>,
    /// Without a bound, the firings that can repeat forever after `longest_trace`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub longest_circle: Vec<String>,
    /// Whether the mission can only end at the goal.
    pub always_goal: bool,
}
