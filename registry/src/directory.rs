//! The registered processes, their outputs, and the lookups that wait: the registry without sockets
//! or clocks.

mod lookups;
mod readers;

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::time::Duration;

use armor_socket::FaultTable;
use armor_wire::acting::Preface;
use armor_wire::codec::encoded_len;
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode, Welcome};
use armor_wire::peer::{PeerAction, PeerEvent, PeerId};
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryReply, RegistryRequest};
use armor_wire::run_key::RunSecret;

use crate::limits::{
    GIVE_UP, MAX_COMPONENTS, MAX_DATA, MAX_DATA_PER_COMPONENT, MAX_LISTING_LEN, MAX_WATCHERS,
};
use crate::refusals;
use lookups::{Lookups, WaitingLookup};
use readers::{ForeignHost, ReadDecision, ReaderTable, refuse_unknown_links};

/// What the name of the launcher's connection begins with; its process id follows.
const LAUNCHER_PREFIX: &str = "launcher-";
/// The name of the connection on which configd reports the links of the file.
const CONFIGD: &str = "configd";

/// The actions that follow from an event.
pub type Actions = Vec<PeerAction<RegistryReply>>;

/// The registry's state. Everything in it belongs to a connection and goes with it.
pub struct RegistryDirectory {
    /// This process start.
    instance: u64,
    /// System time when the clock behind `now` was 0, in seconds since the Unix epoch. Read once:
    /// setting the host's clock does not change the system's time.
    epoch_s: f64,
    clients: BTreeMap<PeerId, RegistryClient>,
    /// The connection that holds each name.
    holders: BTreeMap<String, PeerId>,
    /// What is provided, by name.
    data: BTreeMap<String, (DataEntry, PeerId)>,
    lookups: Lookups,
    /// The secret of the run; none for a registry that was started by hand.
    secret: Option<RunSecret>,
    /// Names that belong to processes of the launcher.
    reserved: BTreeSet<String>,
    /// What the components on other hosts may read.
    readers: ReaderTable,
    /// Refusals of data that were logged.
    read_faults: FaultTable<String>,
    actions: Actions,
}

/// One connection.
struct RegistryClient {
    /// Name as it introduced itself.
    from: String,
    /// What it registered as; nothing for an observer.
    entry: Option<ComponentEntry>,
    /// When it last sent a frame.
    heard: Duration,
    /// Names of the data it provides.
    provides: BTreeSet<String>,
    watches: bool,
    /// It has proven that the launcher has started it.
    is_proven: bool,
    /// It has proven that it is the launcher.
    is_launcher: bool,
    /// It has proven that it is configd.
    is_configd: bool,
    /// The other host on which it runs.
    host: Option<ForeignHost>,
    /// The data that it may read, whatever the file specifies meanwhile; only of a process of another host.
    granted: BTreeSet<String>,
}

impl RegistryDirectory {
    /// An empty registry. `epoch_s` is the system time, in seconds since the Unix epoch, when the
    /// clock behind the later `now` was 0.
    pub fn new(instance: u64, epoch_s: f64) -> Self {
        Self {
            instance,
            epoch_s,
            clients: BTreeMap::new(),
            holders: BTreeMap::new(),
            data: BTreeMap::new(),
            lookups: Lookups::default(),
            secret: None,
            reserved: BTreeSet::new(),
            readers: ReaderTable::default(),
            read_faults: FaultTable::default(),
            actions: Vec::new(),
        }
    }

    /// With the secret of a run: names of the run belong to the processes that its launcher starts.
    pub fn with_secret(self, secret: Option<RunSecret>) -> Self {
        Self { secret, ..self }
    }

    /// Handles an event and returns the resulting actions.
    pub fn handle(&mut self, event: PeerEvent<RegistryRequest>, now: Duration) -> Actions {
        match event {
            PeerEvent::Connected { peer, address, hello, preface } => {
                self.welcome_client(peer, address, hello, preface.as_ref(), now);
            }
            PeerEvent::Message { peer, arrived, message } => {
                if let Some(client) = self.clients.get_mut(&peer) {
                    client.heard = now;
                    self.answer_request(peer, message, arrived, now);
                }
            }
            PeerEvent::Beat { peer } => {
                if let Some(client) = self.clients.get_mut(&peer) {
                    client.heard = now;
                }
            }
            PeerEvent::Closed { peer, reason } => self.forget_client(peer, &reason.to_string()),
        }
        std::mem::take(&mut self.actions)
    }

    fn welcome_client(
        &mut self,
        peer: PeerId,
        address: SocketAddr,
        hello: Hello,
        preface: Option<&Preface>,
        now: Duration,
    ) {
        let is_proven = self.secret.is_some_and(|secret| secret.key_of(&hello.from).verify(&hello))
            && hello.purpose.entry().is_none_or(|entry| entry.name == hello.from);
        let admitted = match hello.purpose {
            Purpose::Registry { entry } => {
                self.check_admission(entry.as_ref(), is_proven, now).map(|()| entry)
            }
            _ => Err(refusals::build_refusal(
                RefusalCode::WrongPurpose,
                "this is the registry; it serves neither links, configuration nor control".into(),
            )),
        };
        let entry = match admitted {
            Ok(entry) => entry,
            Err(refusal) => {
                tracing::warn!(%address, from = %refusals::quote_text(&hello.from), %refusal, "refused");
                self.actions.push(PeerAction::Refuse { peer, refusal });
                return;
            }
        };
        let welcome =
            Welcome { name: "registry".into(), instance: self.instance, schema: String::new() };
        self.actions.push(PeerAction::Welcome { peer, welcome });
        if let Some(entry) = &entry {
            tracing::info!(name = %entry.name, kind = %entry.kind, pid = entry.pid,
                endpoint = %entry.endpoint, "registered");
            self.holders.insert(entry.name.clone(), peer);
            self.notify_watchers(&RegistryReply::Appeared { entry: entry.clone() });
        }
        let is_daemon = is_proven && entry.is_none();
        let is_launcher = is_daemon && hello.from.starts_with(LAUNCHER_PREFIX);
        let is_configd = is_daemon && hello.from == CONFIGD;
        let (from, provides) = (refusals::quote_text(&hello.from), BTreeSet::new());
        let name = entry.as_ref().map(|entry| entry.name.clone());
        let client = RegistryClient {
            from,
            entry,
            heard: now,
            provides,
            watches: false,
            is_proven,
            is_launcher,
            is_configd,
            host: ForeignHost::of(preface),
            granted: BTreeSet::new(),
        };
        self.clients.insert(peer, client);
        for lookup in name.map(|name| self.lookups.take_waiting(&name)).unwrap_or_default() {
            self.answer_with_process(&lookup, peer);
        }
    }

    /// Checks whether a process can register; a holder of its name that has fallen silent loses the
    /// name.
    fn check_admission(
        &mut self,
        entry: Option<&ComponentEntry>,
        is_proven: bool,
        now: Duration,
    ) -> Result<(), Refusal> {
        let Some(entry) = entry else { return Ok(()) };
        refusals::check_component(entry)?;
        if self.secret.is_some() && !is_proven {
            let is_reserved =
                refusals::is_reserved(&entry.name) || self.reserved.contains(&entry.name);
            if is_reserved {
                return Err(refusals::refuse_reserved(&entry.name));
            }
        }
        if let Some((peer, holder, heard)) = self.find_holder(&entry.name) {
            // A process that reconnects may arrive before the end of its old connection is noticed.
            let is_same_process = holder.instance == entry.instance;
            let has_priority = is_proven && !self.clients.get(&peer).is_some_and(|it| it.is_proven);
            if !is_same_process && !has_priority && now.saturating_sub(heard) < GIVE_UP {
                return Err(refusals::refuse_duplicate_component(holder));
            }
            let reason = format!("replaced by {}", refusals::describe_process(entry));
            self.forget_client(peer, &reason);
            self.actions.push(PeerAction::Close { peer, reason });
        } else if self.holders.len() >= MAX_COMPONENTS {
            return Err(refusals::refuse_limit("components", MAX_COMPONENTS));
        }
        Ok(())
    }

    fn find_holder(&self, name: &str) -> Option<(PeerId, &ComponentEntry, Duration)> {
        let peer = *self.holders.get(name)?;
        let client = self.clients.get(&peer)?;
        Some((peer, client.entry.as_ref()?, client.heard))
    }

    fn answer_request(
        &mut self,
        peer: PeerId,
        request: RegistryRequest,
        arrived: Duration,
        now: Duration,
    ) {
        match request {
            RegistryRequest::Provide { request, entry } => self.provide_data(peer, request, entry),
            RegistryRequest::Withdraw { data } => self.withdraw_data(peer, &data),
            RegistryRequest::Lookup { request, data, schema, wait } => {
                self.look_up_data(WaitingLookup { peer, request, schema }, data, wait);
            }
            RegistryRequest::Cancel { request } => self.lookups.cancel_lookup(peer, request),
            RegistryRequest::List { request } => self.send_listing(peer, request),
            RegistryRequest::Watch => self.add_watcher(peer),
            RegistryRequest::Time { asked_s } => {
                let received_s = self.epoch_s + arrived.as_secs_f64();
                let sent_s = self.epoch_s + now.as_secs_f64();
                self.send_reply(peer, RegistryReply::Time { asked_s, received_s, sent_s });
            }
            RegistryRequest::Beat => {}
            RegistryRequest::Reserve { names } => self.reserve_names(peer, names),
            RegistryRequest::Readers { readers } => self.take_readers(peer, readers),
        }
    }

    /// Takes the names that belong to processes which the launcher starts.
    fn reserve_names(&mut self, peer: PeerId, names: Vec<String>) {
        let is_launcher = self.clients.get(&peer).is_some_and(|client| client.is_launcher);
        if is_launcher {
            self.reserved = names.into_iter().take(MAX_COMPONENTS).collect();
            return;
        }
        self.close_client(peer, "only the launcher of this run reserves names");
    }

    fn close_client(&mut self, peer: PeerId, reason: &str) {
        self.forget_client(peer, reason);
        self.actions.push(PeerAction::Close { peer, reason: reason.into() });
    }

    fn provide_data(&mut self, peer: PeerId, request: u64, entry: DataEntry) {
        let reply = match self.check_provided(peer, &entry) {
            Ok(()) => RegistryReply::Provided { request },
            Err(refusal) => {
                self.send_reply(peer, RegistryReply::Refused { request, refusal });
                return;
            }
        };
        self.send_reply(peer, reply);
        if let Some(client) = self.clients.get_mut(&peer) {
            client.provides.insert(entry.data.clone());
        }
        let waiting = self.lookups.take_waiting(&entry.data);
        let name = entry.data.clone();
        self.data.insert(name.clone(), (entry, peer));
        for lookup in waiting {
            self.answer_lookup(lookup, &name);
        }
    }

    fn check_provided(&self, peer: PeerId, entry: &DataEntry) -> Result<(), Refusal> {
        let client = self.clients.get(&peer);
        let Some((client, owner)) = client.and_then(|c| Some((c, c.entry.as_ref()?))) else {
            let text = "an observer cannot provide data; send a hello with an entry first";
            return Err(refusals::build_refusal(RefusalCode::WrongPurpose, text.into()));
        };
        refusals::check_data(entry, owner)?;
        if self.data.contains_key(&entry.data) {
            // The name of data begins with its component's name, so the asker itself provides it
            // already.
            return Err(refusals::refuse_duplicate_data(&entry.data, owner));
        }
        if client.provides.len() >= MAX_DATA_PER_COMPONENT {
            return Err(refusals::refuse_limit(
                "outputs of this component",
                MAX_DATA_PER_COMPONENT,
            ));
        }
        if self.data.len() >= MAX_DATA {
            return Err(refusals::refuse_limit("outputs", MAX_DATA));
        }
        Ok(())
    }

    fn withdraw_data(&mut self, peer: PeerId, data: &str) {
        if let Some(client) = self.clients.get_mut(&peer)
            && client.provides.remove(data)
        {
            self.data.remove(data);
        }
    }

    fn look_up_data(&mut self, lookup: WaitingLookup, data: String, wait: bool) {
        if let Some((holder, ..)) = self.find_holder(&data) {
            return self.answer_with_process(&lookup, holder);
        }
        let (peer, request) = (lookup.peer, lookup.request);
        // The name of a process contains no dot, and who runs is no secret.
        let is_readable = match data.contains('.').then(|| self.decide_read(peer, &data)) {
            None | Some(ReadDecision::Allowed) => true,
            Some(ReadDecision::Unknown) if wait => false,
            Some(ReadDecision::Unknown) => {
                let refusal = refuse_unknown_links();
                return self.send_reply(peer, RegistryReply::Refused { request, refusal });
            }
            Some(ReadDecision::Refused(refusal)) => {
                return self.send_reply(peer, RegistryReply::Refused { request, refusal });
            }
        };
        if is_readable && self.data.contains_key(&data) {
            return self.answer_lookup(lookup, &data);
        }
        let outcome = if wait {
            self.lookups.add_lookup(lookup, data)
        } else {
            let near = crate::similar::find_similar(
                &data[..data.floor_char_boundary(2 * armor_wire::name::MAX_NAME_LEN)],
                self.data.keys().map(String::as_str),
            );
            let component = data.split_once('.').and_then(|(name, _)| self.find_holder(name));
            Err(refusals::refuse_unknown(&data, &near, component.map(|(_, entry, _)| entry)))
        };
        if let Err(refusal) = outcome {
            self.send_reply(peer, RegistryReply::Refused { request, refusal });
        }
    }

    /// Answers a lookup of registered data; one that may not be answered yet waits on.
    fn answer_lookup(&mut self, lookup: WaitingLookup, data: &str) {
        let (peer, request) = (lookup.peer, lookup.request);
        let outcome = match self.decide_read(peer, data) {
            ReadDecision::Allowed => return self.answer_reader(&lookup, data),
            ReadDecision::Refused(refusal) => Err(refusal),
            ReadDecision::Unknown => self.lookups.add_lookup(lookup, data.to_owned()),
        };
        if let Err(refusal) = outcome {
            self.send_reply(peer, RegistryReply::Refused { request, refusal });
        }
    }

    /// Answers a lookup of data that the client may read.
    fn answer_reader(&mut self, lookup: &WaitingLookup, data: &str) {
        let Some((entry, holder)) = self.data.get(data) else { return };
        let provider = self.clients.get(holder).and_then(|client| client.entry.as_ref());
        let (Some(provider), Some(asker)) = (provider, self.clients.get(&lookup.peer)) else {
            return;
        };
        let request = lookup.request;
        let reply = if lookup.schema.is_empty() || lookup.schema == entry.schema {
            let (entry, provider) = (entry.clone(), provider.clone());
            let key = self.grant_link(lookup.peer, data, &provider);
            RegistryReply::Found { request, entry, provider, key }
        } else {
            let asker = asker.entry.as_ref().map_or(asker.from.as_str(), |entry| &entry.name);
            let refusal = refusals::refuse_mismatch((asker, &lookup.schema), entry, provider);
            RegistryReply::Refused { request, refusal }
        };
        self.send_reply(lookup.peer, reply);
    }

    /// Answers a lookup of a registered process.
    fn answer_with_process(&mut self, lookup: &WaitingLookup, holder: PeerId) {
        let Some(provider) = self.clients.get(&holder).and_then(|client| client.entry.clone())
        else {
            return;
        };
        let (data, nothing) = (provider.name.clone(), String::new());
        let entry = DataEntry { data, type_name: nothing.clone(), schema: nothing, latched: false };
        let request = lookup.request;
        self.send_reply(lookup.peer, RegistryReply::Found { request, entry, provider, key: None });
    }

    fn send_listing(&mut self, peer: PeerId, request: u64) {
        let components: Vec<_> = self
            .holders
            .keys()
            .filter_map(|name| Some(self.find_holder(name)?.1.clone()))
            .collect();
        let data: Vec<_> = self.data.values().map(|(entry, _)| entry.clone()).collect();
        let fits =
            |listing: &RegistryReply| encoded_len(listing).is_ok_and(|len| len <= MAX_LISTING_LEN);
        let mut listing = RegistryReply::Listing { request, components, data };
        if !fits(&listing)
            && let RegistryReply::Listing { data, .. } = &mut listing
        {
            data.iter_mut().for_each(|entry| entry.schema.clear());
        }
        if !fits(&listing) {
            let text = format!("the listing is longer than {MAX_LISTING_LEN} bytes; watch instead");
            let refusal = refusals::build_refusal(RefusalCode::Limit, text);
            listing = RegistryReply::Refused { request, refusal };
        }
        self.send_reply(peer, listing);
    }

    fn add_watcher(&mut self, peer: PeerId) {
        let watchers = self.clients.values().filter(|client| client.watches).count();
        let Some(client) = self.clients.get_mut(&peer) else { return };
        if client.watches {
            return;
        }
        if watchers >= MAX_WATCHERS {
            let reason = refusals::refuse_limit("watchers", MAX_WATCHERS).text;
            self.forget_client(peer, &reason);
            self.actions.push(PeerAction::Close { peer, reason });
            return;
        }
        client.watches = true;
        let present: Vec<_> =
            self.clients.values().filter_map(|client| client.entry.clone()).collect();
        for entry in present {
            self.send_reply(peer, RegistryReply::Appeared { entry });
        }
    }

    /// Removes a connection with its registration, outputs and lookups.
    fn forget_client(&mut self, peer: PeerId, reason: &str) {
        let Some(client) = self.clients.remove(&peer) else { return };
        self.lookups.forget_peer(peer);
        for data in &client.provides {
            self.data.remove(data);
        }
        if let Some(entry) = client.entry {
            tracing::info!(name = %entry.name, pid = entry.pid, %reason, "gone");
            self.holders.remove(&entry.name);
            self.notify_watchers(&RegistryReply::Gone { entry });
        }
    }

    fn notify_watchers(&mut self, reply: &RegistryReply) {
        let watchers = self.clients.iter().filter(|(_, client)| client.watches);
        self.actions.extend(
            watchers.map(|(peer, _)| PeerAction::Send { peer: *peer, message: reply.clone() }),
        );
    }

    fn send_reply(&mut self, peer: PeerId, message: RegistryReply) {
        self.actions.push(PeerAction::Send { peer, message });
    }
}

#[cfg(test)]
mod tests;
