//! Finds the way over the map to the goal that holds. `planning` says which goal that is and what
//! to tell; `way` is the search. `ports` is all there is of messages.

mod planning;
mod ports;
mod way;

pub use planning::{Planning, Rank, Settings};
pub use ports::Planner;
