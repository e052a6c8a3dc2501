//! The registry's directory on the simulated network, and the connection of a process to it.

use std::collections::BTreeMap;
use std::time::Duration;

use armor_registry::RegistryDirectory;
use armor_wire::backoff::Backoff;
use armor_wire::hello::{Hello, Purpose};
use armor_wire::liveness::Liveness;
use armor_wire::peer::{CloseReason, PeerAction, PeerEvent, PeerId};
use armor_wire::registry::{ComponentEntry, RegistryReply, RegistryRequest};

use super::network::{ConnectionId, Delivery, End, FromRegistry, Network, ToRegistry};

/// As in a run: `sdk/src/directory/background.rs`.
const RETRY: (Duration, Duration) = (Duration::from_millis(20), Duration::from_millis(400));

/// The registry's process.
pub struct RegistryHost {
    directory: RegistryDirectory,
    began: Duration,
    peers: BTreeMap<ConnectionId, Liveness>,
}

impl RegistryHost {
    pub fn new(instance: u64, began: Duration) -> Self {
        let directory = RegistryDirectory::new(instance, 1000.0);
        Self { directory, began, peers: BTreeMap::new() }
    }

    pub fn serves(&self, connection: ConnectionId) -> bool {
        self.peers.contains_key(&connection)
    }

    pub fn handle(&mut self, connection: ConnectionId, delivery: Delivery, network: &mut Network) {
        let (peer, now) = (PeerId(connection), network.now());
        if let Some(liveness) = self.peers.get_mut(&connection) {
            liveness.heard(now);
        }
        let event = match delivery {
            Delivery::ToRegistry(ToRegistry::Hello(hello)) => {
                self.peers.insert(connection, Liveness::new(now));
                let address = ([127, 0, 0, 1], 1).into();
                PeerEvent::Connected { peer, address, hello, preface: None }
            }
            // It is of the registry that was here before.
            _ if !self.serves(connection) => return,
            Delivery::ToRegistry(ToRegistry::Request(message)) => {
                PeerEvent::Message { peer, arrived: now - self.began, message }
            }
            Delivery::ToRegistry(ToRegistry::Beat) => PeerEvent::Beat { peer },
            _ => {
                self.peers.remove(&connection);
                PeerEvent::Closed { peer, reason: CloseReason::Ended }
            }
        };
        self.perform(event, network);
    }

    /// Beats, and ends connections that are silent.
    pub fn look(&mut self, network: &mut Network) {
        let now = network.now();
        let mut silent = Vec::new();
        for (connection, liveness) in &mut self.peers {
            if liveness.is_silent(now) {
                silent.push(*connection);
            } else if liveness.owes_beat(now) {
                liveness.spoke(now);
                network.send(*connection, End::Client, Delivery::FromRegistry(FromRegistry::Beat));
            }
        }
        for connection in silent {
            self.peers.remove(&connection);
            network.close(connection, End::Server);
            let peer = PeerId(connection);
            self.perform(PeerEvent::Closed { peer, reason: CloseReason::Silent }, network);
        }
    }

    fn perform(&mut self, event: PeerEvent<RegistryRequest>, network: &mut Network) {
        let now = network.now() - self.began;
        for action in self.directory.handle(event, now) {
            let mut send = |peer: PeerId, what| {
                network.send(peer.0, End::Client, Delivery::FromRegistry(what));
            };
            let ended = match action {
                PeerAction::Welcome { peer, .. } => {
                    send(peer, FromRegistry::Welcome);
                    None
                }
                PeerAction::Send { peer, message } => {
                    send(peer, FromRegistry::Reply(Box::new(message)));
                    None
                }
                PeerAction::Refuse { peer, .. } => {
                    send(peer, FromRegistry::Refusal);
                    Some(peer)
                }
                PeerAction::Close { peer, .. } => Some(peer),
            };
            if let Some(peer) = ended {
                self.peers.remove(&peer.0);
                network.close(peer.0, End::Server);
            }
        }
    }
}

/// The connection of a process to the registry, made again whenever it is lost.
pub struct RegistryClient {
    name: String,
    instance: u64,
    entry: Option<ComponentEntry>,
    connection: Option<ConnectionId>,
    is_welcomed: bool,
    liveness: Liveness,
    backoff: Backoff,
    next_attempt: Duration,
}

impl RegistryClient {
    pub fn new(name: &str, instance: u64, entry: Option<ComponentEntry>, now: Duration) -> Self {
        Self {
            name: name.into(),
            instance,
            entry,
            connection: None,
            is_welcomed: false,
            liveness: Liveness::new(now),
            backoff: Backoff::new(RETRY.0, RETRY.1, instance),
            next_attempt: now,
        }
    }

    pub fn is_on(&self, connection: ConnectionId) -> bool {
        self.connection == Some(connection)
    }

    pub fn connection(&self) -> Option<ConnectionId> {
        self.connection
    }

    /// Takes a delivery. Returns a reply, and whether everything must be declared again.
    pub fn hear(
        &mut self,
        delivery: Delivery,
        network: &mut Network,
    ) -> (Option<RegistryReply>, bool) {
        self.liveness.heard(network.now());
        match delivery {
            Delivery::FromRegistry(FromRegistry::Welcome) => {
                self.is_welcomed = true;
                self.backoff.reset();
                return (None, true);
            }
            Delivery::FromRegistry(FromRegistry::Reply(reply)) => return (Some(*reply), false),
            Delivery::FromRegistry(FromRegistry::Beat) => {}
            _ => self.lose(network.now()),
        }
        (None, false)
    }

    pub fn send(&mut self, request: RegistryRequest, network: &mut Network) {
        if let Some(connection) = self.connection.filter(|_| self.is_welcomed) {
            self.liveness.spoke(network.now());
            let request = ToRegistry::Request(request);
            network.send(connection, End::Server, Delivery::ToRegistry(request));
        }
    }

    /// Beats, notices silence, and connects again when it is time.
    pub fn look(&mut self, network: &mut Network) {
        let now = network.now();
        match self.connection {
            Some(connection) if self.liveness.is_silent(now) => {
                network.close(connection, End::Client);
                self.lose(now);
            }
            Some(connection) if self.liveness.owes_beat(now) && self.is_welcomed => {
                self.liveness.spoke(now);
                network.send(connection, End::Server, Delivery::ToRegistry(ToRegistry::Beat));
            }
            Some(_) => {}
            None if now >= self.next_attempt => {
                let connection = network.connect(true);
                let purpose = Purpose::Registry { entry: self.entry.clone() };
                let hello = Hello::new(&self.name, self.instance, purpose);
                let hello = Delivery::ToRegistry(ToRegistry::Hello(hello));
                network.send(connection, End::Server, hello);
                self.connection = Some(connection);
                self.liveness = Liveness::new(now);
            }
            None => {}
        }
    }

    fn lose(&mut self, now: Duration) {
        self.connection = None;
        self.is_welcomed = false;
        self.next_attempt = now + self.backoff.delay();
    }
}
