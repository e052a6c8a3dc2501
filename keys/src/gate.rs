//! The gate of a host to others: accepts TLS 1.3 from holders of keys, and forwards each connection to
//! one process of the system, on behalf of the holder; that of an agent runs components for hosts, too.
//!
//! What the holder may do is decided by that process ([`armor_wire::acting`]); the gate decides who
//! the holder is, and [`Reach`] which processes can be reached.

mod limits;
mod session;
mod sessions;
mod strangers;

use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::path::Path;
use std::sync::Arc;

use armor_socket::{AcceptLog, FaultTable, explain_bind_error};
use armor_wire::gate::{GateRequest, HostFinding};
use armor_wire::remote_process::RemoteStart;
use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{self, Instant, MissedTickBehavior};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;
use tracing::{error, info, warn};

use crate::certificate::CertificateFacts;
use crate::datagrams::GatePort;
use crate::expiry::{describe_notice, find_notice, now_s};
use crate::frames::read_control;
use crate::host_keys::{GateKeysError, HostKeys};
use crate::reach::Reach;
use crate::run_channel::RunChannel;
use crate::streams::{drain_and_close, tune_stream};
use crate::tls::explain_refused_key;
pub use limits::GateLimits;
use limits::{ACCEPT_REST, LOOK_AT_KEYS};
use sessions::Sessions;
pub use strangers::{StrangerPlace, Strangers};

/// How a gate is run.
#[derive(Clone)]
pub struct GateOptions {
    /// Where it listens: any address of the host.
    pub listen: SocketAddr,
    /// The key of the host and the list of revoked keys.
    pub keys: HostKeys,
    /// Which processes can be reached.
    pub reach: Arc<dyn Reach>,
    /// Takes requests to run a component, if this is the gate of an agent.
    pub runs: Option<mpsc::Sender<RunOrder>>,
    /// Examines this host for others.
    pub examiner: HostExaminer,
    /// Limits on what others cost it.
    pub limits: GateLimits,
}

/// Returns what `armor doctor` finds of this host. It may take seconds.
pub type HostExaminer = Arc<dyn Fn() -> Vec<HostFinding> + Send + Sync>;

/// A host's request to run a component, and the connection on which it is served.
pub struct RunOrder {
    /// What to run.
    pub start: RemoteStart,
    /// The host that asks, as its key names it.
    pub launcher: String,
    /// Where it connects from.
    pub address: SocketAddr,
    /// Its requests and their answers from here on; not answered yet.
    pub channel: RunChannel,
}

/// Why a gate cannot serve.
#[derive(Debug, Error)]
pub enum GateStartError {
    /// Its keys cannot be used.
    #[error(transparent)]
    Keys(#[from] GateKeysError),
    /// It cannot listen where it should.
    #[error("cannot listen on {address}: {reason}; or choose another port")]
    Listen {
        /// Where.
        address: SocketAddr,
        /// Why.
        reason: String,
    },
}

/// Serves until the future is dropped, which closes everything. `ready` gets the address once
/// clients can connect to it.
///
/// # Errors
/// [`GateStartError`] if it cannot start; once ready, no client can end it.
pub async fn serve(
    options: GateOptions,
    ready: impl FnOnce(SocketAddr),
) -> Result<Infallible, GateStartError> {
    let listen_error = |error: io::Error| refused_address(options.listen, &error);
    let listener = TcpListener::bind(options.listen).await.map_err(listen_error)?;
    let address = listener.local_addr().map_err(listen_error)?;
    let GateOptions { keys, reach, runs, examiner, .. } = options;
    match reach.registry() {
        Some(registry) => info!(%address, %registry, "the gate of {} listens", keys.host_name()),
        None => info!(%address, "the gate of {} listens", keys.host_name()),
    }
    let datagrams = match GatePort::open(address).await {
        Ok(port) => Some(port),
        Err(problem) => {
            warn!(%problem, "UDP port {} cannot be opened: links between hosts take TCP", address.port());
            None
        }
    };
    let gate = Arc::new(Gate {
        keys,
        reach,
        runs,
        examiner,
        examining: tokio::sync::Mutex::default(),
        limits: options.limits,
        strangers: Strangers::new(&options.limits),
        sessions: Sessions::new(options.limits),
        datagrams,
        faults: FaultTable::default(),
        notices: FaultTable::default(),
    });
    ready(address);
    gate.announce_end(&gate.keys.lock().host.facts);
    let datagrams = gate.datagrams.clone();
    let serve_datagrams = async {
        match datagrams {
            Some(port) => port.serve().await,
            None => std::future::pending().await,
        }
    };
    tokio::select! {
        never = accept_connections(&gate, &listener) => never,
        never = serve_datagrams => never,
    }
}

/// Checks whether a gate could start now, without starting it.
///
/// # Errors
/// As [`serve`].
pub fn check_start(listen: SocketAddr, keys: &Path) -> Result<(), GateStartError> {
    HostKeys::read(keys)?;
    match std::net::TcpListener::bind(listen) {
        Ok(_) => Ok(()),
        Err(error) => Err(refused_address(listen, &error)),
    }
}

fn refused_address(address: SocketAddr, error: &io::Error) -> GateStartError {
    GateStartError::Listen { address, reason: explain_bind_error(address, error) }
}

async fn accept_connections(gate: &Arc<Gate>, listener: &TcpListener) -> ! {
    let mut connections = JoinSet::new();
    let mut look = time::interval(LOOK_AT_KEYS);
    look.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut log = AcceptLog::default();
    loop {
        tokio::select! {
            _ = look.tick() => gate.look_at_keys(),
            accepted = listener.accept() => match accepted {
                Ok((stream, address)) => {
                    if log.note_success() {
                        info!("connections are accepted again");
                    }
                    let gate = Arc::clone(gate);
                    connections.spawn(async move { gate.serve_client(stream, address).await });
                }
                Err(problem) => {
                    if log.note_failure(Instant::now().into_std()) {
                        error!(%problem, "cannot accept connections; trying again");
                    }
                    time::sleep(ACCEPT_REST).await;
                }
            },
            Some(_) = connections.join_next() => {}
        }
    }
}

struct Gate {
    keys: HostKeys,
    reach: Arc<dyn Reach>,
    runs: Option<mpsc::Sender<RunOrder>>,
    examiner: HostExaminer,
    /// One examination at a time: it starts programs.
    examining: tokio::sync::Mutex<()>,
    limits: GateLimits,
    strangers: Strangers,
    sessions: Sessions,
    /// Of links between hosts; the port may be taken.
    datagrams: Option<Arc<GatePort>>,
    /// What was logged of each address.
    faults: FaultTable<String>,
    /// Which ends of keys were announced: serial number and notice, in days.
    notices: FaultTable<(String, i64)>,
}

/// A client that has proven a key and sent its request.
struct Client {
    stream: TlsStream<TcpStream>,
    facts: CertificateFacts,
    request: GateRequest,
}

impl Gate {
    fn look_at_keys(&self) {
        let mut keys = self.keys.lock();
        if let Some(change) = keys.look() {
            if change.renewed {
                info!("the gate has a new key: {}", keys.host.facts.holder);
            }
            if change.revoked > 0 {
                info!("{} more keys are revoked", change.revoked);
            }
            for problem in change.problems {
                warn!("{problem}; until this is fixed the gate uses what it has read before");
            }
        }
        let (host, revoked) = (keys.host.facts.clone(), Arc::clone(&keys.revoked));
        drop(keys);
        self.announce_end(&host);
        let now_s = now_s();
        self.sessions.end_sessions(|facts| {
            let name = &facts.holder.name;
            if revoked.contains(&facts.serial) {
                Some(format!("the key of {name} is revoked"))
            } else if facts.not_after_s < now_s {
                Some(format!("the key of {name} has expired"))
            } else {
                None
            }
        });
    }

    /// Logs that a key expires, once for each of the times ahead.
    fn announce_end(&self, facts: &CertificateFacts) {
        let now_s = now_s();
        if let Some(notice) = find_notice(facts.not_after_s, now_s)
            && self.notices.is_new(None, (facts.serial.to_string(), notice))
            && let Some(text) = describe_notice(&facts.holder.name, facts.not_after_s, now_s)
        {
            warn!("{text}");
        }
    }

    fn log_once(&self, address: IpAddr, why: &str) {
        if self.faults.is_new(Some(address), why.to_owned()) {
            warn!(
                "a connection from {address} is refused: {why}; further ones like it are not logged"
            );
        }
    }

    async fn serve_client(&self, stream: TcpStream, address: SocketAddr) {
        let mut place = self.strangers.enter(address.ip());
        let opened = tokio::select! {
            opened = time::timeout(self.limits.handshake, self.authenticate(stream)) => opened,
            () = place.ended() => {
                return self.log_once(address.ip(), "too many others without a key have come");
            }
        };
        let slow = || Err(format!("no key and no request within {:?}", self.limits.handshake));
        match opened.unwrap_or_else(|_| slow()) {
            Ok(client) => {
                drop(place);
                self.announce_end(&client.facts);
                self.serve_session(client, address).await;
            }
            Err(why) => self.log_once(address.ip(), &why),
        }
    }

    async fn authenticate(&self, stream: TcpStream) -> Result<Client, String> {
        let stream = tune_stream(stream).map_err(|error| error.to_string())?;
        let config = Arc::clone(&self.keys.lock().config);
        let accepting = TlsAcceptor::from(config).accept(stream).into_fallible();
        let mut stream = match accepting.await {
            Ok(stream) => stream,
            Err((error, stream)) => {
                let inner = error.get_ref().and_then(|it| it.downcast_ref::<rustls::Error>());
                let why =
                    inner.map_or_else(|| "it has left".into(), |it| explain_refused_key(it).into());
                drain_and_close(stream).await;
                return Err(why);
            }
        };
        let certificates = stream.get_ref().1.peer_certificates().unwrap_or_default();
        // The verifier has read both already.
        let certificate = certificates.first().ok_or("it has no key")?;
        let facts = CertificateFacts::read(certificate)?;
        let request = read_control(&mut stream).await;
        let request = request.map_err(|_| "it sends no request of this protocol")?;
        Ok(Client { stream, facts, request })
    }
}
