//! The messages within a TLS connection between hosts: from the computer of a person to the gate of a
//! system, or between two hosts of it. The client sends one request in a `Control` frame, and the
//! other end one reply.

use crate::Message;
use crate::acting::{KeyRole, Preface};
use crate::refusal::Refusal;
use crate::remote_process::RemoteStart;

/// Port on which a gate listens by default.
pub const GATE_PORT: u16 = 7410;
/// In place of an address of a host's agent: where it announces itself by multicast DNS.
pub const ANNOUNCED: &str = "mdns";

/// From the client to the gate.
#[expect(clippy::large_enum_variant, reason = "there is one for each connection")]
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Request")]
pub enum GateRequest {
    /// Connect to a process of the system. After `Connected`, all bytes are those of that
    /// connection.
    Connect {
        /// Where it listens on that host, `address:port`; the address may be the name of a host.
        address: String,
        /// On whose behalf, if the host that asks forwards the connection of another holder. Only the
        /// launcher's host may.
        acts_for: Option<Preface>,
    },
    /// Describe the session. Beats follow in both directions, for as long as the key is accepted.
    Watch,
    /// Run a component; only a host may ask for it, and only an agent (`armor host`) does it. After
    /// `Connected`, [`crate::remote_process::RemoteOrder`] and
    /// [`crate::remote_process::RemoteEvent`] follow, and beats.
    Run {
        /// Which.
        start: RemoteStart,
    },
    /// Answer with the time of that host, so that both clocks can be compared.
    Clock,
    /// Examine that host, as `armor doctor` does there; only a host may ask for it.
    Examine,
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
    /// An answer to [`GateRequest::Run`]: the executable must be sent first, as bytes without frames,
    /// as many as were announced. The gate then answers once more.
    ExecutableWanted,
    /// The time of that host when it answered.
    Clock {
        /// In microseconds since 1970.
        time_us: u64,
    },
    /// What was found of that host.
    Examined {
        /// Its release and its findings.
        examination: HostExamination,
    },
}

/// What `armor doctor` finds of a host.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct HostExamination {
    /// The release of Armor there.
    pub release: String,
    /// The version of the protocol that it speaks.
    pub protocol: u16,
    /// Until when the host's key is valid, in seconds since 1970.
    pub key_ends_s: i64,
    /// What was found, subject by subject.
    pub findings: Vec<HostFinding>,
}

/// What was found of one subject of a host.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct HostFinding {
    /// What it is about, in one or two words.
    pub subject: String,
    /// `ok`, `note`, `warning` or `fault`.
    pub condition: String,
    /// What was found.
    pub found: String,
    /// What to do; empty if nothing.
    pub remedy: String,
}
