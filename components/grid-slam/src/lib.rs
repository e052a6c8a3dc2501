//! Draws a map while the robot drives: scan matching on an occupancy grid, odometry as the prior.

pub mod agreement;
pub mod closing;
pub mod config;
pub mod evaluation;
pub mod field;
pub mod filter;
pub mod graph;
pub mod grid;
mod matching;
pub mod pairing;
mod particle;
mod ports;
pub mod pose;
pub mod refine;
pub mod scan;
pub mod search;
pub mod slam;
pub mod sparse;

pub use ports::GridSlam;
