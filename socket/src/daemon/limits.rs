//! The limits on what peers cost a daemon, each with its reason.

use std::time::Duration;

use armor_wire::codec::{MAX_CONTROL_LEN, MAX_HELLO_LEN};
use armor_wire::liveness::SILENCE;

/// Longest frame a daemon reads, in bytes: a hello, or a request with one schema (16 KiB at most).
/// It applies to the whole connection, so a connection never costs more memory than this to read.
pub const MAX_REQUEST_LEN: usize = MAX_HELLO_LEN;

/// Most events that wait for the daemon. Further requests wait in the peer's socket.
pub const MAX_EVENTS: usize = 256;

/// Pause of the accept loop when the process is out of descriptors or memory, instead of
/// spinning on a listener that stays readable.
pub const ACCEPT_REST: Duration = Duration::from_millis(200);

/// How long a refused peer may take to read why, before its socket is closed under it.
pub const LINGER: Duration = Duration::from_secs(1);

/// The limits that depend on the machine; the defaults serve a robot.
#[derive(Clone, Copy, Debug)]
pub struct ServerLimits {
    /// Connections in total. Below 1024, the usual number of descriptors of a process.
    pub connections: usize,
    /// Connections from one address. Nearly all of them, because on one machine every component and
    /// tool has the same address; the rest is for peers on other hosts.
    pub connections_per_address: usize,
    /// How long a peer may take to send its hello.
    pub handshake: Duration,
    /// Bytes that wait for a peer to read them: a longest frame and as much again of small ones. A
    /// peer that lets more pile up is closed.
    pub outgoing_len: usize,
    /// How long a peer may read nothing at all while bytes wait for it.
    pub stall: Duration,
}

impl Default for ServerLimits {
    fn default() -> Self {
        Self {
            connections: 960,
            connections_per_address: 900,
            handshake: Duration::from_secs(2),
            outgoing_len: 2 * MAX_CONTROL_LEN,
            stall: SILENCE,
        }
    }
}
