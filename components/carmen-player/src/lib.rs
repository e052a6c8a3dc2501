//! Plays CARMEN logs: recorded laser scans and odometry as live data.
//!
//! `line` reads one line, `log` streams a file of them, `playback` decides what is due when;
//! `ports` makes messages of it and publishes them.

pub mod line;
pub mod log;
pub mod playback;
mod ports;
pub mod record;

pub use ports::{CarmenPlayer, messages};
