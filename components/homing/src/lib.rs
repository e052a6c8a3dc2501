//! Homing: sends the robot home and says when it is there. `ports` is all there is of messages.

mod homecoming;
mod ports;

pub use homecoming::{Homecoming, Step};
pub use ports::Homing;
