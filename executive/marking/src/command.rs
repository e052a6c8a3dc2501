//! Who commands the mission: the pause, the lease, open questions and the last orders.

use crate::word::words;
use armor_wire::Message;

/// A pause of the mission.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct Paused {
    /// Who ordered it; `the executive` itself after a restart.
    pub by: String,
    /// Since when.
    #[message(unit = "s")]
    pub since_at_s: f64,
    /// Whether everything that was to come to rest has confirmed it.
    pub at_rest: bool,
}

/// Who commands the mission.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct Holder {
    /// The person.
    pub author: String,
    /// The process, with its host if that is another one.
    pub from: String,
    /// Since when.
    #[message(unit = "s")]
    pub since_at_s: f64,
    /// Whether that process is connected.
    pub connected: bool,
    /// When the lease runs out if it does not come back.
    #[message(unit = "s")]
    pub runs_out_at_s: Option<f64>,
}

/// A transition that asks before it fires.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct Confirmation {
    /// The transition.
    pub transition: String,
    /// Since when it asks.
    #[message(unit = "s")]
    pub asked_at_s: f64,
    /// Until when an answer is waited for, if not for ever.
    #[message(unit = "s")]
    pub answer_by_at_s: Option<f64>,
    /// What it does without an answer.
    pub unanswered: UnansweredAction,
    /// Whether that time stands still, in a pause or until the operator is back.
    pub put_off: bool,
}

words! {
    /// What a transition does when no operator answers its question in time.
    pub enum UnansweredAction {
        /// It fires.
        Fire = "fire",
        /// It does not fire.
        Decline = "decline",
    }
}

/// An order that was given.
#[derive(Message, Clone, Debug, PartialEq)]
#[message(wire = "armor_wire")]
pub struct OrderGiven {
    /// When.
    #[message(unit = "s")]
    pub given_at_s: f64,
    /// The person who gave it.
    pub author: String,
    /// What was to be done, in words.
    pub order: String,
    /// Whether it was.
    pub accepted: bool,
    /// What followed from it, or why it was refused.
    pub text: String,
}
