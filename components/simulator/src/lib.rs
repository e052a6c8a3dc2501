//! The simulator: a robot with its sensors among walls, people and other robots.
//!
//! Pure and without a clock: `armor-drawn-world` and `armor-map-file` read worlds, [`world`] answers
//! rays and clearances, [`scene`] adds what moves. `contact` is the base as a body, [`drive`] with
//! [`steering`] and [`slip`] how it moves; each sensor has a file of its own. [`simulation`] joins
//! them in fixed steps, [`pace`] maps the host's time to simulated time, [`truth`] is the world as
//! a raster. `ports` alone knows the SDK.

pub mod battery;
pub mod camera;
pub mod compass;
pub mod contact;
pub mod drive;
pub mod gps;
pub mod imu;
pub mod laser;
pub mod odometry;
pub mod pace;
pub mod people;
mod ports;
pub mod pose;
pub mod random;
mod raster;
pub mod reading;
pub mod scene;
pub mod simulation;
pub mod slip;
pub mod steering;
pub mod truth;
mod walls;
pub mod world;

pub use ports::Simulator;
