//! Misbehaviour goes to the log once per peer address and kind, so that it cannot fill a disk.

use std::collections::HashSet;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, PoisonError};

use tracing::warn;

use crate::event::CloseReason;
use crate::limits::MAX_FAULTS;

/// What was logged already.
#[derive(Default)]
pub(crate) struct Faults {
    known: Mutex<HashSet<(IpAddr, &'static str)>>,
}

impl Faults {
    /// Logs why a connection ended, if the peer is to blame and it is the first such fault of its
    /// address.
    pub(crate) fn report(&self, address: SocketAddr, reason: &CloseReason) {
        if let Some(fault) = reason.fault()
            && self.is_new(address.ip(), fault)
        {
            warn!(%address, %reason, "connection closed; further ones like it are not logged");
        }
    }

    fn is_new(&self, address: IpAddr, fault: &'static str) -> bool {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.len() < MAX_FAULTS && known.insert((address, fault))
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn a_fault_is_new_once_per_address_and_kind_and_the_table_is_bounded() {
        let faults = Faults::default();
        let address = |n: u32| IpAddr::V4(Ipv4Addr::from(n));
        assert!(faults.is_new(address(1), "unknown frame"));
        assert!(!faults.is_new(address(1), "unknown frame"));
        assert!(faults.is_new(address(1), "frame too long"));
        assert!(faults.is_new(address(2), "unknown frame"));
        let logged = (10..10_000).filter(|n| faults.is_new(address(*n), "truncated")).count();
        assert_eq!(logged, MAX_FAULTS - 3);
    }
}
