//! Frontier exploration: drives to where the known meets the unknown until nothing is left.
//! `exploration` decides, `candidate` prices the trips, `frontier` finds what is unseen; `ports`
//! is all there is of messages.

mod candidate;
#[cfg(test)]
mod drawing;
mod exploration;
mod frontier;
mod ports;

pub use exploration::{Exploration, ExplorerDecision, ExplorerSettings};
pub use ports::Explorer;
