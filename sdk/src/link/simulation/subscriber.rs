//! A component with one input, on the simulated network: it looks up its publisher, links to it, counts
//! what arrives and what is missing, and comes back when the link is lost.

use std::collections::BTreeMap;
use std::time::Duration;

use armor_wire::backoff::Backoff;
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{Hello, LinkRequest, Purpose, read_answer};
use armor_wire::keep::{Keep, Wake};
use armor_wire::liveness::Liveness;
use armor_wire::registry::{ComponentEntry, RegistryReply, RegistryRequest};
use armor_wire::schema;
use armor_wire::shared_memory::MemoryUse;

use super::super::arrivals::ArrivedSequence;
use super::Comparison;
use super::network::{ConnectionId, Delivery, End, Network, Timer};
use super::publisher::{SCHEMA, feed, name_data, write_payload};
use super::registry::RegistryClient;

/// As in a run: `sdk/src/link/input_reader.rs`.
const RETRY: (Duration, Duration) = (Duration::from_millis(10), Duration::from_millis(400));
const GOOD_LINK: Duration = Duration::from_secs(2);
/// The names of the publishers, by index.
const PUBLISHERS: [&str; 2] = ["laser", "camera"];

/// See the module.
pub struct Subscriber {
    index: usize,
    /// Index of its publisher.
    pub publisher: usize,
    keep: Keep,
    pub registry: RegistryClient,
    state: LinkState,
    /// Number of the present attempt to link: also that of its lookup.
    attempt: u64,
    since: Duration,
    backoff: Backoff,
    arrived: ArrivedSequence,
    /// What has come of each process start.
    tallies: BTreeMap<u64, Tally>,
    /// Links that were welcomed, and handshakes that were refused.
    pub links: u64,
    pub refused: u64,
}

/// Where it stands with its link.
enum LinkState {
    Resting,
    LookingUp,
    Dialling { connection: ConnectionId, reader: FrameReader, found: Box<ComponentEntry> },
    Linked { connection: ConnectionId, reader: FrameReader, liveness: Liveness, instance: u64 },
}

/// The data of one process start.
#[derive(Clone, Copy, Debug)]
struct Tally {
    first: u64,
    last: u64,
    received: u64,
    lost: u64,
}

impl Subscriber {
    pub fn new(index: usize, publisher: usize, keep: Keep, seed: u64) -> Self {
        let name = format!("sink{index}");
        let instance = 1000 + index as u64;
        Self {
            index,
            publisher,
            keep,
            registry: RegistryClient::new(&name, instance, None, Duration::ZERO),
            state: LinkState::Resting,
            attempt: 0,
            since: Duration::ZERO,
            backoff: Backoff::new(RETRY.0, RETRY.1, seed ^ instance),
            arrived: ArrivedSequence::default(),
            tallies: BTreeMap::new(),
            links: 0,
            refused: 0,
        }
    }

    pub fn count_received(&self) -> u64 {
        self.tallies.values().map(|tally| tally.received).sum()
    }

    pub fn count_lost(&self) -> u64 {
        self.tallies.values().map(|tally| tally.lost).sum()
    }

    pub fn is_linked_by(&self, by: ConnectionId) -> bool {
        match &self.state {
            LinkState::Dialling { connection, .. } | LinkState::Linked { connection, .. } => {
                *connection == by
            }
            LinkState::Resting | LinkState::LookingUp => false,
        }
    }

    /// Asks for its publisher.
    pub fn look_up(&mut self, network: &mut Network) {
        self.attempt += 1;
        self.since = network.now();
        self.state = LinkState::LookingUp;
        self.send_lookup(network);
    }

    fn send_lookup(&mut self, network: &mut Network) {
        let data = name_data(PUBLISHERS[self.publisher]);
        let (request, schema) = (self.attempt, SCHEMA.to_owned());
        self.registry.send(RegistryRequest::Lookup { request, data, schema, wait: true }, network);
    }

    pub fn retry(&mut self, attempt: u64, network: &mut Network) {
        if attempt == self.attempt {
            self.look_up(network);
        }
    }

    pub fn hear_registry(
        &mut self,
        delivery: Delivery,
        network: &mut Network,
    ) -> Result<(), String> {
        let (reply, must_declare) = self.registry.hear(delivery, network);
        let is_looking = matches!(self.state, LinkState::LookingUp);
        if must_declare && is_looking {
            self.send_lookup(network);
        }
        match reply {
            Some(RegistryReply::Found { request, entry, provider, .. })
                if is_looking && request == self.attempt =>
            {
                if entry.data != name_data(&provider.name) {
                    return Err(format!("{} of {provider:?}", entry.data));
                }
                self.dial(provider, network);
            }
            Some(RegistryReply::Refused { request, refusal })
                if is_looking && request == self.attempt =>
            {
                return Err(format!("a lookup that waits is refused: {refusal}"));
            }
            _ => {}
        }
        Ok(())
    }

    fn dial(&mut self, found: ComponentEntry, network: &mut Network) {
        let port = found.endpoint.rsplit_once(':').and_then(|(_, port)| port.parse().ok());
        let connection = network.connect(false);
        let dialled = Delivery::Dialled { port: port.expect("the registry checks endpoints") };
        network.send(connection, End::Server, dialled);
        let link = LinkRequest {
            data: name_data(PUBLISHERS[self.publisher]),
            instance: found.instance,
            schema: SCHEMA.into(),
            schema_hash: schema::hash_text(SCHEMA),
            keep: self.keep,
            wake: Wake::Sleep,
            paused: false,
            history: 1,
            memory: MemoryUse::Never,
            datagrams: false,
        };
        let hello = Hello::new(&format!("sink{}", self.index), 1, Purpose::Link { link });
        let hello = frame::to_bytes(FrameKind::Hello, &hello).expect("it is short");
        network.send(connection, End::Server, Delivery::Bytes(hello));
        let (reader, found) = (FrameReader::new(), Box::new(found));
        self.state = LinkState::Dialling { connection, reader, found };
        self.since = network.now();
    }

    pub fn hear_publisher(
        &mut self,
        delivery: Delivery,
        comparison: Comparison,
        network: &mut Network,
    ) -> Result<(), String> {
        let Delivery::Bytes(bytes) = delivery else {
            self.lose_link(network);
            return Ok(());
        };
        let mut frames = Vec::new();
        let reader = match &mut self.state {
            LinkState::Dialling { reader, .. } => reader,
            LinkState::Linked { reader, liveness, .. } => {
                liveness.heard(network.now());
                reader
            }
            LinkState::Resting | LinkState::LookingUp => return Ok(()),
        };
        feed(reader, &bytes, |frame| frames.push((frame.kind, frame.flags, frame.body.to_vec())));
        for (kind, flags, body) in frames {
            let frame = frame::Frame { kind, flags, body: &body };
            match &self.state {
                LinkState::Dialling { .. } => self.take_answer(&frame, comparison, network),
                LinkState::Linked { .. } => self.take_data(&frame)?,
                LinkState::Resting | LinkState::LookingUp => {}
            }
        }
        Ok(())
    }

    /// As `sdk/src/dial.rs` does.
    fn take_answer(
        &mut self,
        frame: &frame::Frame<'_>,
        comparison: Comparison,
        network: &mut Network,
    ) {
        let LinkState::Dialling { connection, reader, found } =
            std::mem::replace(&mut self.state, LinkState::Resting)
        else {
            return;
        };
        let welcome = read_answer(frame).ok();
        let is_meant = |instance| comparison == Comparison::Nothing || instance == found.instance;
        match welcome.filter(|welcome| is_meant(welcome.instance)) {
            Some(_) => {
                self.links += 1;
                self.arrived.begin_link();
                let (liveness, instance) = (Liveness::new(network.now()), found.instance);
                self.state = LinkState::Linked { connection, reader, liveness, instance };
            }
            None => {
                self.refused += 1;
                network.close(connection, End::Client);
                self.rest(network);
            }
        }
    }

    fn take_data(&mut self, frame: &frame::Frame<'_>) -> Result<(), String> {
        let LinkState::Linked { instance, .. } = &self.state else { return Ok(()) };
        if frame.kind != FrameKind::Data {
            return Ok(());
        }
        let (header, payload) = frame.data().map_err(|error| error.to_string())?;
        let sink = self.index;
        if payload != write_payload(self.publisher, *instance, header.sequence)
            || header.instance != *instance
        {
            return Err(format!(
                "sink {sink} was linked to {} {instance}, and got {header:?} {payload:?}",
                PUBLISHERS[self.publisher]
            ));
        }
        let Some(lost) = self.arrived.follow(&header, false) else { return Ok(()) };
        let sequence = header.sequence;
        match self.tallies.get_mut(instance) {
            Some(tally) if sequence <= tally.last => {
                return Err(format!("sink {sink}: {sequence} again, or too late: {tally:?}"));
            }
            Some(tally) => {
                tally.last = sequence;
                tally.received += 1;
                tally.lost += lost;
            }
            None if lost > 0 => {
                return Err(format!("sink {sink}: {lost} lost before the first of {instance}"));
            }
            None => {
                let tally = Tally { first: sequence, last: sequence, received: 1, lost };
                self.tallies.insert(*instance, tally);
            }
        }
        Ok(())
    }

    /// Beats, and notices silence.
    pub fn look(&mut self, network: &mut Network) {
        self.registry.look(network);
        let now = network.now();
        match &mut self.state {
            LinkState::Linked { connection, liveness, .. } => {
                if liveness.is_silent(now) {
                    network.close(*connection, End::Client);
                    self.lose_link(network);
                } else if liveness.owes_beat(now) {
                    liveness.spoke(now);
                    let beat = frame::signal(FrameKind::Beat).to_vec();
                    network.send(*connection, End::Server, Delivery::Bytes(beat));
                }
            }
            // A handshake has a limit, too.
            LinkState::Dialling { connection, .. } if now - self.since > GOOD_LINK => {
                network.close(*connection, End::Client);
                self.rest(network);
            }
            LinkState::Dialling { .. } | LinkState::Resting | LinkState::LookingUp => {}
        }
    }

    fn lose_link(&mut self, network: &mut Network) {
        if network.now() - self.since > GOOD_LINK {
            self.backoff.reset();
        }
        self.rest(network);
    }

    fn rest(&mut self, network: &mut Network) {
        self.state = LinkState::Resting;
        let timer = Timer::Retry { subscriber: self.index, attempt: self.attempt };
        network.set_timer(self.backoff.delay(), timer);
    }

    /// Checks that each loss was counted, and that data of the publisher's present process arrive: at
    /// least the first `since` of them were published long enough ago.
    pub fn check_end(&self, publisher: Option<u64>, since: u64) -> Result<(), String> {
        let sink = self.index;
        for (instance, tally) in &self.tallies {
            let Tally { first, last, received, lost } = *tally;
            if last - first + 1 != received + lost {
                return Err(format!("sink {sink}: a loss of {instance} is not counted: {tally:?}"));
            }
        }
        let publisher = publisher.ok_or("the publisher does not run at the end")?;
        let last = self.tallies.get(&publisher).map(|tally| tally.last);
        match last {
            Some(last) if last + 1 >= since => Ok(()),
            _ => Err(format!(
                "sink {sink} is not linked to {} {publisher} at the end: {last:?} of {since}",
                PUBLISHERS[self.publisher]
            )),
        }
    }
}
