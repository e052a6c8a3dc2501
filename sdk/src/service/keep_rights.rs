//! Who may make a sender wait. Only the file gives a component that right (`keep="all"`); any other peer
//! that asks for everything gets the newest few, as a tool does.

use std::collections::HashSet;
use std::net::Shutdown;
use std::sync::Arc;
use std::time::Duration;

use armor_socket::Stream;
use armor_wire::keep::Keep;
use parking_lot::Mutex;

use crate::background_thread::spawn_background;
use crate::participant::Participant;
use crate::tap::TOOL_PREFIX;

/// Most data that wait for a peer without the right: it may have stopped reading.
pub const MOST_WITHOUT_RIGHT: u32 = 16;
/// How long the registry is waited for. Without its answer a link stays as it is.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);
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
    /// lose data while the registry answers.
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
            let Ok(listing) = participant.directory().fetch_listing(ANSWER_WITHIN) else { return };
            let is_it = |name: &str, start: u64| name == from && start == instance;
            if listing.components.iter().any(|it| is_it(&it.name, it.instance)) {
                return;
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

#[cfg(test)]
mod tests {
    use super::*;

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
