//! The daemons' half: accepts connections, reads and writes frames, beats, closes peers that
//! violate the protocol, and gives the daemon typed events only.
//!
//! Start with [`server`]: a daemon is a loop over [`Server::next_event`] and [`Server::perform`]
//! around a pure state machine. [`registration`] is the other direction: being registered under a
//! name.

mod close_log;
mod connection;
pub mod limits;
mod outgoing;
pub mod registration;
mod seats;
pub mod server;
mod stream;

pub use limits::ServerLimits;
pub use registration::{Registration, RegistrationStatus};
pub use server::Server;
