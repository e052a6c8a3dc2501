//! Board: several writers of one element, of which one holds it. `ports` alone handles messages.

mod hold;
mod ports;

pub use hold::{ElementHold, HoldPolicy};
pub use ports::Board;
