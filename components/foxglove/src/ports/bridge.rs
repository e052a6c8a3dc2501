//! What all clients share: the channels, the connections and the commander of one system.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use armor_inspect::SystemWatch;
use armor_recording::OutputSelection;
use armor_sdk::directory::Directory;
use armor_sdk::operator::Operator;
use armor_wire::config::ListedParameter;
use armor_wire::name::split_data;
use parking_lot::Mutex;
use serde_json::{Value, json};
use tokio::sync::Semaphore;

use super::channel::{ChannelReader, ChannelSource, ViewerChannel};
use super::channel_table::ChannelTable;
use super::commander::Commander;
use super::mission_services::MissionService;
use super::parameter_desk::{describe_parameter, list_parameters, name_parameter};
use super::viewer_messages::{ViewerClient, ViewerClients};
use crate::connection_graph::ConnectionGraph;
use crate::outbox::{OutgoingMessage, ViewerOutbox};
use crate::viewer_protocol::{compose_advertise, compose_unadvertise};

/// Requests of clients that ask a process of the system and take a thread while they wait.
const MAX_ASKING: usize = 4;
/// Time within which the registry must list the outputs.
const LISTED_WITHIN: Duration = Duration::from_secs(2);

/// What one system shows to its viewers.
pub(super) struct Bridge {
    pub(super) commander: Arc<Commander>,
    /// The name of this component.
    component: String,
    watch: SystemWatch,
    channels: Mutex<ChannelTable>,
    clients: Mutex<BTreeMap<u64, Arc<ConnectedClient>>>,
    last_client: AtomicU64,
    pub(super) asking: Semaphore,
    pub(super) operator: Mutex<Operator>,
    /// The parameters as clients were last informed of them.
    known_parameters: Mutex<BTreeMap<String, Value>>,
}

/// A client from its handshake to its end.
pub(super) struct ConnectedClient {
    pub(super) id: u64,
    pub(super) address: String,
    pub(super) outbox: Arc<ViewerOutbox>,
    pub(super) interests: Mutex<ClientInterests>,
}

/// What a client has subscribed to.
#[derive(Default)]
pub(super) struct ClientInterests {
    /// Channels by the numbers of the subscriptions.
    pub(super) subscriptions: BTreeMap<u32, Arc<ViewerChannel>>,
    /// The parameters of which it wants the changes.
    pub(super) parameters: BTreeSet<String>,
    pub(super) wants_all_parameters: bool,
    /// The connections of which the client was informed last, if it wants them.
    pub(super) graph: Option<ConnectionGraph>,
}

impl Bridge {
    /// Begins to observe the system whose registry listens at `registry`.
    ///
    /// # Errors
    /// If no thread can be started.
    pub(super) fn begin(
        registry: &str,
        component: String,
        author: &str,
        selection: OutputSelection,
        commander: Arc<Commander>,
    ) -> io::Result<Arc<Self>> {
        let watch = SystemWatch::begin(registry, "foxglove", Arc::new(|| {}))?;
        let from = format!("{component}, process {}", std::process::id());
        let operator = Operator::new(watch.directory().clone(), &from, author);
        Ok(Arc::new(Self {
            commander,
            component,
            watch,
            channels: Mutex::new(ChannelTable::new(selection)),
            clients: Mutex::default(),
            last_client: AtomicU64::new(0),
            asking: Semaphore::new(MAX_ASKING),
            operator: Mutex::new(operator),
            known_parameters: Mutex::default(),
        }))
    }

    /// Returns the registry.
    pub(super) fn directory(&self) -> &Directory {
        self.watch.directory()
    }

    /// Admits a client, and informs it of all channels.
    pub(super) fn admit(
        &self,
        address: String,
        server_info: String,
        services: String,
    ) -> Arc<ConnectedClient> {
        let id = self.last_client.fetch_add(1, Ordering::Relaxed) + 1;
        let (outbox, interests) = (Arc::new(ViewerOutbox::default()), Mutex::default());
        let client = Arc::new(ConnectedClient { id, address, outbox, interests });
        client.inform(server_info);
        // Under the lock of the channels, so that no announcement is missed or comes twice.
        let channels = self.channels.lock();
        client.inform(compose_advertise(channels.channels().map(|channel| channel.announce())));
        self.clients.lock().insert(id, Arc::clone(&client));
        drop(channels);
        client.inform(services);
        client
    }

    /// Forgets a client: what it has ordered ends.
    pub(super) fn dismiss(&self, client: &ConnectedClient) {
        self.commander.leave(client.id);
        self.clients.lock().remove(&client.id);
        let subscriptions = std::mem::take(&mut client.interests.lock().subscriptions);
        for channel in subscriptions.values() {
            channel.remove_readers(|reader| reader.client == client.id);
        }
    }

    /// Subscribes a client to a channel.
    ///
    /// # Errors
    /// In words, if there is no such channel.
    pub(super) fn subscribe(
        &self,
        client: &ConnectedClient,
        subscription: u32,
        channel_id: u32,
    ) -> Result<(), String> {
        let channels = self.channels.lock();
        let channel =
            channels.find(channel_id).ok_or_else(|| format!("there is no channel {channel_id}"))?;
        let mut interests = client.interests.lock();
        if interests.subscriptions.contains_key(&subscription) {
            return Err(format!("the subscription {subscription} exists already"));
        }
        interests.subscriptions.insert(subscription, Arc::clone(channel));
        let outbox = Arc::clone(&client.outbox);
        let reader = ChannelReader { client: client.id, subscription, outbox };
        let (directory, commander) = (self.directory().clone(), Arc::clone(&self.commander));
        channel.add_reader(&ChannelSource { directory, commander }, reader);
        Ok(())
    }

    /// Ends a subscription.
    pub(super) fn unsubscribe(&self, client: &ConnectedClient, subscription: u32) {
        let channel = client.interests.lock().subscriptions.remove(&subscription);
        if let Some(channel) = channel {
            let is_it = |reader: &ChannelReader| {
                reader.client == client.id && reader.subscription == subscription
            };
            channel.remove_readers(is_it);
            client.outbox.forget_subscription(subscription);
        }
    }

    /// Takes the present outputs from the registry, and informs all clients of what changed. Blocks
    /// until the registry answers.
    pub(super) fn follow_outputs(&self) {
        // A registry that is being restarted has no outputs yet, and what is shown stays.
        let Ok(listing) = self.directory().fetch_listing(LISTED_WITHIN) else { return };
        let mut channels = self.channels.lock();
        let changes = channels.update(listing.data, Instant::now());
        let clients: Vec<_> = self.clients.lock().values().cloned().collect();
        if !changes.removed.is_empty() {
            let ids: Vec<_> = changes.removed.iter().map(|channel| channel.id).collect();
            changes.removed.iter().for_each(|channel| channel.remove_readers(|_| true));
            for client in &clients {
                client.forget_channels(&ids);
                client.inform(compose_unadvertise(&ids));
            }
        }
        if !changes.added.is_empty() {
            let text = compose_advertise(changes.added.iter().map(|channel| channel.announce()));
            clients.iter().for_each(|client| client.inform(text.clone()));
        }
    }

    /// Informs the clients that want it of the connections that have changed.
    pub(super) fn update_graphs(&self) {
        let wants = |client: &Arc<ConnectedClient>| client.interests.lock().graph.is_some();
        let clients: Vec<_> =
            self.clients.lock().values().filter(|it| wants(it)).cloned().collect();
        if clients.is_empty() {
            return;
        }
        let now = self.make_graph();
        for client in clients {
            let mut interests = client.interests.lock();
            let Some(before) = &mut interests.graph else { continue };
            let update = now.compose_update(before);
            before.clone_from(&now);
            drop(interests);
            update.into_iter().for_each(|update| client.inform(update));
        }
    }

    fn make_graph(&self) -> ConnectionGraph {
        let mut graph = ConnectionGraph::default();
        for channel in self.channels.lock().channels() {
            let data = channel.entry.data.as_str();
            let component = split_data(data).map_or(data, |(component, _)| component);
            graph.add_publisher(data, component);
        }
        for link in self.watch.picture().links.iter().filter(|link| link.connected) {
            let name = split_data(&link.to).map_or(link.to.as_str(), |(component, _)| component);
            graph.add_subscriber(&link.from, name);
        }
        MissionService::names().for_each(|name| graph.add_service(name, &self.component));
        graph
    }

    /// Lists the parameters with these names, or all. Blocks until configd answers.
    ///
    /// # Errors
    /// In words, if it does not.
    pub(super) fn read_parameters(&self, names: &[String]) -> Result<Vec<Value>, String> {
        let listed = list_parameters(self.directory())?;
        let is_wanted = |parameter: &&ListedParameter| {
            names.is_empty() || names.contains(&name_parameter(parameter))
        };
        Ok(listed.iter().filter(is_wanted).map(describe_parameter).collect())
    }

    /// Informs the clients that want it of the parameters that have changed. Blocks until configd
    /// answers.
    pub(super) fn update_parameters(&self) {
        let wants = |client: &Arc<ConnectedClient>| client.interests.lock().wants_parameters();
        let clients: Vec<_> =
            self.clients.lock().values().filter(|it| wants(it)).cloned().collect();
        let mut known = self.known_parameters.lock();
        if clients.is_empty() {
            known.clear();
            return;
        }
        let Ok(listed) = list_parameters(self.directory()) else { return };
        let now: BTreeMap<_, _> =
            listed.iter().map(|it| (name_parameter(it), describe_parameter(it))).collect();
        let before = std::mem::replace(&mut *known, now);
        if before.is_empty() {
            return;
        }
        let changed: Vec<_> =
            known.iter().filter(|(name, value)| before.get(*name) != Some(value)).collect();
        for client in clients {
            let interests = client.interests.lock();
            let of_client = changed.iter().filter(|(name, _)| interests.wants_parameter(name));
            let values: Vec<_> = of_client.map(|(_, value)| (*value).clone()).collect();
            drop(interests);
            if !values.is_empty() {
                client.inform(json!({"op": "parameterValues", "parameters": values}).to_string());
            }
        }
    }

    /// Describes all clients.
    pub(super) fn describe_clients(&self) -> ViewerClients {
        let clients: Vec<_> = self.clients.lock().values().cloned().collect();
        let describe = |client: &Arc<ConnectedClient>| {
            let counts = client.outbox.counts();
            let interests = client.interests.lock();
            // What is lost before this process counts for every client of the topic.
            let lost: u64 = interests.subscriptions.values().map(|channel| channel.lost()).sum();
            ViewerClient {
                address: client.address.clone(),
                subscriptions: u32::try_from(interests.subscriptions.len()).unwrap_or(u32::MAX),
                sent: counts.sent,
                dropped: counts.dropped + lost,
                waiting_bytes: counts.waiting_bytes as u64,
                driving: self.commander.is_driver(client.id),
            }
        };
        ViewerClients {
            stamp: self.commander.timestamp(),
            clients: clients.iter().map(describe).collect(),
        }
    }
}

impl ConnectedClient {
    /// Sends a text.
    pub(super) fn inform(&self, text: String) {
        self.outbox.push_answer(OutgoingMessage::Text(text));
    }

    fn forget_channels(&self, ids: &[u32]) {
        let mut interests = self.interests.lock();
        let gone = interests.subscriptions.extract_if(.., |_, channel| ids.contains(&channel.id));
        gone.for_each(|(subscription, _)| self.outbox.forget_subscription(subscription));
    }
}

impl ClientInterests {
    fn wants_parameters(&self) -> bool {
        self.wants_all_parameters || !self.parameters.is_empty()
    }

    fn wants_parameter(&self, name: &str) -> bool {
        self.wants_all_parameters || self.parameters.contains(name)
    }
}
