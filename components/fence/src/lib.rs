//! Reports that the robot is near a zone, has broken into or out of one, and is back. `fencing`
//! decides; `ports` alone handles messages.

mod fencing;
mod ports;

pub use fencing::{FenceNews, FenceSettings, Fencing, LocatedRobot};
pub use ports::Fence;
