//! Everything that reads a file of unknown origin, one function each, with well-formed inputs to damage.
//! Shared by the test of this crate and by the targets in `fuzz/`.

pub mod damage;
pub mod entry;
pub mod seeds;
