//! The other end of a gate, on the computer of a person: a SOCKS5 proxy on loopback that carries each
//! connection of this user's tools over TLS to the gate.

mod socks;

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use armor_socket::{Stream, check_client};
use armor_wire::acting::KeyRole;
use armor_wire::backoff::Backoff;
use armor_wire::frame::{self, FrameKind};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::liveness::{BEAT, SILENCE};
use parking_lot::Mutex;
use rustls::ClientConfig;
use rustls::pki_types::ServerName;
use thiserror::Error;
use tokio::io::{AsyncWriteExt, copy_bidirectional_with_sizes};
use tokio::net::{TcpListener, TcpStream};
use tokio::time;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;

use crate::GATE_NAME;
use crate::certificate::CertificateFacts;
use crate::frames::{read_control, write_control};
use crate::gate::tune_stream;
use crate::identity::KeyPurpose;
use crate::key_file::KeyFile;
use crate::tls::{explain_tls_error, person_config};
use socks::SocksAnswer;

/// How long connecting to the gate and its answer may take.
const LIMIT: Duration = Duration::from_secs(5);
/// Wait after the first failed attempt to reach the gate.
const FIRST_DELAY: Duration = Duration::from_millis(100);
/// Longest wait between two attempts.
const MOST_DELAY: Duration = Duration::from_secs(1);
/// Bytes that are copied at a time, in each direction of a connection.
const COPY_LEN: usize = 32 << 10;

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
    /// The gate refuses the request.
    #[error("the gate refuses it: {0}")]
    Refused(Refusal),
}

/// The gate of one system, and the key for it.
pub struct GateClient {
    gate: String,
    key_path: PathBuf,
    key: Mutex<LoadedKey>,
}

#[derive(Clone)]
struct LoadedKey {
    facts: CertificateFacts,
    config: Arc<ClientConfig>,
}

/// What the gate reports of the session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GateSession {
    /// The name of the gate in its key.
    pub host: String,
    /// The holder of the key.
    pub name: String,
    /// Its role.
    pub role: KeyRole,
    /// Where the registry of the system listens on the robot's host.
    pub registry: SocketAddr,
}

/// A change of the connection to the gate.
#[derive(Clone, Debug, PartialEq)]
pub enum GateNotice {
    /// It is there.
    Connected(GateSession),
    /// It is not; it is tried again.
    Lost(GateError),
}

impl GateClient {
    /// A client of the gate at `gate`, `host:port`, with the key in a file.
    ///
    /// # Errors
    /// If the key cannot be used.
    pub fn new(gate: &str, key: &Path) -> Result<Self, GateError> {
        let key_path = key.to_owned();
        let key = Mutex::new(load_key(&key_path)?);
        Ok(Self { gate: gate.to_owned(), key_path, key })
    }

    /// What the certificate of the key contains.
    pub fn facts(&self) -> CertificateFacts {
        self.key.lock().facts.clone()
    }

    /// Keeps a session with the gate for as long as the future lives, and reports its changes.
    pub async fn watch_gate(&self, mut tell: impl FnMut(GateNotice)) {
        let mut backoff = Backoff::new(FIRST_DELAY, MOST_DELAY, armor_socket::random_id());
        let mut last = None;
        loop {
            let error = match self.open_session().await {
                Ok((session, mut stream)) => {
                    backoff.reset();
                    last = None;
                    tell(GateNotice::Connected(session));
                    self.wait_for_end(&mut stream).await
                }
                Err(error) => error,
            };
            // Each reason once, until the gate is back.
            if last.as_ref() != Some(&error) {
                tell(GateNotice::Lost(error.clone()));
                last = Some(error);
            }
            time::sleep(backoff.delay()).await;
            // A renewed key is used from here on; one that cannot be used leaves the old one.
            if let Ok(key) = load_key(&self.key_path) {
                *self.key.lock() = key;
            }
        }
    }

    /// Serves the tools of this user: each of their connections is carried to the gate. `tell` gets
    /// why one could not be.
    pub async fn serve_tools(
        self: Arc<Self>,
        listener: TcpListener,
        tell: impl Fn(&GateError) + Clone + Send + 'static,
    ) {
        loop {
            let Ok((stream, _)) = listener.accept().await else {
                time::sleep(Duration::from_millis(200)).await;
                continue;
            };
            let (client, tell) = (Arc::clone(&self), tell.clone());
            tokio::spawn(async move {
                if let Err(error) = client.serve_tool(stream).await {
                    tell(&error);
                }
            });
        }
    }

    async fn serve_tool(&self, stream: TcpStream) -> Result<(), GateError> {
        // Other users of this computer do not act with this key.
        let Ok(mut tool) = own_stream(stream) else { return Ok(()) };
        let Ok(Ok(address)) = time::timeout(LIMIT, socks::read_request(&mut tool)).await else {
            return Ok(());
        };
        let (mut gate, refused) = match self.request(GateRequest::Connect { address }).await {
            Ok((gate, GateReply::Connected)) => (gate, None),
            Ok((gate, GateReply::Refused { refusal })) => (gate, Some(GateError::Refused(refusal))),
            Ok((_, GateReply::Session { .. })) => return Ok(()),
            Err(error) => {
                let _ = socks::answer(&mut tool, SocksAnswer::Unreachable).await;
                return Err(error);
            }
        };
        if let Some(error) = refused {
            let answer = match &error {
                // No process listens there: as without a proxy.
                GateError::Refused(refusal) if refusal.code == RefusalCode::UnknownData => {
                    SocksAnswer::ConnectionRefused
                }
                _ => SocksAnswer::Forbidden,
            };
            let _ = socks::answer(&mut tool, answer).await;
            return if answer == SocksAnswer::Forbidden { Err(error) } else { Ok(()) };
        }
        if socks::answer(&mut tool, SocksAnswer::Connected).await.is_ok() {
            let _ = copy_bidirectional_with_sizes(&mut tool, &mut gate, COPY_LEN, COPY_LEN).await;
        }
        Ok(())
    }

    async fn open_session(&self) -> Result<(GateSession, TlsStream<TcpStream>), GateError> {
        let (stream, reply) = self.request(GateRequest::Watch).await?;
        match reply {
            GateReply::Session { host, name, role, registry } => {
                let registry = registry
                    .parse()
                    .map_err(|_| self.unreachable("it does not name a registry"))?;
                Ok((GateSession { host, name, role, registry }, stream))
            }
            GateReply::Refused { refusal } => Err(GateError::Refused(refusal)),
            GateReply::Connected => Err(self.unreachable("it answers another request")),
        }
    }

    /// Beats, and waits until the session ends.
    async fn wait_for_end(&self, stream: &mut TlsStream<TcpStream>) -> GateError {
        let (mut reader, mut writer) = tokio::io::split(stream);
        let beats = async {
            loop {
                time::sleep(BEAT).await;
                writer.write_all(&frame::signal(FrameKind::Beat)).await?;
                writer.flush().await?;
            }
        };
        let hear = async {
            loop {
                let frame = time::timeout(SILENCE, crate::frames::read_frame(&mut reader)).await;
                match frame.map_err(|_| io::Error::other("it has fallen silent"))?? {
                    (FrameKind::Beat, _) => {}
                    (FrameKind::Control, body) => {
                        let reply = armor_wire::codec::decode_control(&body);
                        if let Ok(GateReply::Refused { refusal }) = reply {
                            return Ok(refusal);
                        }
                    }
                    _ => return Err(io::Error::from(io::ErrorKind::InvalidData)),
                }
            }
        };
        let ended: io::Result<Refusal> = tokio::select! {
            broken = beats => broken,
            ended = hear => ended,
        };
        match ended {
            Ok(refusal) => GateError::Refused(refusal),
            Err(error) => self.explain_error(&error),
        }
    }

    /// Connects to the gate, sends a request, and reads the reply.
    async fn request(
        &self,
        request: GateRequest,
    ) -> Result<(TlsStream<TcpStream>, GateReply), GateError> {
        let exchange = async {
            let stream = tune_stream(TcpStream::connect(self.gate.as_str()).await?)?;
            let name = ServerName::try_from(GATE_NAME).map_err(io::Error::other)?;
            let config = Arc::clone(&self.key.lock().config);
            let mut stream = TlsConnector::from(config).connect(name, stream).await?;
            // The gate judges the key only now; why it refuses it is in what it sends.
            let written = write_control(&mut stream, &request).await;
            match read_control(&mut stream).await {
                Ok(reply) => Ok((stream, reply)),
                Err(error) => {
                    let is_closed = error.kind() == io::ErrorKind::UnexpectedEof;
                    Err(written.err().filter(|_| is_closed).unwrap_or(error))
                }
            }
        };
        match time::timeout(LIMIT, exchange).await {
            Ok(result) => result.map_err(|error| self.explain_error(&error)),
            Err(_) => Err(self.unreachable(&format!("it has not answered within {LIMIT:?}"))),
        }
    }

    fn explain_error(&self, error: &io::Error) -> GateError {
        let inner = error.get_ref().and_then(|it| it.downcast_ref::<rustls::Error>());
        match inner {
            Some(inner) => {
                GateError::NotAccepted { gate: self.gate.clone(), reason: explain_tls_error(inner) }
            }
            None if error.kind() == io::ErrorKind::UnexpectedEof => {
                self.unreachable("it has closed the connection")
            }
            None => self.unreachable(&error.to_string()),
        }
    }

    fn unreachable(&self, reason: &str) -> GateError {
        GateError::Unreachable { gate: self.gate.clone(), reason: reason.to_owned() }
    }
}

fn load_key(path: &Path) -> Result<LoadedKey, GateError> {
    let key = KeyFile::load(path).map_err(|error| GateError::Key(error.to_string()))?;
    let wrong = |reason: &str| GateError::Key(format!("{}: {reason}", path.display()));
    if key.facts.holder.purpose == KeyPurpose::Host {
        return Err(wrong(
            "it is the key of a host, for its gate; connecting needs that of a person",
        ));
    }
    let config = person_config(&key).map_err(|reason| wrong(&reason))?;
    Ok(LoadedKey { facts: key.facts, config: Arc::new(config) })
}

/// Accepts a connection of this user only.
fn own_stream(stream: TcpStream) -> io::Result<TcpStream> {
    let stream = Stream::Tcp(stream.into_std()?);
    check_client(&stream).map_err(io::Error::other)?;
    match stream {
        Stream::Tcp(stream) => {
            stream.set_nodelay(true)?;
            TcpStream::from_std(stream)
        }
        Stream::Unix(_) => Err(io::ErrorKind::Unsupported.into()),
    }
}
