//! Everything that reads bytes of unknown origin, one function each, with well-formed inputs to damage.
//! Shared by the test of this crate and by the targets in `fuzz/`.

pub mod damage;
pub mod entry;
pub mod fuzzing;
pub mod seeds;

/// The decoders of connections.
#[path = "../../../wire/tests/hostile/entry.rs"]
pub mod connection_entry;
/// The readers of the robot's file.
#[path = "../../../robotfile/tests/hostile/entry.rs"]
pub mod robotfile_entry;
