//! Petri nets with time: what a net is ([`Net`]), and what it does ([`State`]).
//!
//! Pure: no IO, no clock, no randomness. `now` is a [`std::time::Duration`] since any moment the
//! caller chooses, and every conflict between transitions is decided by the net, never by chance.
//! Start with `net.rs`, then `state.rs`; `step.rs` fires until no transition may.

mod agenda;
pub mod analysis;
mod builder;
pub mod file;
mod net;
mod state;
mod step;

pub use builder::{NetBuilder, TransitionBuilder};
pub use net::{Class, Interval, Net, NetError, PlaceId, Transition, TransitionId};
pub use state::{FireError, State};
pub use step::{EndlessStep, Step};
