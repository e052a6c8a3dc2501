//! Analysis of a net before it runs. A negative result comes with a counterexample; if a budget ran
//! out, the result is "undecided".
//!
//! The untimed analysis ([`explore_states()`], [`invariants`], [`boundedness`]) considers tokens
//! only. Intervals, priorities, classes and gates can only remove behaviour, so whatever it
//! excludes never happens in a run. [`classes`] and [`durations`] consider time.

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
#[cfg(test)]
mod walker;

pub use budget::{AnalysisBudget, Exhausted};
pub use explore::{ExplorationEnd, StateExploration, explore_states};
pub use space::Space;
