//! Draws a map while the robot drives: a particle filter on occupancy grids, and a pose graph that
//! closes loops.

pub mod agreement;
mod bare_walls;
pub mod closing;
pub mod config;
pub mod continuation;
mod doubt;
pub mod field;
pub mod filter;
pub mod graph;
pub mod grid;
mod matching;
mod normals;
pub mod pairing;
mod particle;
mod ports;
pub mod pose;
pub mod prior;
pub mod recognition;
mod record_bytes;
pub mod recorder;
pub mod refine;
pub mod scan;
pub mod search;
pub mod slam;
pub mod snapshot;
pub mod sparse;
pub mod state;
mod state_file;
mod sweep;
mod tile;
mod wall_directions;

pub use ports::GridSlam;
