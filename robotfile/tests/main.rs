//! The tests of this crate from outside, in one program: one link instead of ten.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

mod drawn;
mod drawn_preview;
mod drawn_rehearsal;
mod drawn_times;
mod drawn_zones;
mod edit_hostile;
mod edit_sequences;
mod edits;
mod errors;
mod examples;
mod findings;
mod format;
mod guards;
mod hostile;
mod schema;
