//! Sources of every kind, written by the tests themselves.

mod cache;
mod pictures;
mod written;
