//! The absolute dates of transitions.

use crate::word::words;
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
    /// What it does if the last date passes unused.
    pub missed: MissedAction,
    /// Where the present is relative to the dates.
    pub phase: DateWindow,
    /// Whether the transition has fired.
    pub used: bool,
    /// When the next of its dates comes, by the clock as it is now.
    #[message(unit = "s")]
    pub next_at_s: Option<f64>,
}

words! {
    /// What a transition does when its last date passes before it has fired.
    pub enum MissedAction {
        /// It fires once, late.
        Fire = "fire",
        /// It does not fire any more.
        Skip = "skip",
        /// The mission goes to its safe place as soon as tokens wait for the transition.
        Fail = "fail",
    }
}

words! {
    /// Where the present is relative to the dates of a transition.
    pub enum DateWindow {
        /// Before the first date.
        Early = "early",
        /// Between the dates.
        Open = "open",
        /// After the last date.
        Past = "past",
    }
}
