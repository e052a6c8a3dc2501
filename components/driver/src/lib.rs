//! Drives a differential-drive robot to goals on a map without touching anything. `driver` decides
//! at each step; `planner` finds the way, `follower` the point to head for, `window` the speeds
//! that hit nothing, `track` where the robot is between two poses, `surroundings` what is near.
//! `ports` is all there is of messages.

#[cfg(test)]
mod box_world;
mod driver;
mod follower;
mod planner;
mod ports;
mod recovery;
mod surroundings;
mod track;
mod window;

pub use driver::{Driving, Settings};
pub use ports::Driver;
pub use surroundings::Scan;
pub use window::{Limits, Velocity};
