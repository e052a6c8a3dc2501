//! The tests of this crate from outside, in one program: one link instead of two.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

mod book;
mod limits;
mod reader;
