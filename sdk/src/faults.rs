//! Misbehaviour of peers goes to the log once per address and kind, so that it cannot fill a disk.

use std::fmt::Display;
use std::net::IpAddr;

use armor_socket::FaultTable;
use armor_wire::frame::FrameError;
use armor_wire::hello::{HandshakeError, Refusal, RefusalCode};

/// A fault of a peer, logged once per address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum PeerFault {
    /// It left before it sent its hello.
    Left,
    /// Its hello is not complete in time.
    Slow,
    /// It was one of too many; some had to be closed.
    Crowded,
    /// It sends a frame of a kind that does not exist.
    UnknownFrame,
    /// It announces a frame that is too long.
    FrameTooLong,
    /// It sends a frame that is not well-formed, or not of our protocol.
    Malformed,
    /// It was refused.
    Refused(u8),
    /// It sends on a link what a subscriber does not send.
    NotASubscriber,
    /// It sends on a control connection something that is not a command.
    NoCommand,
    /// Its role does not allow the command.
    NotAllowed,
}

impl From<&HandshakeError> for PeerFault {
    fn from(error: &HandshakeError) -> Self {
        match error {
            HandshakeError::Frame(error) => error.into(),
            _ => Self::Malformed,
        }
    }
}

impl From<&FrameError> for PeerFault {
    fn from(error: &FrameError) -> Self {
        match error {
            FrameError::UnknownKind(_) => Self::UnknownFrame,
            FrameError::TooLong { .. } => Self::FrameTooLong,
            FrameError::Malformed(_) | FrameError::Unexpected { .. } => Self::Malformed,
        }
    }
}

impl From<RefusalCode> for PeerFault {
    fn from(code: RefusalCode) -> Self {
        Self::Refused(code as u8)
    }
}

/// The faults that have been logged.
#[derive(Default)]
pub(crate) struct PeerFaultLog {
    logged: FaultTable<PeerFault>,
    /// Requests that a role does not allow. Each names the holder of the key.
    roles: FaultTable<String>,
}

impl PeerFaultLog {
    /// Logs why a connection was closed, if it is the first time that this address does this.
    pub fn log_once(&self, peer: Option<IpAddr>, fault: PeerFault, why: impl Display) {
        if self.logged.is_new(peer, fault) {
            let from = peer.map(|peer| format!(" from {peer}")).unwrap_or_default();
            tracing::warn!("connection{from} closed: {why}; further ones like it are not logged");
        }
    }

    /// Logs what the role of a key does not allow, once for each key and kind of request.
    pub fn log_role_once(&self, refusal: &Refusal) {
        if self.roles.is_new(None, refusal.text.clone()) {
            tracing::warn!("refused: {refusal}; further ones like it are not logged");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_of_an_unknown_frame_makes_no_difference() {
        let fault = |kind| PeerFault::from(&FrameError::UnknownKind(kind));
        assert_eq!(fault(71), fault(72));
    }
}
