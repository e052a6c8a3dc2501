//! Patrol: sends the robot from waypoint to waypoint. `ports` is all there is of messages.

mod ports;
mod rounds;
mod route;

pub use ports::Patrol;
pub use rounds::{Rounds, Settings, Step};
pub use route::{RouteError, parse};
