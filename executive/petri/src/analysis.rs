//! What can be said of a net before it runs, with a counterexample where it is bad news, and
//! "undecided" where a budget ran out.
//!
//! The untimed analysis ([`explore()`], [`invariants`], [`boundedness`]) looks at tokens alone:
//! intervals, priorities, classes and gates only take behaviour away, so what it excludes never
//! happens in a run. [`classes`] and [`durations`] look at time.

pub mod boundedness;
pub mod budget;
pub mod classes;
pub mod components;
mod domain;
pub mod durations;
mod elimination;
pub mod explore;
pub mod invariants;
mod layout;
pub mod rules;
pub mod runs;
pub mod space;
mod store;
pub mod stubborn;

pub use budget::{Budget, Exhausted};
pub use explore::{Ending, Exploration, explore};
pub use space::Space;
