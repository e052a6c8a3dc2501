//! Who may make a sender wait. Only the file gives a component that right (`keep="all"`); any other peer
//! that asks for everything gets the newest few, as a tool does.

use std::collections::HashSet;
use std::net::Shutdown;
use std::sync::Arc;
use std::time::Duration;

use armor_socket::Stream;
use armor_wire::keep::Keep;
use armor_wire::registry::ComponentEntry;
use parking_lot::Mutex;

use crate::background_thread::spawn_background;
use crate::participant::Participant;
use crate::tap::TOOL_PREFIX;

/// Most data that wait for a peer without the right: it may have stopped reading.
pub const MOST_WITHOUT_RIGHT: u32 = 16;
/// How long the registry is waited for. Without its answer a link stays as it is.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);
/// A registry that has just started does not know a component that has not registered again. Each does
/// so within a delay and an attempt (see [`Directory`](crate::directory::Directory)); a busy host takes
/// longer.
const REGISTERED_WITHIN: Duration = Duration::from_secs(3);
/// Most peers that are remembered.
const MAX_REMEMBERED: usize = 1024;

/// A peer by its name and its process start.
type Peer = (String, u64);

/// The peers that were found not to be components.
#[derive(Clone, Default)]
pub(super) struct KeepRights {
    others: Arc<Mutex<HashSet<Peer>>>,
}

impl KeepRights {
    /// The policy of the link of a peer that asks for `keep`.
    pub fn grant(&self, keep: Keep, from: &str, instance: u64) -> Keep {
        let is_other = || {
            from.starts_with(TOOL_PREFIX) || self.others.lock().contains(&(from.into(), instance))
        };
        match keep {
            Keep::Last { count: 0 } => Keep::Latest,
            Keep::All { .. } if is_other() => Keep::Last { count: MOST_WITHOUT_RIGHT },
            keep => keep,
        }
    }

    /// Asks the registry, in a thread of its own, whether the peer is a component, and ends its link if it
    /// is not: its next one gets the newest few. Until then it is believed, since a component must not
    /// lose data while the registry answers, or while it has just started again.
    pub fn examine(
        &self,
        participant: &Arc<Participant>,
        from: &str,
        instance: u64,
        link: Arc<Stream>,
    ) {
        let (participant, others) = (Arc::clone(participant), Arc::clone(&self.others));
        let from = from.to_owned();
        let ask = move || {
            let directory = participant.directory();
            loop {
                let Ok(listing) = directory.fetch_listing(ANSWER_WITHIN) else { return };
                let is_it = |it: &ComponentEntry| it.name == from && it.instance == instance;
                let is_listed = listing.components.iter().any(is_it);
                match judge_peer(is_listed, directory.connected_for()) {
                    Verdict::Component => return,
                    Verdict::AskAgain { after } => std::thread::sleep(after),
                    Verdict::Other => break,
                }
            }
            tracing::warn!(
                "`{from}` asked that senders wait for it (keep=\"all\"), and is no component of the \
                 system: it gets the newest {MOST_WITHOUT_RIGHT}"
            );
            let mut others = others.lock();
            if others.len() >= MAX_REMEMBERED {
                others.clear();
            }
            others.insert((from, instance));
            drop(others);
            // One that has gone needs no end.
            let _ = link.shutdown(Shutdown::Both);
        };
        if let Err(error) = spawn_background("keep-rights", ask) {
            tracing::warn!("no thread to look for a peer at the registry: {error}");
        }
    }
}

/// What is known of a peer.
#[derive(Debug, PartialEq, Eq)]
enum Verdict {
    Component,
    /// The registry may not know all components yet.
    AskAgain {
        after: Duration,
    },
    Other,
}

/// Judges a peer by whether the registry lists it, to which this process has been connected for a time.
fn judge_peer(is_listed: bool, connected_for: Duration) -> Verdict {
    if is_listed {
        return Verdict::Component;
    }
    match REGISTERED_WITHIN.saturating_sub(connected_for) {
        Duration::ZERO => Verdict::Other,
        after => Verdict::AskAgain { after },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_registry_that_has_just_started_condemns_no_peer() {
        let s = Duration::from_secs;
        assert_eq!(judge_peer(true, s(0)), Verdict::Component);
        assert_eq!(judge_peer(false, s(1)), Verdict::AskAgain { after: REGISTERED_WITHIN - s(1) });
        assert_eq!(judge_peer(false, REGISTERED_WITHIN), Verdict::Other);
    }

    #[test]
    fn only_components_make_a_sender_wait() {
        let rights = KeepRights::default();
        let few = Keep::Last { count: MOST_WITHOUT_RIGHT };
        assert_eq!(rights.grant(Keep::ALL, "mapper", 7), Keep::ALL);
        assert_eq!(rights.grant(Keep::ALL, "tool-1", 7), few);
        rights.others.lock().insert(("stranger".into(), 7));
        assert_eq!(rights.grant(Keep::ALL, "stranger", 7), few);
        assert_eq!(rights.grant(Keep::ALL, "stranger", 8), Keep::ALL, "another process start");
        assert_eq!(rights.grant(Keep::Latest, "stranger", 7), Keep::Latest);
        assert_eq!(rights.grant(Keep::Last { count: 0 }, "mapper", 7), Keep::Latest);
    }
}
