//! The session with a gate: it lasts while the gate is connected, and is begun again after a loss.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use armor_wire::acting::KeyRole;
use armor_wire::backoff::Backoff;
use armor_wire::frame::{self, FrameKind};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::Refusal;
use armor_wire::liveness::{BEAT, SILENCE};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::time;
use tokio_rustls::client::TlsStream;

use super::{GateClient, GateError, KeySource, explain_error, load_key};

/// Wait after the first failed attempt to reach the gate.
const FIRST_DELAY: Duration = Duration::from_millis(100);
/// Longest wait between two attempts.
const MOST_DELAY: Duration = Duration::from_secs(1);

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
            if let KeySource::Person { path, key } = &self.key
                && let Ok(loaded) = load_key(path)
            {
                *key.lock() = loaded;
            }
        }
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
            GateReply::Connected
            | GateReply::ExecutableWanted
            | GateReply::Clock { .. }
            | GateReply::Examined { .. } => Err(self.unreachable("it answers another request")),
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
            Err(error) => explain_error(&self.name_gate(), &error),
        }
    }
}
