//! The daemons, each as a program of its own: the launcher starts them, and they can be started by
//! hand on any host.

pub mod configd;
pub mod executive;
pub mod gate;
pub mod player;
pub mod registry;
pub mod serving;
