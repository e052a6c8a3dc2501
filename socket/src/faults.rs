//! Socket errors that pass by themselves, which faults of peers have been logged, and which failures of
//! an accept loop are to be.

use std::collections::HashSet;
use std::hash::Hash;
use std::io;
use std::net::IpAddr;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

/// Most pairs of peer address and fault that are remembered. Further faults are not logged at all:
/// a flood of addresses must fill neither memory nor disk.
pub const MAX_FAULTS: usize = 256;

/// At most one episode in which no connection is accepted begins in the log within this time. Clients
/// that take and free the last descriptor in turn must not fill a disk.
pub const EPISODE_PERIOD: Duration = Duration::from_secs(10);

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

/// Decides which failures of an accept loop are logged: an episode of them has one line at its beginning
/// and one at its end, however many attempts fail in it. At most one episode in [`EPISODE_PERIOD`] is
/// logged: one that begins and ends within that time after the beginning of a logged one has no line.
#[derive(Debug, Default)]
pub struct AcceptLog {
    /// Whether an episode was logged that has not ended.
    is_failing: bool,
    last_begin: Option<Instant>,
}

impl AcceptLog {
    /// Notes that no connection was accepted; returns whether that is to be logged. An episode that
    /// begins less than [`EPISODE_PERIOD`] after another one is logged when that time has passed, if it
    /// lasts until then.
    pub fn note_failure(&mut self, now: Instant) -> bool {
        let is_early =
            self.last_begin.is_some_and(|begin| now.duration_since(begin) < EPISODE_PERIOD);
        if self.is_failing || is_early {
            return false;
        }
        (self.is_failing, self.last_begin) = (true, Some(now));
        true
    }

    /// Notes an accepted connection; returns whether the end of an episode is to be logged.
    pub fn note_success(&mut self) -> bool {
        std::mem::take(&mut self.is_failing)
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

    #[test]
    fn each_episode_of_an_accept_loop_is_logged_at_its_beginning_and_its_end() {
        let mut log = AcceptLog::default();
        let begin = Instant::now();
        assert!(!log.note_success(), "nothing has failed");
        for episode in 0..3 {
            let at = begin + EPISODE_PERIOD * episode;
            assert!(log.note_failure(at), "episode {episode}");
            assert!(!log.note_failure(at + EPISODE_PERIOD * 2), "the same episode");
            assert!(log.note_success(), "the end of episode {episode}");
            assert!(!log.note_success(), "once");
        }
    }

    #[test]
    fn episodes_that_follow_each_other_fill_no_log() {
        let mut log = AcceptLog::default();
        let begin = Instant::now();
        let flap = |tenths: u32| {
            let failed = log.note_failure(begin + Duration::from_millis(100) * tenths);
            (failed, log.note_success())
        };
        let logged: Vec<_> = (0..1000).map(flap).filter(|it| *it != (false, false)).collect();
        assert_eq!(logged, [(true, true); 10], "of 100 s");
        // One that lasts is logged, though it has begun too early.
        let mut log = AcceptLog::default();
        assert!(log.note_failure(begin) && log.note_success());
        assert!(!log.note_failure(begin + EPISODE_PERIOD / 2) && !log.note_success());
        assert!(!log.note_failure(begin + EPISODE_PERIOD / 2));
        assert!(log.note_failure(begin + EPISODE_PERIOD) && log.note_success());
    }
}
