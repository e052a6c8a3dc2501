//! The absolute dates of transitions.

use armor_wire::Message;

/// The dates of a transition and their phase.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct DateStand {
    /// The transition.
    pub transition: String,
    /// Its first date, in UTC, such as `2026-11-21T14:30:00Z`.
    pub not_before: Option<String>,
    /// Its last date, in UTC.
    pub not_after: Option<String>,
    /// What becomes of it if the last date passes unused: `fire`, `skip` or `fail`.
    pub missed: String,
    /// `early`, `open`, or `past`.
    pub phase: String,
    /// Whether the transition has fired.
    pub used: bool,
    /// When the next of its dates comes, by the clock as it is now.
    #[message(unit = "s")]
    pub next_at_s: Option<f64>,
}
