//! The executive: plays a mission over the components of a system.
//!
//! [`Controller`] is the pure state machine that plays a plan, [`Ledger`] what it has decided, record
//! by record; [`run()`] puts it between sockets and a journal. Start with `controller.rs`.

mod authority;
mod change;
mod clocks;
mod commands;
mod confirm;
mod controller;
mod counters;
mod dates;
mod event;
mod follow;
mod gathering;
mod hub;
mod intake;
pub mod journal;
mod judging;
mod ledger;
mod moving;
mod operator;
pub mod order;
mod pause;
mod process;
mod progress;
mod publishing;
mod record;
mod reports;
mod roster;
mod run;
mod senses;
mod snapshot;
mod story;
#[cfg(test)]
mod tests;
mod time;
mod transfer;
mod values;
mod waits;
mod wall_clock;
mod watch;

pub use authority::{Lease, Pause};
pub use change::{Answer, Found, Offer, Question};
pub use controller::{Controller, Dropped};
pub use event::{Action, Event};
pub use follow::Newer;
pub use ledger::{Firing, Ledger, LedgerError, Phase, Stage};
pub use moving::MoveQuestion;
pub use operator::Given;
pub use record::{Cause, Entry, GuardTurned, Outcome, Record, Report, Tokens, ValueSet};
pub use roster::{Doing, Presence};
pub use run::{Options, RunError, run};
pub use snapshot::Snapshot;
pub use time::{Deadlines, Now};
pub use wall_clock::{doubts as clock_doubts, utc};
