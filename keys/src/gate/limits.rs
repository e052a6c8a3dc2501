//! The limits on what others cost a gate, each with its reason.

use std::time::Duration;

/// Pause of the accept loop when the process is out of descriptors or memory.
pub(crate) const ACCEPT_REST: Duration = Duration::from_millis(200);
/// Period with which the folder of keys and the ends of keys are looked at. Together with closing a
/// connection it bounds the time from a revocation to the end of its sessions: 1 s.
pub(crate) const LOOK_AT_KEYS: Duration = Duration::from_millis(250);

/// The limits that depend on the machine; the defaults serve a robot.
#[derive(Clone, Copy, Debug)]
pub struct GateLimits {
    /// How long a client may take for the TLS handshake and its request.
    pub handshake: Duration,
    /// Connections whose other end has not proven a key yet, in total; one more ends the oldest of
    /// the address that has most. The handshake of a client with a key takes milliseconds.
    pub strangers: usize,
    /// Such connections from one address; one more ends the oldest of that address.
    pub strangers_per_address: usize,
    /// Connections of all keys. Each needs two descriptors, of usually 1,024.
    pub sessions: usize,
    /// Connections of one name: a tool that shows a large system has one to each component.
    pub sessions_per_name: usize,
    /// Connections of one name to one process: its own places are for others too.
    pub sessions_per_process: usize,
}

impl GateLimits {
    /// Those of a gate to other hosts of the system: each link between components is a connection.
    pub fn of_hosts() -> Self {
        Self { sessions: 2_000, ..Self::default() }
    }
}

impl Default for GateLimits {
    fn default() -> Self {
        Self {
            handshake: Duration::from_secs(2),
            strangers: 64,
            strangers_per_address: 16,
            sessions: 440,
            sessions_per_name: 256,
            sessions_per_process: 40,
        }
    }
}
