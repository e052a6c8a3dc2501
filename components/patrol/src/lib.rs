//! Patrol: sends the robot from waypoint to waypoint. `ports` alone handles messages.

mod ports;
mod rounds;

pub use ports::Patrol;
pub use rounds::{PatrolProgress, PatrolSettings, PatrolStep, Rounds};
