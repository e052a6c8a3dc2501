//! Links: an output's data, straight from the publisher's thread to the subscriber's socket.

mod arrivals;
mod catch_up;
mod datagram_publishing;
mod datagrams_in;
pub(crate) mod datagrams_out;
pub(crate) mod inbox;
pub(crate) mod input;
pub(crate) mod input_reader;
mod kept;
pub(crate) mod memory_in;
pub(crate) mod memory_out;
mod memory_publishing;
pub(crate) mod output;
pub(crate) mod patience;
pub(crate) mod payload;
pub(crate) mod publishing;
pub(crate) mod pull;
pub(crate) mod queue;
#[cfg(test)]
mod simulation;
mod stream;
pub(crate) mod wire_out;
mod writability;
