//! Homing: sends the robot home and reports when it has arrived. `ports` alone handles messages.

mod homecoming;
mod ports;

pub use homecoming::{Homecoming, HomingStep};
pub use ports::Homing;
