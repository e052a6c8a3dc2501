//! Sources of every kind, written by the tests themselves.

mod archives;
mod cache;
mod damage;
mod geotiffs;
mod large;
mod pictures;
mod plans;
mod written;
