//! The executive: plays a mission over the components of a system.
//!
//! [`Plan`] is what is played, [`Controller`] the pure state machine that plays it, [`Ledger`]
//! what it has decided, record by record. Start with `controller.rs`.

mod commands;
mod compile;
mod controller;
mod event;
pub mod journal;
mod ledger;
mod plan;
mod progress;
mod record;
mod roster;
#[cfg(test)]
mod simulation;

pub use compile::PLAYED;
pub use controller::{Controller, Dropped};
pub use event::{Action, Event};
pub use ledger::{Firing, Ledger, LedgerError, Phase, Stage};
pub use plan::{
    ComponentId, Limits, OnResume, Plan, PlannedComponent, PlannedPlace, PlannedTransition,
};
pub use record::{Cause, Entry, Outcome, Record, Report, Tokens};
pub use roster::{Doing, Presence};
