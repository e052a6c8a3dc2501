//! Keeps a process registered at the registry for as long as it runs, also when the registry
//! restarts.

use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use armor_wire::backoff::Backoff;
use armor_wire::codec::MAX_CONTROL_LEN;
use armor_wire::frame::{self, FrameError, FrameKind, FrameReader};
use armor_wire::hello::{HandshakeError, Hello, Purpose, Refusal, Welcome, read_answer};
use armor_wire::liveness::{LOOK, Liveness};
use armor_wire::registry::ComponentEntry;
use thiserror::Error;
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::{self, Instant, MissedTickBehavior};
use tracing::{info, warn};

use crate::connect::reject_self_connection;
use crate::daemon::stream::AsyncStream;
use crate::run_keys::own_key;
use crate::stream::Stream;
use crate::tuning::tune;

/// Pause after the first failure. A registry that restarts immediately is found again immediately.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
/// Longest pause. A registry that is back is found within 2 s, connecting included.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);
/// How long connecting and the handshake may take each; a host that is cut off answers neither.
const PATIENCE: Duration = Duration::from_secs(2);

/// The status of a registration.
#[derive(Clone, Debug, PartialEq)]
pub enum RegistrationStatus {
    /// The registry cannot be reached; further attempts are made.
    Away,
    /// The registry has registered the process.
    Registered {
        /// The registry's process start.
        registry: u64,
    },
    /// The registry refuses the process; further attempts are made, because a name can become free.
    Refused(Refusal),
}

/// A registration that is kept up. Dropping it ends it.
pub struct Registration {
    status: watch::Receiver<RegistrationStatus>,
    task: JoinHandle<()>,
}

impl Registration {
    /// Registers `entry`, in a task of its own on the current tokio runtime.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    pub fn keep_registered(registry: SocketAddr, entry: ComponentEntry) -> Self {
        let (status_sender, status) = watch::channel(RegistrationStatus::Away);
        let task = tokio::spawn(stay_registered(registry, entry, status_sender));
        Self { status, task }
    }

    /// Returns the current status.
    pub fn status(&self) -> RegistrationStatus {
        self.status.borrow().clone()
    }

    /// Waits until the status differs from that of the last call.
    pub async fn changed(&mut self) -> RegistrationStatus {
        if self.status.changed().await.is_err() {
            // The task ends only with `self`.
            std::future::pending::<()>().await;
        }
        self.status.borrow_and_update().clone()
    }
}

impl Drop for Registration {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Why a session with the registry ended.
#[derive(Debug, Error)]
enum SessionError {
    #[error(transparent)]
    Io(#[from] io::Error),
    #[error(transparent)]
    Handshake(#[from] HandshakeError),
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error("no answer")]
    NoAnswer(#[from] time::error::Elapsed),
    #[error("it is silent")]
    Silent,
}

async fn stay_registered(
    registry: SocketAddr,
    entry: ComponentEntry,
    status: watch::Sender<RegistrationStatus>,
) {
    let mut backoff = Backoff::new(FIRST_PAUSE, LONGEST_PAUSE, entry.instance);
    let mut logged = String::new();
    loop {
        let Err(error) = run_session(registry, &entry, &status).await;
        if matches!(*status.borrow(), RegistrationStatus::Registered { .. }) {
            backoff.reset();
            logged.clear();
        }
        let text = error.to_string();
        if logged != text {
            warn!(%registry, name = %entry.name, %error, "not registered; trying again");
            logged = text;
        }
        let new = match error {
            SessionError::Handshake(HandshakeError::Refused(refusal)) => {
                RegistrationStatus::Refused(refusal)
            }
            _ => RegistrationStatus::Away,
        };
        status.send_if_modified(|before| {
            let is_news = *before != new;
            *before = new;
            is_news
        });
        time::sleep(backoff.delay()).await;
    }
}

/// One connection to the registry, from connecting to its end.
async fn run_session(
    registry: SocketAddr,
    entry: &ComponentEntry,
    status: &watch::Sender<RegistrationStatus>,
) -> Result<Infallible, SessionError> {
    let stream = time::timeout(PATIENCE, TcpStream::connect(registry)).await??.into_std()?;
    reject_self_connection(&stream)?;
    let stream = Stream::Tcp(stream);
    tune(&stream)?;
    let stream = AsyncStream::new(stream)?;
    let purpose = Purpose::Registry { entry: Some(entry.clone()) };
    let mut hello = Hello::new(&entry.name, entry.instance, purpose);
    if let Some(key) = own_key(&entry.name) {
        key.prove(&mut hello);
    }
    let mut frames = FrameReader::with_limit(MAX_CONTROL_LEN);
    let bytes = frame::to_bytes(FrameKind::Hello, &hello)?;
    let welcome = time::timeout(PATIENCE, async {
        stream.write_all(&bytes).await?;
        read_welcome(&stream, &mut frames).await
    });
    let welcome = welcome.await??;
    info!(%registry, name = %entry.name, "registered");
    status.send_replace(RegistrationStatus::Registered { registry: welcome.instance });
    exchange_beats(&stream, &mut frames).await
}

async fn read_welcome(
    stream: &AsyncStream,
    frames: &mut FrameReader,
) -> Result<Welcome, SessionError> {
    loop {
        if let Some(frame) = frames.next_frame()? {
            return Ok(read_answer(&frame)?);
        }
        fill_reader(stream, frames).await?;
    }
}

/// Beats, and listens for beats, until the connection ends.
async fn exchange_beats(
    stream: &AsyncStream,
    frames: &mut FrameReader,
) -> Result<Infallible, SessionError> {
    let epoch = Instant::now();
    let mut liveness = Liveness::new(epoch.elapsed());
    let mut look = time::interval(LOOK);
    look.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        tokio::select! {
            // What has arrived is read before the silence is judged: this process may have slept.
            biased;
            filled = fill_reader(stream, frames) => filled?,
            _ = look.tick() => {}
        }
        let now = epoch.elapsed();
        while frames.next_frame()?.is_some() {
            liveness.heard(now);
        }
        if liveness.is_silent(now) {
            return Err(SessionError::Silent);
        }
        if liveness.owes_beat(now) {
            time::timeout(PATIENCE, stream.write_all(&frame::signal(FrameKind::Beat))).await??;
            liveness.spoke(now);
        }
    }
}

async fn fill_reader(stream: &AsyncStream, frames: &mut FrameReader) -> Result<(), SessionError> {
    match stream.read(frames.space()).await? {
        0 => Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
        len => {
            frames.filled(len);
            Ok(())
        }
    }
}
