//! What operators order, as the journal keeps it.

use armor_sdk::control;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Who gives an order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Giver {
    /// The person.
    pub author: String,
    /// The process, in words.
    pub from: String,
    /// The start of that process.
    pub instance: u64,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MissionOrder {
    /// Hold the command.
    Lease,
    /// Give it back.
    Release,
    /// Fire an operator's transition.
    Fire(String),
    /// Let clocks and components stop, but for those of safety.
    Pause,
    /// Go on after a pause.
    Resume,
    /// Go to the safe place.
    Safe,
    /// Move tokens, all of them in one step.
    Move(Vec<MovedTokens>),
    /// Let a transition fire that asks.
    Confirm(String),
    /// Do not let it.
    Decline(String),
    /// Go on holding the command, over another connection.
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
    /// Names it.
    pub request: u64,
    /// Who gave it.
    pub by: Giver,
    /// Whether the command was to be taken over.
    pub take: bool,
    /// What was to be done.
    pub order: MissionOrder,
    /// Whether it is done.
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
            Self::Rejoin => f.write_str("go on with the command"),
        }
    }
}
