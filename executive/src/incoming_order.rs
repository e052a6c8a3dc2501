//! An order as it arrives from an operator.

use crate::order::{Giver, MissionOrder};
use armor_sdk::orders;

/// An order as it arrives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IncomingOrder {
    /// The connection it came on, for the answer.
    pub connection: u64,
    /// Names it, wherever it is repeated.
    pub request: u64,
    /// Who gives it.
    pub by: Giver,
    /// Whether to take the command over from its holder.
    pub take: bool,
    /// What is to be done.
    pub order: MissionOrder,
}

impl From<orders::GivenOrder> for IncomingOrder {
    fn from(given: orders::GivenOrder) -> Self {
        let orders::GivenOrder { connection, from, instance, request, author, take, order } = given;
        let by = Giver { author, from, instance };
        Self { connection, request, by, take, order: order.into() }
    }
}
