//! Socket errors that pass by themselves, and which faults of peers have been logged.

use std::collections::HashSet;
use std::hash::Hash;
use std::io;
use std::net::IpAddr;

use parking_lot::Mutex;

/// Most pairs of peer address and fault that are remembered. Further faults are not logged at all:
/// a flood of addresses must fill neither memory nor disk.
pub const MAX_FAULTS: usize = 256;

/// Whether a read or write only found nothing to do, ran into its time limit or was interrupted by
/// a signal: the connection is intact.
///
/// [`io::ErrorKind::TimedOut`] is not temporary: a socket reports it when its connection has ended
/// because the peer's host fell silent. A read timeout that passes is `WouldBlock`.
pub fn is_temporary(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

/// Remembers which kinds of fault were logged for which peer address.
#[derive(Debug)]
pub struct FaultTable<K> {
    logged: Mutex<HashSet<(Option<IpAddr>, K)>>,
}

impl<K> Default for FaultTable<K> {
    fn default() -> Self {
        Self { logged: Mutex::default() }
    }
}

impl<K: Eq + Hash> FaultTable<K> {
    /// Returns whether this fault of this peer is to be logged: the first one of its kind is, while
    /// the table has room.
    pub fn is_new(&self, peer: Option<IpAddr>, kind: K) -> bool {
        let mut logged = self.logged.lock();
        logged.len() < MAX_FAULTS && logged.insert((peer, kind))
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn a_fault_is_new_once_per_address_and_kind_and_the_table_is_bounded() {
        let faults = FaultTable::default();
        let peer = |n: u32| Some(IpAddr::V4(Ipv4Addr::from(n)));
        assert!(faults.is_new(peer(1), "unknown frame"));
        assert!(!faults.is_new(peer(1), "unknown frame"));
        assert!(faults.is_new(peer(1), "frame too long"));
        assert!(faults.is_new(peer(2), "unknown frame"));
        let logged = (10..10_000).filter(|n| faults.is_new(peer(*n), "truncated")).count();
        assert_eq!(logged, MAX_FAULTS - 3);
    }
}
