//! The executive: plays a mission over the components of a system.
//!
//! [`Controller`] is the pure state machine that plays a plan, [`Ledger`] what it has decided, record
//! by record; [`run()`] puts it between sockets and a journal. Start with `controller.rs`.

mod answer;
mod clocks;
mod controller;
mod event;
mod follow;
mod gathering;
mod hub;
mod incoming_order;
pub mod journal;
mod judging;
mod ledger;
pub mod order;
mod process;
mod record;
mod roster;
mod run;
mod snapshot;
mod story;
mod terms;
#[cfg(test)]
mod tests;
mod time;
mod wall_clock;
mod watch;

pub use answer::{Answer, Found, Offer};
pub use controller::{Controller, Dropped};
pub use event::{Action, Event};
pub use follow::Newer;
pub use incoming_order::IncomingOrder;
pub use judging::{MoveQuestion, Question};
pub use ledger::{Firing, Lease, Ledger, LedgerError, Pause, Phase, Stage};
pub use record::{Entry, Record};
pub use roster::{Doing, Presence};
pub use run::{Options, RunError, run};
pub use snapshot::Snapshot;
pub use terms::{Cause, GuardTurned, Outcome, Report, Tokens, ValueSet};
pub use time::{Deadlines, Now};
pub use wall_clock::{doubts as clock_doubts, utc};
