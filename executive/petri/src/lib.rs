//! Petri nets with time: what a net is ([`Net`]), and what it does ([`NetState`]).
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
pub use net::{FiringClass, FiringInterval, Net, NetError, NetTransition, PlaceId, TransitionId};
pub use state::{FireError, NetState};
pub use step::{EndlessStep, NetStep};
