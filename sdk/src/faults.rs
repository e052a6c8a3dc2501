//! Misbehaviour of peers goes to the log once per address and kind, so that it cannot fill a disk.

use std::collections::HashSet;
use std::fmt::Display;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};

use armor_wire::frame::FrameError;
use armor_wire::hello::{HandshakeError, RefusalCode};

/// Most pairs of address and fault that are remembered; beyond it faults are not logged at all.
const MAX_FAULTS: usize = 256;

/// What a peer does wrong, as logged once per address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Fault {
    /// It left before it said who it is.
    Left,
    /// Its hello does not come to its end.
    Slow,
    /// It came with so many others that some had to go.
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
    /// It sends on a control connection what is no command.
    NoCommand,
    /// It may not order what it orders.
    NotAllowed,
}

impl From<&HandshakeError> for Fault {
    fn from(error: &HandshakeError) -> Self {
        match error {
            HandshakeError::Frame(error) => error.into(),
            _ => Self::Malformed,
        }
    }
}

impl From<&FrameError> for Fault {
    fn from(error: &FrameError) -> Self {
        match error {
            FrameError::UnknownKind(_) => Self::UnknownFrame,
            FrameError::TooLong { .. } => Self::FrameTooLong,
            FrameError::Malformed(_) | FrameError::Unexpected { .. } => Self::Malformed,
        }
    }
}

impl From<RefusalCode> for Fault {
    fn from(code: RefusalCode) -> Self {
        Self::Refused(code as u8)
    }
}

/// What was logged already.
#[derive(Default)]
pub(crate) struct Faults {
    known: Mutex<HashSet<(Option<IpAddr>, Fault)>>,
}

impl Faults {
    /// Logs why a connection was closed, if it is the first time that this address does this.
    pub fn report(&self, peer: Option<IpAddr>, fault: Fault, why: impl Display) {
        if self.is_new(peer, fault) {
            let from = peer.map(|peer| format!(" from {peer}")).unwrap_or_default();
            tracing::warn!("connection{from} closed: {why}; further ones like it are not logged");
        }
    }

    fn is_new(&self, peer: Option<IpAddr>, fault: Fault) -> bool {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.len() < MAX_FAULTS && known.insert((peer, fault))
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn a_fault_is_new_once_per_address_and_kind_and_the_table_is_bounded() {
        let faults = Faults::default();
        let peer = |n: u32| Some(IpAddr::V4(Ipv4Addr::from(n)));
        let unknown = |kind| Fault::from(&FrameError::UnknownKind(kind));
        assert!(faults.is_new(peer(1), unknown(71)));
        assert!(!faults.is_new(peer(1), unknown(72)), "the kind of frame makes no difference");
        assert!(faults.is_new(peer(1), Fault::Slow));
        assert!(faults.is_new(peer(2), Fault::Slow));
        let logged = (10..10_000).filter(|n| faults.is_new(peer(*n), Fault::Left)).count();
        assert_eq!(logged, MAX_FAULTS - 3);
    }
}
