//! Draws a map while the robot drives: scan matching on an occupancy grid, odometry as the prior.

pub mod field;
pub mod grid;
pub mod mapper;
pub mod pairing;
mod ports;
pub mod pose;
pub mod refine;
pub mod scan;
pub mod search;

pub use ports::GridMapper;
