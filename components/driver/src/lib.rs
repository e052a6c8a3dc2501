//! Drives a differential-drive robot along paths, or by manual velocities, without touching
//! anything. `driver` decides at each step; `follower` finds the point to head for, `window` the
//! speeds that hit nothing within the `limits` of the base, `guard` the safe part of a manual
//! velocity, `track` where the robot is between two poses, `surroundings` what is near,
//! `zones_around` which zones are, `recovery` how to get loose; `phase` names what the robot is doing. `ports` alone handles messages.

#[cfg(test)]
mod box_world;
mod driver;
mod follower;
mod guard;
mod limits;
mod phase;
mod ports;
mod recovery;
mod surroundings;
mod track;
mod window;
mod zones_around;

pub use driver::{DriverSettings, Driving};
pub use limits::{DriveLimits, Velocity};
pub use phase::DrivingPhase;
pub use ports::Driver;
pub use surroundings::DriverScan;
