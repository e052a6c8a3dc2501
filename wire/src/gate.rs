//! The messages within the TLS connection between the computer of a person and the gate of a system.
//! The client sends one request in a `Control` frame, and the gate one reply.

use crate::Message;
use crate::acting::KeyRole;
use crate::refusal::Refusal;

/// Port on which a gate listens by default.
pub const GATE_PORT: u16 = 7410;

/// From the client to the gate.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "Request")]
pub enum GateRequest {
    /// Connect to a process of the system. After `Connected`, all bytes are those of that
    /// connection.
    Connect {
        /// Where it listens on the robot's host, `address:port`.
        address: String,
    },
    /// Describe the session. Beats follow in both directions, for as long as the key is accepted.
    Watch,
}

/// From the gate to the client.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Reply")]
pub enum GateReply {
    /// The connection is made.
    Connected,
    /// It is not.
    Refused {
        /// Why.
        refusal: Refusal,
    },
    /// The session.
    Session {
        /// The name of the gate in its certificate.
        host: String,
        /// The holder of the key.
        name: String,
        /// The role in the key.
        role: KeyRole,
        /// Where the registry of the system listens on the robot's host.
        registry: String,
    },
}
