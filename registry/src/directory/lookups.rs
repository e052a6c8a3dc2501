//! The lookups that wait for a provider.

use std::collections::BTreeMap;

use armor_wire::hello::Refusal;
use armor_wire::name::{is_name, split_data};
use armor_wire::peer::PeerId;

use crate::limits::{MAX_SCHEMA_LEN, MAX_WAITING, MAX_WAITING_PER_CONNECTION};
use crate::refusals;

/// A lookup that waits for its provider.
#[derive(Clone, Debug)]
pub(super) struct WaitingLookup {
    pub(super) peer: PeerId,
    pub(super) request: u64,
    /// What the asker expects; empty takes any.
    pub(super) schema: String,
}

/// All that wait, by asker and by data.
#[derive(Default)]
pub(super) struct Lookups {
    /// What each asker's waiting requests are for.
    wanted: BTreeMap<(PeerId, u64), String>,
    /// The lookups of each data or process, oldest first.
    waiting: BTreeMap<String, Vec<WaitingLookup>>,
}

impl Lookups {
    /// Keeps a lookup until its data or its process is registered.
    pub(super) fn add_lookup(
        &mut self,
        lookup: WaitingLookup,
        data: String,
    ) -> Result<(), Refusal> {
        if split_data(&data).is_none() && !is_name(&data) {
            return Err(refusals::refuse_malformed(format!(
                "data is named `COMPONENT.OUTPUT` and a process `COMPONENT`, not {}",
                refusals::quote_text(&data)
            )));
        }
        if lookup.schema.len() > MAX_SCHEMA_LEN {
            let text = format!("a schema longer than {MAX_SCHEMA_LEN} bytes matches nothing");
            return Err(refusals::refuse_malformed(text));
        }
        let key = (lookup.peer, lookup.request);
        if self.wanted.contains_key(&key) {
            return Err(refusals::refuse_malformed(format!(
                "request {} waits already",
                lookup.request
            )));
        }
        let own = self.wanted.range((lookup.peer, 0)..=(lookup.peer, u64::MAX)).count();
        if own >= MAX_WAITING_PER_CONNECTION {
            return Err(refusals::refuse_limit(
                "waiting lookups of yours",
                MAX_WAITING_PER_CONNECTION,
            ));
        }
        if self.wanted.len() >= MAX_WAITING {
            return Err(refusals::refuse_limit("waiting lookups", MAX_WAITING));
        }
        self.wanted.insert(key, data.clone());
        self.waiting.entry(data).or_default().push(lookup);
        Ok(())
    }

    #[cfg(test)]
    pub(super) fn is_empty(&self) -> bool {
        self.wanted.is_empty() && self.waiting.is_empty()
    }

    /// Removes and returns the lookups of `data`, which may be the name of a process.
    pub(super) fn take_waiting(&mut self, data: &str) -> Vec<WaitingLookup> {
        let taken = self.waiting.remove(data).unwrap_or_default();
        for lookup in &taken {
            self.wanted.remove(&(lookup.peer, lookup.request));
        }
        taken
    }

    /// Drops one lookup.
    pub(super) fn cancel_lookup(&mut self, peer: PeerId, request: u64) {
        let Some(data) = self.wanted.remove(&(peer, request)) else { return };
        if let Some(waiting) = self.waiting.get_mut(&data) {
            waiting.retain(|lookup| (lookup.peer, lookup.request) != (peer, request));
            if waiting.is_empty() {
                self.waiting.remove(&data);
            }
        }
    }

    /// Drops all lookups of a connection.
    pub(super) fn forget_peer(&mut self, peer: PeerId) {
        let own: Vec<u64> =
            self.wanted.range((peer, 0)..=(peer, u64::MAX)).map(|((_, n), _)| *n).collect();
        for request in own {
            self.cancel_lookup(peer, request);
        }
    }
}
