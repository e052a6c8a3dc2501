//! The other end of a gate: connects to it, proves a key, that of a person or of a host, and sends
//! requests.

mod session;
mod tools;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_wire::clock::ClockSample;
use armor_wire::gate::{GateReply, GateRequest, HostExamination};
use armor_wire::hello::Refusal;
use armor_wire::remote_process::HostAddress;
use parking_lot::Mutex;
use rustls::ClientConfig;
use rustls::pki_types::ServerName;
use thiserror::Error;
use tokio::net::TcpStream;
use tokio::time;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;

use crate::GATE_NAME;
use crate::addresses::{GateAddresses, GatePlace, join_failures};
use crate::certificate::CertificateFacts;
use crate::frames::{read_control, write_control};
use crate::host_keys::HostKeys;
use crate::identity::KeyPurpose;
use crate::key_file::KeyFile;
use crate::redial::connect_repeatedly;
use crate::streams::tune_stream;
use crate::tls::{client_config, explain_tls_error};
pub use session::{GateNotice, GateSession};
pub use tools::ToolNotice;

/// How long connecting to the gate may take, and then its answer.
pub(crate) const LIMIT: Duration = Duration::from_secs(5);
/// Longest time that a host takes to examine itself: it may describe many kinds of components.
const EXAMINES_WITHIN: Duration = Duration::from_secs(30);
/// Period with which a host looks whether the key at the other end is revoked.
const LOOK_AT_KEYS: Duration = Duration::from_millis(250);
/// Why the gate cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GateError {
    /// The key on this computer cannot be used.
    #[error("{0}")]
    Key(String),
    /// The gate cannot be reached.
    #[error("the gate {gate} cannot be reached: {reason}")]
    Unreachable {
        /// Its address.
        gate: String,
        /// Why.
        reason: String,
    },
    /// One end does not accept the key of the other.
    #[error("{gate}: {reason}")]
    NotAccepted {
        /// The gate's address.
        gate: String,
        /// Why.
        reason: String,
    },
    /// It has several addresses, and none of them can be used.
    #[error("no address of the gate can be used: {tried}")]
    NoneReached {
        /// Each address, and why.
        tried: String,
    },
    /// The executable that the agent wants could not be sent.
    #[error("{path} was not sent whole: {reason}", path = path.display())]
    Unsent {
        /// The executable.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The gate refuses the request.
    #[error("the gate refuses it: {0}")]
    Refused(Refusal),
}

/// The gate of one system, and the key for it.
pub struct GateClient {
    addresses: GateAddresses,
    key: KeySource,
}

/// The key with which a client connects.
enum KeySource {
    /// That of a person, in a file.
    Person { path: PathBuf, key: Mutex<LoadedKey> },
    /// That of this host; the gate must be that of the host of this name.
    Host { keys: HostKeys, expected: String },
}

#[derive(Clone)]
struct LoadedKey {
    facts: CertificateFacts,
    config: Arc<ClientConfig>,
}

impl GateClient {
    /// A client of the gate at `gate`, `host:port`, with the key in a file.
    ///
    /// # Errors
    /// If the key cannot be used.
    pub fn new(gate: &str, key: &Path) -> Result<Self, GateError> {
        let path = key.to_owned();
        let key = Mutex::new(load_key(&path)?);
        let addresses = GateAddresses::new(vec![gate.to_owned()]);
        Ok(Self { addresses, key: KeySource::Person { path, key } })
    }

    /// A client of the gate of another host of the system, with the key of this host.
    pub fn of_host(gate: &HostAddress, keys: HostKeys) -> Self {
        let key = KeySource::Host { keys, expected: gate.host.clone() };
        Self { addresses: GateAddresses::of_host(gate), key }
    }

    /// The addresses at which the gate may listen.
    pub fn addresses(&self) -> &[String] {
        self.addresses.names()
    }

    /// Where the gate is, for people.
    pub fn name_gate(&self) -> String {
        match self.addresses.last_reached() {
            Some(place) => place.label,
            None => self.addresses().join(" or "),
        }
    }

    /// What the certificate of the key contains.
    pub fn facts(&self) -> CertificateFacts {
        match &self.key {
            KeySource::Person { key, .. } => key.lock().facts.clone(),
            KeySource::Host { keys, .. } => keys.lock().host.facts.clone(),
        }
    }

    /// Waits until the key of the gate at the other end of `stream` is revoked, and returns that. For a
    /// person it never does: they know no list.
    pub(crate) fn wait_for_revocation(
        &self,
        stream: &TlsStream<TcpStream>,
    ) -> impl Future<Output = String> + Send + 'static {
        let facts = peer_facts(stream).ok();
        let keys = match &self.key {
            KeySource::Host { keys, .. } => Some(keys.clone()),
            KeySource::Person { .. } => None,
        };
        async move {
            let (Some(keys), Some(facts)) = (keys, facts) else {
                return std::future::pending().await;
            };
            loop {
                time::sleep(LOOK_AT_KEYS).await;
                keys.lock().look();
                if keys.lock().revoked.contains(&facts.serial) {
                    return format!("the key of {} is revoked", facts.holder.name);
                }
            }
        }
    }

    fn config(&self) -> Arc<ClientConfig> {
        match &self.key {
            KeySource::Person { key, .. } => Arc::clone(&key.lock().config),
            KeySource::Host { keys, .. } => {
                let mut keys = keys.lock();
                // The gate of this host reports what is wrong with the folder.
                keys.look();
                Arc::clone(&keys.client)
            }
        }
    }

    /// Connects to the gate at one of its addresses, sends a request, and reads the reply.
    ///
    /// # Errors
    /// If the gate cannot be reached, or one end does not accept the key of the other.
    pub async fn request(
        &self,
        request: GateRequest,
    ) -> Result<(TlsStream<TcpStream>, GateReply), GateError> {
        let (place, mut stream) = self.reach().await?;
        let reply = exchange(&place, &mut stream, &request).await?;
        Ok((stream, reply))
    }

    /// Compares the clock of the gate's host with that of this one.
    ///
    /// # Errors
    /// As [`request`](Self::request), and if it refuses to.
    pub async fn compare_clocks(&self) -> Result<ClockSample, GateError> {
        let (place, mut stream) = self.reach().await?;
        let asked_us = now_us();
        let reply = exchange(&place, &mut stream, &GateRequest::Clock).await?;
        match reply {
            GateReply::Clock { time_us } => Ok(ClockSample::of(asked_us, time_us, now_us())),
            GateReply::Refused { refusal } => Err(GateError::Refused(refusal)),
            _ => Err(self.unreachable("it answers another request")),
        }
    }

    /// Has the gate's host examine itself, as `armor doctor` does.
    ///
    /// # Errors
    /// As [`request`](Self::request), and if it refuses to.
    pub async fn examine_host(&self) -> Result<HostExamination, GateError> {
        let (place, mut stream) = self.reach().await?;
        let reply = exchange_within(EXAMINES_WITHIN, &place, &mut stream, &GateRequest::Examine);
        match reply.await? {
            GateReply::Examined { examination } => Ok(examination),
            GateReply::Refused { refusal } => Err(GateError::Refused(refusal)),
            _ => Err(self.unreachable("it answers another request")),
        }
    }

    /// Connects to the gate at the first of its addresses that answers with the right key; returns
    /// which one that is.
    async fn reach(&self) -> Result<(String, TlsStream<TcpStream>), GateError> {
        let mut earlier = None;
        if let Some(place) = self.addresses.last_reached() {
            match self.reach_at(&place).await {
                Ok(stream) => return Ok((place.label, stream)),
                Err(error) => earlier = Some((place.address, error)),
            }
        }
        let mut failures = Vec::new();
        for name in self.addresses.names() {
            let places = match self.addresses.resolve(name).await {
                Ok(places) => places,
                Err(error) => {
                    failures.push(error);
                    continue;
                }
            };
            for place in places {
                if let Some((_, error)) = earlier.take_if(|(tried, _)| *tried == place.address) {
                    failures.push(error);
                    continue;
                }
                match self.reach_at(&place).await {
                    Ok(stream) => {
                        self.addresses.set_reached(place.clone());
                        return Ok((place.label, stream));
                    }
                    Err(error) => failures.push(error),
                }
            }
        }
        // It is none of the addresses any more.
        failures.extend(earlier.map(|(_, error)| error));
        Err(join_failures(failures))
    }

    async fn reach_at(&self, place: &GatePlace) -> Result<TlsStream<TcpStream>, GateError> {
        let connect = async {
            let stream = tune_stream(connect_repeatedly(place.address).await?)?;
            let name = ServerName::try_from(GATE_NAME).map_err(io::Error::other)?;
            let stream = TlsConnector::from(self.config()).connect(name, stream).await?;
            self.check_gate(&stream).map_err(io::Error::other)?;
            Ok(stream)
        };
        match time::timeout(place.limit, connect).await {
            Ok(result) => result.map_err(|error: io::Error| explain_error(&place.label, &error)),
            Err(_) => Err(silent(&place.label, place.limit)),
        }
    }

    /// Checks whether the gate is that of the host to which a host connects; every host of the
    /// authority could otherwise take its place.
    fn check_gate(&self, stream: &TlsStream<TcpStream>) -> Result<(), WrongGate> {
        let KeySource::Host { keys, expected } = &self.key else { return Ok(()) };
        let facts = peer_facts(stream).map_err(WrongGate)?;
        if keys.lock().revoked.contains(&facts.serial) {
            return Err(WrongGate(format!("the key of {} is revoked", facts.holder.name)));
        }
        if facts.holder.name != *expected {
            let name = facts.holder.name;
            return Err(WrongGate(format!("it is the gate of {name}, not of {expected}")));
        }
        Ok(())
    }

    /// A client of a gate that no test reaches.
    #[cfg(test)]
    pub(crate) fn dead(gate: &HostAddress) -> Self {
        let authority = crate::Authority::create(0).expect("an authority");
        let holder = crate::KeyHolder { name: "nobody".into(), purpose: KeyPurpose::Host };
        let text =
            authority.issue_key(holder, crate::Validity::days_from(0, 1)).expect("a key").text;
        let key = KeyFile::from_text(&text).expect("it was just made");
        let config = Arc::new(client_config(&key).expect("its own key"));
        let key = Mutex::new(LoadedKey { facts: key.facts, config });
        let path = PathBuf::new();
        let addresses = GateAddresses::of_host(gate);
        Self { addresses, key: KeySource::Person { path, key } }
    }

    fn unreachable(&self, reason: &str) -> GateError {
        GateError::Unreachable { gate: self.name_gate(), reason: reason.to_owned() }
    }
}

fn silent(gate: &str, limit: Duration) -> GateError {
    let reason = format!("it has not answered within {limit:?}");
    GateError::Unreachable { gate: gate.to_owned(), reason }
}

fn explain_error(gate: &str, error: &io::Error) -> GateError {
    let gate = gate.to_owned();
    let inner = error.get_ref();
    if let Some(WrongGate(reason)) = inner.and_then(|it| it.downcast_ref()) {
        return GateError::NotAccepted { gate, reason: reason.clone() };
    }
    if let Some(error) = inner.and_then(|it| it.downcast_ref::<rustls::Error>()) {
        return GateError::NotAccepted { gate, reason: explain_tls_error(error) };
    }
    let reason = match error.kind() {
        io::ErrorKind::UnexpectedEof => "it has closed the connection".to_owned(),
        _ => error.to_string(),
    };
    GateError::Unreachable { gate, reason }
}

/// What the certificate of the gate contains.
fn peer_facts(stream: &TlsStream<TcpStream>) -> Result<CertificateFacts, String> {
    let certificates = stream.get_ref().1.peer_certificates().unwrap_or_default();
    CertificateFacts::read(certificates.first().ok_or("it has no key")?)
}

/// Why a gate with a valid key is not the one that is wanted.
#[derive(Debug, Error)]
#[error("{0}")]
struct WrongGate(String);

fn load_key(path: &Path) -> Result<LoadedKey, GateError> {
    let key = KeyFile::load(path).map_err(|error| GateError::Key(error.to_string()))?;
    let wrong = |reason: &str| GateError::Key(format!("{}: {reason}", path.display()));
    if key.facts.holder.purpose == KeyPurpose::Host {
        return Err(wrong(
            "it is the key of a host, for its gate; connecting needs that of a person",
        ));
    }
    let config = client_config(&key).map_err(|reason| wrong(&reason))?;
    Ok(LoadedKey { facts: key.facts, config: Arc::new(config) })
}

/// The time of this host, in microseconds since 1970.
pub fn now_us() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_micros()).unwrap_or(u64::MAX)
}

/// Sends a request on a new connection, and reads the reply. `place` is for the error.
async fn exchange(
    place: &str,
    stream: &mut TlsStream<TcpStream>,
    request: &GateRequest,
) -> Result<GateReply, GateError> {
    exchange_within(LIMIT, place, stream, request).await
}

async fn exchange_within(
    limit: Duration,
    place: &str,
    stream: &mut TlsStream<TcpStream>,
    request: &GateRequest,
) -> Result<GateReply, GateError> {
    let exchange = async {
        // The gate judges the key only now; why it refuses it is in what it sends.
        let written = write_control(stream, request).await;
        read_control(stream).await.map_err(|error| {
            let is_closed = error.kind() == io::ErrorKind::UnexpectedEof;
            written.err().filter(|_| is_closed).unwrap_or(error)
        })
    };
    match time::timeout(limit, exchange).await {
        Ok(result) => result.map_err(|error| explain_error(place, &error)),
        Err(_) => Err(silent(place, limit)),
    }
}
