//! Who is there, what they publish, who waits for what: the registry without sockets or clocks.

mod lookups;

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::time::Duration;

use armor_socket::{Action, Event, PeerId};
use armor_wire::codec::encoded_len;
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode, Welcome};
use armor_wire::registry::{ComponentEntry, DataEntry, Reply, Request};

use crate::limits::{
    GIVE_UP, MAX_COMPONENTS, MAX_DATA, MAX_DATA_PER_COMPONENT, MAX_LISTING_LEN, MAX_WATCHERS,
};
use crate::texts;
use lookups::{Lookup, Lookups};

/// What the registry does.
pub type Actions = Vec<Action<Reply>>;

/// The registry's state. Everything in it belongs to a connection and goes with it.
pub struct Directory {
    /// This process start.
    instance: u64,
    /// System time when the clock behind `now` was 0, in seconds since the Unix epoch. Read once:
    /// whoever sets the host's clock does not move the system's time.
    epoch_s: f64,
    clients: BTreeMap<PeerId, Client>,
    /// Who holds a name.
    holders: BTreeMap<String, PeerId>,
    /// What is provided, by name.
    data: BTreeMap<String, (DataEntry, PeerId)>,
    lookups: Lookups,
    actions: Actions,
}

/// One connection.
struct Client {
    /// Name as it introduced itself.
    from: String,
    /// What it registered as; nothing for an observer.
    entry: Option<ComponentEntry>,
    /// When it last said anything.
    heard: Duration,
    /// Names of the data it provides.
    provides: BTreeSet<String>,
    watches: bool,
}

impl Directory {
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
            actions: Vec::new(),
        }
    }

    /// Takes an event in and says what is to be done.
    pub fn handle(&mut self, event: Event<Request>, now: Duration) -> Actions {
        match event {
            Event::Connected { peer, address, hello } => self.connected(peer, address, hello, now),
            Event::Message { peer, arrived, message } => {
                if let Some(client) = self.clients.get_mut(&peer) {
                    client.heard = now;
                    self.request(peer, message, arrived, now);
                }
            }
            Event::Beat { peer } => {
                if let Some(client) = self.clients.get_mut(&peer) {
                    client.heard = now;
                }
            }
            Event::Closed { peer, reason } => self.forget(peer, &reason.to_string()),
        }
        std::mem::take(&mut self.actions)
    }

    fn connected(&mut self, peer: PeerId, address: SocketAddr, hello: Hello, now: Duration) {
        let admitted = match hello.purpose {
            Purpose::Registry { entry } => self.admit(entry.as_ref(), now).map(|()| entry),
            _ => Err(texts::refusal(
                RefusalCode::WrongPurpose,
                "this is the registry; it serves neither links, configuration nor control".into(),
            )),
        };
        let entry = match admitted {
            Ok(entry) => entry,
            Err(refusal) => {
                tracing::warn!(%address, from = %texts::quoted(&hello.from), %refusal, "refused");
                self.actions.push(Action::Refuse { peer, refusal });
                return;
            }
        };
        let welcome =
            Welcome { name: "registry".into(), instance: self.instance, schema: String::new() };
        self.actions.push(Action::Welcome { peer, welcome });
        if let Some(entry) = &entry {
            tracing::info!(name = %entry.name, kind = %entry.kind, pid = entry.pid,
                endpoint = %entry.endpoint, "registered");
            self.holders.insert(entry.name.clone(), peer);
            self.tell_watchers(&Reply::Appeared { entry: entry.clone() });
        }
        let (from, provides) = (texts::quoted(&hello.from), BTreeSet::new());
        let name = entry.as_ref().map(|entry| entry.name.clone());
        let client = Client { from, entry, heard: now, provides, watches: false };
        self.clients.insert(peer, client);
        for lookup in name.map(|name| self.lookups.take(&name)).unwrap_or_default() {
            self.introduce(&lookup, peer);
        }
    }

    /// Makes room for who comes, or says why there is none.
    fn admit(&mut self, entry: Option<&ComponentEntry>, now: Duration) -> Result<(), Refusal> {
        let Some(entry) = entry else { return Ok(()) };
        texts::check_component(entry)?;
        if let Some((peer, holder, heard)) = self.holder(&entry.name) {
            let is_same_process = holder.instance == entry.instance;
            if !is_same_process && now.saturating_sub(heard) < GIVE_UP {
                return Err(texts::duplicate_component(holder));
            }
            let reason = format!("replaced by {}", texts::whereabouts(entry));
            self.forget(peer, &reason);
            self.actions.push(Action::Close { peer, reason });
        } else if self.holders.len() >= MAX_COMPONENTS {
            return Err(texts::limit("components", MAX_COMPONENTS));
        }
        Ok(())
    }

    fn holder(&self, name: &str) -> Option<(PeerId, &ComponentEntry, Duration)> {
        let peer = *self.holders.get(name)?;
        let client = self.clients.get(&peer)?;
        Some((peer, client.entry.as_ref()?, client.heard))
    }

    fn request(&mut self, peer: PeerId, request: Request, arrived: Duration, now: Duration) {
        match request {
            Request::Provide { request, entry } => self.provide(peer, request, entry),
            Request::Withdraw { data } => self.withdraw(peer, &data),
            Request::Lookup { request, data, schema, wait } => {
                self.lookup(Lookup { peer, request, schema }, data, wait);
            }
            Request::Cancel { request } => self.lookups.cancel(peer, request),
            Request::List { request } => self.list(peer, request),
            Request::Watch => self.watch(peer),
            Request::Time { asked_s } => {
                let received_s = self.epoch_s + arrived.as_secs_f64();
                let sent_s = self.epoch_s + now.as_secs_f64();
                self.send(peer, Reply::Time { asked_s, received_s, sent_s });
            }
            Request::Beat => {}
        }
    }

    fn provide(&mut self, peer: PeerId, request: u64, entry: DataEntry) {
        let reply = match self.check_provided(peer, &entry) {
            Ok(()) => Reply::Provided { request },
            Err(refusal) => {
                self.send(peer, Reply::Refused { request, refusal });
                return;
            }
        };
        self.send(peer, reply);
        if let Some(client) = self.clients.get_mut(&peer) {
            client.provides.insert(entry.data.clone());
        }
        let waiting = self.lookups.take(&entry.data);
        let name = entry.data.clone();
        self.data.insert(name.clone(), (entry, peer));
        for lookup in waiting {
            self.answer(&lookup, &name);
        }
    }

    fn check_provided(&self, peer: PeerId, entry: &DataEntry) -> Result<(), Refusal> {
        let client = self.clients.get(&peer);
        let Some((client, owner)) = client.and_then(|c| Some((c, c.entry.as_ref()?))) else {
            let text = "an observer cannot provide data; say hello with an entry first";
            return Err(texts::refusal(RefusalCode::WrongPurpose, text.into()));
        };
        texts::check_data(entry, owner)?;
        if self.data.contains_key(&entry.data) {
            // Data bears its component's name, so the holder is the asker itself.
            return Err(texts::duplicate_data(&entry.data, owner));
        }
        if client.provides.len() >= MAX_DATA_PER_COMPONENT {
            return Err(texts::limit("outputs of this component", MAX_DATA_PER_COMPONENT));
        }
        if self.data.len() >= MAX_DATA {
            return Err(texts::limit("outputs", MAX_DATA));
        }
        Ok(())
    }

    fn withdraw(&mut self, peer: PeerId, data: &str) {
        if let Some(client) = self.clients.get_mut(&peer)
            && client.provides.remove(data)
        {
            self.data.remove(data);
        }
    }

    fn lookup(&mut self, lookup: Lookup, data: String, wait: bool) {
        if self.data.contains_key(&data) {
            return self.answer(&lookup, &data);
        }
        if let Some((holder, ..)) = self.holder(&data) {
            return self.introduce(&lookup, holder);
        }
        let (peer, request) = (lookup.peer, lookup.request);
        let outcome = if wait {
            self.lookups.wait(lookup, data)
        } else {
            let near = crate::similar::similar(
                &data[..data.floor_char_boundary(2 * armor_wire::name::MAX_NAME_LEN)],
                self.data.keys().map(String::as_str),
            );
            let component = data.split_once('.').and_then(|(name, _)| self.holder(name));
            Err(texts::unknown(&data, &near, component.map(|(_, entry, _)| entry)))
        };
        if let Err(refusal) = outcome {
            self.send(peer, Reply::Refused { request, refusal });
        }
    }

    /// Answers a lookup of data that is there.
    fn answer(&mut self, lookup: &Lookup, data: &str) {
        let Some((entry, holder)) = self.data.get(data) else { return };
        let provider = self.clients.get(holder).and_then(|client| client.entry.as_ref());
        let (Some(provider), Some(asker)) = (provider, self.clients.get(&lookup.peer)) else {
            return;
        };
        let request = lookup.request;
        let reply = if lookup.schema.is_empty() || lookup.schema == entry.schema {
            Reply::Found { request, entry: entry.clone(), provider: provider.clone() }
        } else {
            let asker = asker.entry.as_ref().map_or(asker.from.as_str(), |entry| &entry.name);
            let refusal = texts::mismatch((asker, &lookup.schema), entry, provider);
            Reply::Refused { request, refusal }
        };
        self.send(lookup.peer, reply);
    }

    /// Answers a lookup of a process that is there.
    fn introduce(&mut self, lookup: &Lookup, holder: PeerId) {
        let Some(provider) = self.clients.get(&holder).and_then(|client| client.entry.clone())
        else {
            return;
        };
        let (data, nothing) = (provider.name.clone(), String::new());
        let entry = DataEntry { data, type_name: nothing.clone(), schema: nothing, latched: false };
        self.send(lookup.peer, Reply::Found { request: lookup.request, entry, provider });
    }

    fn list(&mut self, peer: PeerId, request: u64) {
        let components: Vec<_> =
            self.holders.keys().filter_map(|name| Some(self.holder(name)?.1.clone())).collect();
        let data: Vec<_> = self.data.values().map(|(entry, _)| entry.clone()).collect();
        let fits = |listing: &Reply| encoded_len(listing).is_ok_and(|len| len <= MAX_LISTING_LEN);
        let mut listing = Reply::Listing { request, components, data };
        if !fits(&listing)
            && let Reply::Listing { data, .. } = &mut listing
        {
            data.iter_mut().for_each(|entry| entry.schema.clear());
        }
        if !fits(&listing) {
            let text = format!("the listing is longer than {MAX_LISTING_LEN} bytes; watch instead");
            let refusal = texts::refusal(RefusalCode::Limit, text);
            listing = Reply::Refused { request, refusal };
        }
        self.send(peer, listing);
    }

    fn watch(&mut self, peer: PeerId) {
        let watchers = self.clients.values().filter(|client| client.watches).count();
        let Some(client) = self.clients.get_mut(&peer) else { return };
        if client.watches {
            return;
        }
        if watchers >= MAX_WATCHERS {
            let reason = texts::limit("watchers", MAX_WATCHERS).text;
            self.forget(peer, &reason);
            self.actions.push(Action::Close { peer, reason });
            return;
        }
        client.watches = true;
        let present: Vec<_> =
            self.clients.values().filter_map(|client| client.entry.clone()).collect();
        for entry in present {
            self.send(peer, Reply::Appeared { entry });
        }
    }

    /// Withdraws all that a connection brought.
    fn forget(&mut self, peer: PeerId, reason: &str) {
        let Some(client) = self.clients.remove(&peer) else { return };
        self.lookups.forget(peer);
        for data in &client.provides {
            self.data.remove(data);
        }
        if let Some(entry) = client.entry {
            tracing::info!(name = %entry.name, pid = entry.pid, %reason, "gone");
            self.holders.remove(&entry.name);
            self.tell_watchers(&Reply::Gone { entry });
        }
    }

    fn tell_watchers(&mut self, reply: &Reply) {
        let watchers = self.clients.iter().filter(|(_, client)| client.watches);
        self.actions
            .extend(watchers.map(|(peer, _)| Action::Send { peer: *peer, message: reply.clone() }));
    }

    fn send(&mut self, peer: PeerId, message: Reply) {
        self.actions.push(Action::Send { peer, message });
    }
}

#[cfg(test)]
mod tests;
