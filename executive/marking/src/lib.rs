//! The messages by which the executive publishes the state of its mission.
//!
//! [`Marking`] is the message of the latched output `executive.marking`; the other types are its
//! parts. Tools decode it without importing the executive.

mod change;
mod command;
mod dates;
mod marking;
mod state;
mod word;

pub use change::{ChangeState, MissionChange};
pub use command::{Confirmation, Holder, OrderGiven, Paused, UnansweredAction};
pub use dates::{DateStand, DateWindow, MissedAction};
pub use marking::{
    EnabledTransition, Fired, GuardTruth, InFlight, MarkedPlace, Marking, MissionComponent,
    ParameterGiven, VariableValue, WaitingTransition,
};
pub use state::{FiringDecider, FlightPhase, MarkingStage, MissionComponentState, TruthValue};
