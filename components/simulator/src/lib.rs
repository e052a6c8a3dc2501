//! The simulator: a robot with a laser, wheels and a battery in a world drawn as SVG.
//!
//! Pure and without a clock: [`drawing`] reads the SVG, [`world`] answers rays and clearances,
//! [`laser`], [`drive`], [`odometry`] and [`battery`] are the parts of the robot, [`simulation`] joins
//! them in fixed steps, [`pace`] says how fast time passes, [`truth`] scores maps. `ports.rs` alone knows the SDK.

pub mod battery;
pub mod drawing;
pub mod drive;
pub mod laser;
pub mod odometry;
pub mod pace;
mod ports;
pub mod pose;
pub mod random;
pub mod simulation;
pub mod truth;
pub mod world;

pub use ports::Simulator;
