//! What an operator may order of the executive.

use crate::Message;

/// Longest name of an order's author, in bytes.
pub const MAX_AUTHOR_LEN: usize = 128;
/// Longest name of a place or transition in an order, in bytes; those of nested missions are
/// several names long.
pub const MAX_ORDER_NAME_LEN: usize = 512;
/// Most moves in one order: what a person can oversee, with room to spare.
pub const MAX_MOVES: usize = 256;

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Order {
    /// Take the command for as long as this connection lasts, and a few seconds beyond its loss.
    Lease,
    /// Give the command back; what follows is no loss of the link.
    Release,
    /// Fire an enabled operator's transition.
    Fire {
        /// Its name.
        transition: String,
    },
    /// Let clocks and components stop, but for those of safety.
    Pause,
    /// Resume after a pause.
    Resume,
    /// Go to the safe place.
    Safe,
    /// Move tokens in one step; only during a pause.
    Move {
        /// From where to where.
        moves: Vec<TokenMove>,
    },
    /// Fire a transition that waits for confirmation.
    Confirm {
        /// Its name.
        transition: String,
    },
    /// Do not let it.
    Decline {
        /// Its name.
        transition: String,
    },
    /// Keep the command over a new connection. Refused to an operator that does not hold it:
    /// where it was taken over meanwhile, or another mission is played there.
    Rejoin,
}

/// Tokens to be moved.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct TokenMove {
    /// The place that loses them.
    pub from: String,
    /// The place that gets them.
    pub to: String,
    /// How many.
    pub tokens: u32,
}

/// Why an order is not even read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OrderFault {
    /// Its author is missing.
    #[error("an order needs an author of 1 to {MAX_AUTHOR_LEN} bytes without control characters")]
    Author,
    /// Its number does not identify it.
    #[error("an order needs a request number that is not 0")]
    Request,
    /// No place or transition is called so.
    #[error("a name in the order is longer than {MAX_ORDER_NAME_LEN} bytes, or empty")]
    Name,
    /// More moves than a person can oversee.
    #[error("an order moves tokens at least once and at most {MAX_MOVES} times")]
    Moves,
}

impl Order {
    /// Whether it is one that can be carried out at all, by whom and under which number.
    ///
    /// # Errors
    /// [`OrderFault`] if a part of it is too long, missing or no name.
    pub fn check(&self, request: u64, author: &str) -> Result<(), OrderFault> {
        let fits = |name: &str| !name.is_empty() && name.len() <= MAX_ORDER_NAME_LEN;
        let named = match self {
            Self::Fire { transition }
            | Self::Confirm { transition }
            | Self::Decline { transition } => fits(transition),
            Self::Move { moves } if moves.is_empty() || moves.len() > MAX_MOVES => {
                return Err(OrderFault::Moves);
            }
            Self::Move { moves } => moves.iter().all(|it| fits(&it.from) && fits(&it.to)),
            Self::Lease
            | Self::Release
            | Self::Pause
            | Self::Resume
            | Self::Safe
            | Self::Rejoin => true,
        };
        if request == 0 {
            return Err(OrderFault::Request);
        }
        if author.is_empty()
            || author.len() > MAX_AUTHOR_LEN
            || author.chars().any(char::is_control)
        {
            return Err(OrderFault::Author);
        }
        if named { Ok(()) } else { Err(OrderFault::Name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_malformed_order_is_refused_with_the_reason() {
        let fire = |name: &str| Order::Fire { transition: name.to_owned() };
        let it = TokenMove { from: "a".into(), to: "b".into(), tokens: 1 };
        let moves = |count| Order::Move { moves: vec![it.clone(); count] };
        for (order, request, author, expected) in [
            (fire("go"), 1, "ruth@station", Ok(())),
            (moves(MAX_MOVES), 1, "ruth", Ok(())),
            (fire("go"), 0, "ruth", Err(OrderFault::Request)),
            (Order::Pause, 1, "", Err(OrderFault::Author)),
            (Order::Pause, 1, "ru\nth", Err(OrderFault::Author)),
            (fire(""), 1, "ruth", Err(OrderFault::Name)),
            (fire(&"x".repeat(MAX_ORDER_NAME_LEN + 1)), 1, "ruth", Err(OrderFault::Name)),
            (moves(0), 1, "ruth", Err(OrderFault::Moves)),
            (moves(MAX_MOVES + 1), 1, "ruth", Err(OrderFault::Moves)),
        ] {
            assert_eq!(order.check(request, author), expected, "{order:?} {author:?}");
        }
    }
}
