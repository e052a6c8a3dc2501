//! The sockets of the daemons: accepts, reads and writes frames, beats, closes who misbehaves, and
//! hands the daemon nothing but typed events.
//!
//! Start with [`server`]: a daemon is a loop over [`Server::event`] and [`Server::act`] around a pure
//! state machine. [`registration`] is the other direction: being found under a name.

mod connection;
pub mod event;
mod faults;
pub mod limits;
pub mod listen;
mod outgoing;
mod random;
pub mod registration;
mod seats;
pub mod server;

pub use event::{Action, CloseReason, Event, PeerId};
pub use limits::Limits;
pub use listen::{ListenError, listen};
pub use random::random_id;
pub use registration::{Registration, Standing};
pub use server::Server;
