//! A component with one output, on the simulated network: it registers, serves handshakes and links,
//! and publishes numbers.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::frame::{self, DATA_HEADER_LEN, DataHeader, FrameKind, FrameReader};
use armor_wire::hello::{Hello, LinkRequest, Purpose, Refusal, RefusalCode, Welcome};
use armor_wire::liveness::Liveness;
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryRequest};

use super::super::queue::LinkQueue;
use super::Comparison;
use super::network::{ConnectionId, Delivery, End, Network};
use super::registry::RegistryClient;

/// The period of its output.
pub const PERIOD: Duration = Duration::from_millis(40);
/// Schema of its output.
pub const SCHEMA: &str = "Numbered{index:u64,instance:u64,sequence:u64}";
/// The output of each publisher.
const OUTPUT: &str = "out";

/// See the module.
pub struct Publisher {
    index: usize,
    name: String,
    /// None while its process does not run.
    process: Option<Process>,
    pub registry: RegistryClient,
    /// When each data of the present process were published.
    published: Vec<Duration>,
}

struct Process {
    instance: u64,
    port: u16,
    sequence: u64,
    /// Connections whose hello has not come.
    handshakes: BTreeMap<ConnectionId, FrameReader>,
    links: BTreeMap<ConnectionId, OutgoingEnd>,
}

/// Its end of a link.
struct OutgoingEnd {
    queue: LinkQueue,
    reader: FrameReader,
    liveness: Liveness,
    /// The next frame does not follow the one before.
    fresh: bool,
}

/// The data of a publisher.
pub fn name_data(publisher: &str) -> String {
    format!("{publisher}.{OUTPUT}")
}

/// The payload of data: whose they are is in it, too.
pub fn write_payload(index: usize, instance: u64, sequence: u64) -> Vec<u8> {
    [index as u64, instance, sequence].into_iter().flat_map(u64::to_le_bytes).collect()
}

impl Publisher {
    pub fn new(index: usize, name: &str) -> Self {
        let registry = RegistryClient::new(name, 0, None, Duration::MAX);
        let (process, published) = (None, Vec::new());
        Self { index, name: name.into(), process, registry, published }
    }

    pub fn start(&mut self, instance: u64, port: u16, network: &mut Network) {
        let entry = ComponentEntry {
            name: self.name.clone(),
            kind: "sim".into(),
            instance,
            pid: 1,
            host: "robot".into(),
            endpoint: format!("127.0.0.1:{port}"),
        };
        self.registry = RegistryClient::new(&self.name, instance, Some(entry), network.now());
        self.registry.look(network);
        self.published.clear();
        let (handshakes, links) = (BTreeMap::new(), BTreeMap::new());
        self.process = Some(Process { instance, port, sequence: 0, handshakes, links });
    }

    /// Its process dies. Returns whether it ran.
    pub fn stop(&mut self, network: &mut Network) -> bool {
        let Some(process) = self.process.take() else { return false };
        let own = process.handshakes.keys().chain(process.links.keys());
        own.for_each(|connection| network.close(*connection, End::Server));
        if let Some(connection) = self.registry.connection() {
            network.close(connection, End::Client);
        }
        self.registry = RegistryClient::new(&self.name, 0, None, Duration::MAX);
        true
    }

    pub fn port(&self) -> Option<u16> {
        self.process.as_ref().map(|process| process.port)
    }

    pub fn instance(&self) -> Option<u64> {
        self.process.as_ref().map(|process| process.instance)
    }

    /// How many data its process had published at a time.
    pub fn count_before(&self, time: Duration) -> u64 {
        self.published.iter().filter(|at| **at < time).count() as u64
    }

    pub fn listens_on(&self, port: u16) -> bool {
        self.port() == Some(port)
    }

    pub fn serves(&self, connection: ConnectionId) -> bool {
        self.process.as_ref().is_some_and(|process| {
            process.handshakes.contains_key(&connection) || process.links.contains_key(&connection)
        })
    }

    pub fn accept(&mut self, connection: ConnectionId) {
        if let Some(process) = &mut self.process {
            process.handshakes.insert(connection, FrameReader::new());
        }
    }

    pub fn hear_registry(&mut self, delivery: Delivery, network: &mut Network) {
        let (_, must_declare) = self.registry.hear(delivery, network);
        if must_declare {
            let entry = DataEntry {
                data: name_data(&self.name),
                type_name: "Numbered".into(),
                schema: SCHEMA.into(),
                latched: false,
            };
            self.registry.send(RegistryRequest::Provide { request: 1, entry }, network);
        }
    }

    pub fn handle(
        &mut self,
        connection: ConnectionId,
        delivery: Delivery,
        comparison: Comparison,
        network: &mut Network,
    ) {
        let Some(process) = &mut self.process else { return };
        let Delivery::Bytes(bytes) = delivery else {
            process.handshakes.remove(&connection);
            process.links.remove(&connection);
            return;
        };
        if let Some(link) = process.links.get_mut(&connection) {
            link.liveness.heard(network.now());
            // Beats, which have no body.
            feed(&mut link.reader, &bytes, |_| {});
            return;
        }
        let mut hello = None;
        if let Some(reader) = process.handshakes.get_mut(&connection) {
            feed(reader, &bytes, |frame| hello = Hello::read(frame).ok());
        }
        let Some(Hello { purpose: Purpose::Link { link }, .. }) = hello else { return };
        process.handshakes.remove(&connection);
        match process.admit(&link, &self.name, comparison) {
            Ok(welcome) => {
                let bytes = frame::to_bytes(FrameKind::Welcome, &welcome).expect("it is short");
                network.send(connection, End::Client, Delivery::Bytes(bytes));
                let end = OutgoingEnd {
                    queue: LinkQueue::new(link.keep),
                    reader: FrameReader::new(),
                    liveness: Liveness::new(network.now()),
                    fresh: true,
                };
                process.links.insert(connection, end);
            }
            Err(refusal) => {
                let bytes = frame::to_bytes(FrameKind::Refusal, &refusal).expect("it is short");
                network.send(connection, End::Client, Delivery::Bytes(bytes));
                network.close(connection, End::Server);
            }
        }
    }

    pub fn publish(&mut self, network: &mut Network) {
        let Some(process) = &mut self.process else { return };
        let (instance, sequence) = (process.instance, process.sequence);
        process.sequence += 1;
        self.published.push(network.now());
        let payload = write_payload(self.index, instance, sequence);
        for (connection, link) in &mut process.links {
            let fresh = std::mem::take(&mut link.fresh);
            let header = DataHeader { sequence, stamp_s: 0.0, instance, fresh };
            let mut frame = Vec::with_capacity(DATA_HEADER_LEN + payload.len());
            frame.extend_from_slice(&header.to_bytes(payload.len()));
            frame.extend_from_slice(&payload);
            link.offer(*connection, frame, network);
        }
    }

    /// The socket of a link has room again.
    pub fn drain_link(&mut self, connection: ConnectionId, network: &mut Network) {
        let process = self.process.as_mut();
        if let Some(link) = process.and_then(|process| process.links.get_mut(&connection)) {
            link.drain(connection, network);
        }
    }

    /// Beats, and ends links that are silent.
    pub fn look(&mut self, network: &mut Network) {
        self.registry.look(network);
        let Some(process) = &mut self.process else { return };
        let now = network.now();
        process.links.retain(|connection, link| {
            if link.liveness.is_silent(now) {
                network.close(*connection, End::Server);
                return false;
            }
            if link.liveness.owes_beat(now) && link.queue.is_empty() {
                link.liveness.spoke(now);
                let beat = frame::signal(FrameKind::Beat).to_vec();
                network.send(*connection, End::Client, Delivery::Bytes(beat));
            }
            true
        });
    }
}

impl Process {
    /// As the handshakes of `sdk/src/service/handshake.rs`.
    fn admit(
        &self,
        link: &LinkRequest,
        name: &str,
        comparison: Comparison,
    ) -> Result<Welcome, Refusal> {
        let welcome = Welcome { name: name.into(), instance: self.instance, schema: SCHEMA.into() };
        if comparison == Comparison::Nothing {
            return Ok(welcome);
        }
        if link.instance != self.instance {
            return Err(Refusal::new(RefusalCode::WrongInstance, "another process start"));
        }
        if link.data != name_data(name) {
            return Err(Refusal::new(RefusalCode::UnknownData, "no such data"));
        }
        Ok(welcome)
    }
}

impl OutgoingEnd {
    /// As `OutgoingLink::offer_frame`, outside a call of user code.
    fn offer(&mut self, connection: ConnectionId, frame: Vec<u8>, network: &mut Network) {
        self.liveness.spoke(network.now());
        if !self.queue.is_empty() {
            self.queue.push(&frame);
            self.drain(connection, network);
            return;
        }
        let written = write(connection, &frame, network);
        if written < frame.len() {
            self.queue.set_congested();
            self.queue.push_shared(Arc::new(frame), written);
        }
    }

    fn drain(&mut self, connection: ConnectionId, network: &mut Network) {
        let drained = self.queue.drain(|bytes| match write(connection, bytes, network) {
            0 => Err(io::ErrorKind::WouldBlock.into()),
            len => Ok(len),
        });
        drained.expect("the socket only blocks");
    }
}

/// Writes as much as the socket takes.
fn write(connection: ConnectionId, bytes: &[u8], network: &mut Network) -> usize {
    let len = network.room(connection).min(bytes.len());
    if len > 0 {
        network.send(connection, End::Client, Delivery::Bytes(bytes[..len].to_vec()));
    }
    len
}

/// Gives bytes to a reader, and each whole frame to `take`.
pub fn feed(reader: &mut FrameReader, mut bytes: &[u8], mut take: impl FnMut(&frame::Frame<'_>)) {
    loop {
        while let Some(frame) = reader.next_frame().expect("the ends write frames") {
            take(&frame);
        }
        if bytes.is_empty() {
            return;
        }
        let space = reader.space();
        let len = space.len().min(bytes.len());
        space[..len].copy_from_slice(&bytes[..len]);
        reader.filled(len);
        bytes = &bytes[len..];
    }
}
