//! Sources of every kind, written by the tests themselves.

#![allow(clippy::unwrap_used, reason = "all of it is a test")]

mod archives;
mod cache;
mod damage;
mod geotiffs;
mod large;
mod pictures;
mod plans;
mod written;
