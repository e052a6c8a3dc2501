//! Playing recordings: `armor play`, and the orders to a player that runs.

pub mod arguments;
pub mod keys;
pub mod orders;
pub mod play;
pub mod played;
