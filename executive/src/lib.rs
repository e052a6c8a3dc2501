//! The executive: plays a mission over the components of a system.
//!
//! [`Controller`] is the pure state machine that plays a plan, [`Ledger`] what it has decided,
//! record by record; [`run()`] puts it between sockets and a journal. Start with `controller.rs`.

mod answer;
mod clocks;
mod controller;
mod event;
mod follow;
mod gathering;
mod given_up;
mod hub;
mod incoming_order;
pub mod journal;
mod judging;
mod ledger;
mod opening;
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

pub use answer::{VersionAnswer, VersionFinding, VersionOffer};
pub use controller::{Controller, Dropped};
pub use event::{ControllerAction, ControllerEvent};
pub use follow::Newer;
pub use given_up::GivenUpComponents;
pub use incoming_order::IncomingOrder;
pub use judging::{MoveQuestion, VersionQuestion};
pub use ledger::applying::{apply_record, replay_records};
pub use ledger::{Firing, Lease, Ledger, LedgerError, MissionStage, Pause, Phase};
pub use record::{JournalEntry, JournalRecord};
pub use roster::{Doing, ProcessPresence};
pub use run::{ExecutiveOptions, RunError, run};
pub use snapshot::LedgerSnapshot;
pub use terms::{Cause, ComponentReport, GuardTurned, MissionOutcome, Tokens, ValueSet};
pub use time::{ClockReadings, Deadlines};
pub use wall_clock::{doubts as clock_doubts, utc};
