//! The tests of this crate from outside, in one program: one link instead of seven.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

mod counts;
mod data;
mod files;
mod invariants;
mod oracle;
mod semantics;
mod stubborn;
mod time;
