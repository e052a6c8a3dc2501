//! The executive: plays a mission over the components of a system.
//!
//! [`Plan`] is what is played, [`Controller`] the pure state machine that plays it, [`Ledger`]
//! what it has decided, record by record; [`run`] puts it between sockets and a journal. Start with
//! `controller.rs`.

mod authority;
mod builder;
mod change;
mod clocks;
mod commands;
mod compile;
mod confirm;
mod controller;
mod counters;
mod dates;
mod event;
mod follow;
mod gathering;
mod guards;
mod hub;
mod intake;
pub mod journal;
mod judging;
mod ledger;
mod marking;
mod moving;
mod operator;
pub mod order;
mod pause;
mod plan;
mod process;
mod progress;
mod proof;
mod record;
mod reports;
mod roster;
mod run;
#[cfg(test)]
mod scenarios;
mod senses;
#[cfg(test)]
mod simulation;
mod snapshot;
mod story;
mod time;
mod transfer;
mod values;
mod version;
mod waits;
mod wall_clock;
mod watch;

pub use authority::{Lease, Pause};
pub use change::{Answer, Found, Offer, Question};
pub use compile::PLAYED;
pub use controller::{Controller, Dropped};
pub use counters::{PlannedCounter, PlannedSet, Stand};
pub use dates::PlannedDates;
pub use event::{Action, Event};
pub use follow::Newer;
pub use guards::{PlannedGuard, PlannedVariable, Watch, WatchId};
pub use ledger::{Firing, Ledger, LedgerError, Phase, Stage};
pub use marking::{
    Confirmation, DateStand, EnabledTransition, Fired, GuardTruth, Holder, InFlight, MarkedPlace,
    Marking, MissionChange, MissionComponent, OrderGiven, ParameterGiven, Paused, VariableValue,
};
pub use moving::MoveQuestion;
pub use operator::Given;
pub use plan::{
    ComponentId, Limits, OnResume, Plan, PlannedComponent, PlannedPlace, PlannedTransition,
};
pub use proof::{
    Analysed, MAX_BYTES, MAX_CLASSES, MAX_STATES, prove, prove_from_here, time_in_words,
};
pub use record::{Cause, DatePhase, Entry, GuardTurned, Outcome, Record, Report, Tokens, ValueSet};
pub use roster::{Doing, Presence};
pub use run::{Options, RunError, run};
pub use snapshot::Snapshot;
pub use time::{Deadlines, Now};
pub use values::GivenValue;
pub use version::{FileText, Version};
pub use wall_clock::{doubts as clock_doubts, utc};
