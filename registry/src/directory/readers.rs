//! What the processes of other hosts may read: the data that the file leads to the components there.
//!
//! configd reports the links of each version of the file. A process of this host is of the same user, and
//! may read everything.

use std::collections::BTreeMap;

use armor_wire::acting::{Preface, Rights};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::name::split_data;
use armor_wire::peer::PeerId;
use armor_wire::registry::{ComponentEntry, DataReader};
use armor_wire::run_key::KEY_LEN;

use super::RegistryDirectory;
use crate::limits::MAX_COMPONENTS;
use crate::refusals;

/// The processes whose data every host may read: the mission's marking and the state of the file, which
/// each screen shows.
const OPEN_PROVIDERS: [&str; 2] = ["executive", "configuration"];

/// Another host, as its gate has introduced it.
#[derive(Clone, Debug)]
pub(super) struct ForeignHost {
    name: String,
    /// The components that the file places there.
    components: Vec<String>,
}

/// Whether a process may read data.
pub(super) enum ReadDecision {
    Allowed,
    /// configd has not reported the links yet.
    Unknown,
    Refused(Refusal),
}

/// The data that each component may read.
#[derive(Default)]
pub(super) struct ReaderTable {
    /// None until configd has reported them.
    readers: Option<BTreeMap<String, DataReader>>,
}

impl ForeignHost {
    pub(super) fn of(preface: Option<&Preface>) -> Option<Self> {
        let Preface { name, rights: Rights::Host { components } } = preface? else { return None };
        Some(Self { name: name.clone(), components: components.clone() })
    }
}

impl ReaderTable {
    fn decide(&self, host: &ForeignHost, data: &str) -> ReadDecision {
        let provider = split_data(data).map_or(data, |(provider, _)| provider);
        // Its own components run as the same user there.
        let is_own = || host.components.iter().any(|component| component == provider);
        if OPEN_PROVIDERS.contains(&provider) || is_own() {
            return ReadDecision::Allowed;
        }
        let Some(readers) = &self.readers else { return ReadDecision::Unknown };
        let mut there = host.components.iter().filter_map(|component| readers.get(component));
        if there.any(|reader| reader.reads_all || reader.data.iter().any(|one| one == data)) {
            return ReadDecision::Allowed;
        }
        ReadDecision::Refused(refusals::refuse_reader(&host.name, &host.components, data))
    }
}

impl RegistryDirectory {
    /// Takes the links of the file from configd, and answers the lookups that have waited for them.
    pub(super) fn take_readers(&mut self, peer: PeerId, readers: Vec<DataReader>) {
        if !self.clients.get(&peer).is_some_and(|client| client.is_configd) {
            let reason = "only configd of this run reports the links of the file";
            return self.close_client(peer, reason);
        }
        let readers = readers.into_iter().take(MAX_COMPONENTS);
        let readers = readers.map(|reader| (reader.component.clone(), reader)).collect();
        self.readers.readers = Some(readers);
        let provided: Vec<_> = self.data.keys().cloned().collect();
        for data in provided {
            for lookup in self.lookups.take_waiting(&data) {
                self.answer_lookup(lookup, &data);
            }
        }
    }

    /// Decides whether the process behind a connection may read data.
    pub(super) fn decide_read(&self, peer: PeerId, data: &str) -> ReadDecision {
        let Some(client) = self.clients.get(&peer) else { return ReadDecision::Allowed };
        let Some(host) = &client.host else { return ReadDecision::Allowed };
        // A registry that was started by hand knows no links. What a process was granted it keeps, as it
        // keeps the links of the version of the file that it was started with.
        if self.secret.is_none() || client.granted.contains(data) {
            return ReadDecision::Allowed;
        }
        let decision = self.readers.decide(host, data);
        if let ReadDecision::Refused(refusal) = &decision
            && self.read_faults.is_new(None, refusal.text.clone())
        {
            tracing::warn!("refused: {refusal}; further ones like it are not logged");
        }
        decision
    }

    /// Returns the key with which the process behind a connection proves to the provider that it may read
    /// data; none for a process of this host, which needs none.
    pub(super) fn grant_link(
        &mut self,
        peer: PeerId,
        data: &str,
        provider: &ComponentEntry,
    ) -> Option<[u8; KEY_LEN]> {
        let secret = self.secret?;
        let client = self.clients.get_mut(&peer)?;
        let host = client.host.as_ref()?;
        client.granted.insert(data.to_owned());
        let key = secret.key_of(&provider.name);
        Some(key.key_of_link(&host.name, data, provider.instance).to_bytes())
    }
}

/// The refusal of a lookup that cannot wait for configd.
pub(super) fn refuse_unknown_links() -> Refusal {
    let text = "configd has not reported the links of the file yet; try again in a moment";
    refusals::build_refusal(RefusalCode::Limit, text.into())
}
