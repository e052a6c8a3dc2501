//! The orders of operators, as the journal keeps them.

use armor_sdk::control;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The operator who gives an order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Giver {
    /// The person.
    pub author: String,
    /// The name of the process.
    pub from: String,
    /// The start of that process.
    pub instance: u64,
}

/// An order to the mission.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MissionOrder {
    /// Take the lease: only its holder may give most orders.
    Lease,
    /// Return the lease.
    Release,
    /// Fire an operator's transition.
    Fire(String),
    /// Pause: clocks and components stop, except those of the safety class.
    Pause,
    /// End the pause.
    Resume,
    /// Go to the safe place.
    Safe,
    /// Move tokens, all of them in one step.
    Move(Vec<MovedTokens>),
    /// Allow the firing of a transition that asks.
    Confirm(String),
    /// Refuse the firing of a transition that asks.
    Decline(String),
    /// Keep the lease over a new connection.
    Rejoin,
}

/// Tokens to be moved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MovedTokens {
    /// The place that loses them.
    pub from: String,
    /// The place that gets them.
    pub to: String,
    /// How many.
    pub tokens: u32,
}

/// An order that has been judged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Judged {
    /// The number of the order.
    pub request: u64,
    /// The operator who gave it.
    pub by: Giver,
    /// Whether it takes the lease from another holder.
    pub take: bool,
    /// The order.
    pub order: MissionOrder,
    /// Whether it is carried out.
    pub accepted: bool,
    /// What follows from it, or why it is refused.
    pub text: String,
}

impl MissionOrder {
    /// Whether any operator may give it, not only the holder of the lease.
    pub fn is_open_to_all(&self) -> bool {
        matches!(self, Self::Pause | Self::Safe)
    }
}

impl From<control::Order> for MissionOrder {
    fn from(order: control::Order) -> Self {
        use control::Order as Given;
        match order {
            Given::Lease => Self::Lease,
            Given::Release => Self::Release,
            Given::Fire { transition } => Self::Fire(transition),
            Given::Pause => Self::Pause,
            Given::Resume => Self::Resume,
            Given::Safe => Self::Safe,
            Given::Move { moves } => {
                let kept = |it: control::TokenMove| MovedTokens {
                    from: it.from,
                    to: it.to,
                    tokens: it.tokens,
                };
                Self::Move(moves.into_iter().map(kept).collect())
            }
            Given::Confirm { transition } => Self::Confirm(transition),
            Given::Decline { transition } => Self::Decline(transition),
            Given::Rejoin => Self::Rejoin,
        }
    }
}

impl fmt::Display for MissionOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lease => f.write_str("take the command"),
            Self::Release => f.write_str("release the command"),
            Self::Fire(transition) => write!(f, "fire {transition}"),
            Self::Pause => f.write_str("pause"),
            Self::Resume => f.write_str("resume"),
            Self::Safe => f.write_str("safe"),
            Self::Move(moves) => {
                let one = |it: &MovedTokens| match it.tokens {
                    1 => format!("{} -> {}", it.from, it.to),
                    tokens => format!("{tokens} {} -> {}", it.from, it.to),
                };
                write!(f, "move {}", moves.iter().map(one).collect::<Vec<_>>().join(", "))
            }
            Self::Confirm(transition) => write!(f, "confirm {transition}"),
            Self::Decline(transition) => write!(f, "decline {transition}"),
            Self::Rejoin => f.write_str("keep the command"),
        }
    }
}
