//! A server of typed messages: one loop of the daemon takes events from it and gives actions to it.
//!
//! ```no_run
//! # use armor_socket::{Server, ServerLimits, listen};
//! # use armor_wire::peer::{PeerAction, PeerEvent};
//! # async fn daemon(mut handle: impl FnMut(PeerEvent<u64>, std::time::Duration) -> Vec<PeerAction<u64>>)
//! # -> Result<(), Box<dyn std::error::Error>> {
//! let listener = listen(([127, 0, 0, 1], 7411).into())?;
//! let mut server = Server::<u64, u64>::new(listener, ServerLimits::default())?;
//! loop {
//!     let event = server.next_event().await;
//!     for action in handle(event, server.now()) {
//!         server.perform(action);
//!     }
//! }
//! # }
//! ```

use std::collections::HashMap;
use std::io;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::frame::{self, FrameKind};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::message::WireType;
use tokio::sync::mpsc;
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::{self, Instant};
use tracing::{debug, error, info};

use crate::daemon::close_log::CloseLog;
use crate::daemon::connection::{ConnectionEvent, PeerConnection};
use crate::daemon::limits::{ACCEPT_REST, MAX_EVENTS, ServerLimits};
use crate::daemon::outgoing::Outgoing;
use crate::daemon::seats::{Handshakes, Seats};
use crate::daemon::stream::{AsyncListener, AsyncStream};
use crate::faults::AcceptLog;
use crate::listener::Listener;
use crate::owner::{OwnerError, check_client};
use crate::stream::Stream;
use crate::tuning::tune;
use armor_wire::peer::{CloseReason, PeerAction, PeerEvent, PeerId};

/// A listening server whose peers ask with `Q` and are answered with `R`. Dropping it closes
/// everything.
pub struct Server<Q, R> {
    events: mpsc::Receiver<(PeerId, ConnectionEvent<Q>)>,
    peers: HashMap<PeerId, Arc<Outgoing>>,
    epoch: Instant,
    accepting: JoinHandle<()>,
    answers: PhantomData<fn(R)>,
}

impl<Q: WireType + Send, R: WireType> Server<Q, R> {
    /// Starts to accept, in a task of its own on the current tokio runtime.
    ///
    /// # Errors
    /// If the system cannot watch the listener.
    ///
    /// # Panics
    /// Outside a tokio runtime.
    pub fn new(listener: Listener, limits: ServerLimits) -> io::Result<Self> {
        let listener = AsyncListener::new(listener)?;
        let (sender, events) = mpsc::channel(MAX_EVENTS);
        let epoch = Instant::now();
        let seats = Seats::new(limits.connections, limits.connections_per_address);
        let mut acceptor = Acceptor {
            limits,
            epoch,
            events_sender: sender,
            seats,
            handshakes: Handshakes::default(),
            faults: Arc::default(),
            connections: JoinSet::new(),
            last_peer: 0,
        };
        let accepting = tokio::spawn(async move { acceptor.accept_connections(listener).await });
        Ok(Self { events, peers: HashMap::new(), epoch, accepting, answers: PhantomData })
    }

    /// The time since the server started, on a monotonic clock.
    pub fn now(&self) -> Duration {
        self.epoch.elapsed()
    }

    /// Waits for the next event. Nothing is lost if the wait is given up.
    pub async fn next_event(&mut self) -> PeerEvent<Q> {
        loop {
            let Some((peer, event)) = self.events.recv().await else {
                // Every sender is gone: the acceptor has ended, and it never does by itself.
                std::future::pending::<()>().await;
                continue;
            };
            match event {
                ConnectionEvent::Hello { address, hello, preface, outgoing } => {
                    self.peers.insert(peer, outgoing);
                    return PeerEvent::Connected { peer, address, hello, preface };
                }
                ConnectionEvent::Closed { reason } => {
                    if self.peers.remove(&peer).is_some() {
                        return PeerEvent::Closed { peer, reason };
                    }
                }
                _ if !self.peers.contains_key(&peer) => {}
                ConnectionEvent::Message { arrived, message } => {
                    return PeerEvent::Message { peer, arrived, message };
                }
                ConnectionEvent::Beat => return PeerEvent::Beat { peer },
            }
        }
    }

    /// Performs an action, without waiting.
    pub fn perform(&mut self, action: PeerAction<R>) {
        match action {
            PeerAction::Welcome { peer, welcome } => {
                self.send_frame(peer, FrameKind::Welcome, &welcome);
            }
            PeerAction::Send { peer, message } => {
                self.send_frame(peer, FrameKind::Control, &message);
            }
            PeerAction::Refuse { peer, refusal } => {
                self.send_frame(peer, FrameKind::Refusal, &refusal);
                self.end_connection(peer, refusal.text);
            }
            PeerAction::Close { peer, reason } => self.end_connection(peer, reason),
        }
    }

    fn send_frame<T: WireType>(&self, peer: PeerId, kind: FrameKind, value: &T) {
        if let Some(outgoing) = self.peers.get(&peer) {
            outgoing.push_frame(kind, value);
        }
    }

    fn end_connection(&mut self, peer: PeerId, reason: String) {
        if let Some(outgoing) = self.peers.remove(&peer) {
            debug!(peer = peer.0, %reason, "connection ended");
            outgoing.end_with(CloseReason::Daemon(reason));
        }
    }
}

impl<Q, R> Drop for Server<Q, R> {
    fn drop(&mut self) {
        // Takes the connections' tasks along.
        self.accepting.abort();
    }
}

struct Acceptor<Q> {
    limits: ServerLimits,
    epoch: Instant,
    events_sender: mpsc::Sender<(PeerId, ConnectionEvent<Q>)>,
    seats: Seats,
    handshakes: Handshakes,
    faults: Arc<CloseLog>,
    connections: JoinSet<()>,
    last_peer: u64,
}

impl<Q: WireType + Send> Acceptor<Q> {
    async fn accept_connections(&mut self, listener: AsyncListener) {
        let mut log = AcceptLog::default();
        loop {
            tokio::select! {
                accepted = listener.accept() => match accepted {
                    Ok(stream) => {
                        if log.note_success() {
                            info!("connections are accepted again");
                        }
                        self.admit_connection(stream);
                    }
                    Err(problem) => {
                        if log.note_failure(Instant::now().into_std()) {
                            error!(%problem, "cannot accept connections; trying again");
                        }
                        time::sleep(ACCEPT_REST).await;
                    }
                },
                Some(_) = self.connections.join_next() => {}
            }
        }
    }

    fn admit_connection(&mut self, stream: Stream) {
        // A peer that is gone already needs no answer.
        let Ok(address) = stream.peer_address() else { return };
        // Before it takes a seat, so that other users cannot occupy any.
        if let Err(error) = check_client(&stream) {
            if !matches!(error, OwnerError::Closed) {
                self.faults.log_close(address, &CloseReason::OtherUser(error.to_string()));
                turn_away(&stream, RefusalCode::OtherUser, error.to_string());
            }
            return;
        }
        let Some(seat) = self.handshakes.take_seat(&self.seats, address.ip()) else {
            self.faults.log_close(address, &CloseReason::Crowded);
            turn_away(&stream, RefusalCode::Limit, "there are too many connections already");
            return;
        };
        if tune(&stream).is_err() {
            return;
        }
        let Ok(stream) = AsyncStream::new(stream) else { return };
        self.last_peer += 1;
        let connection = PeerConnection {
            peer: PeerId(self.last_peer),
            address,
            limits: self.limits,
            epoch: self.epoch,
            events: self.events_sender.clone(),
        };
        let faults = Arc::clone(&self.faults);
        self.connections.spawn(async move {
            connection.serve_peer(&stream, &seat, &faults).await;
        });
    }
}

/// Sends the reason, as far as that is possible without waiting.
fn turn_away(stream: &Stream, code: RefusalCode, reason: impl Into<String>) {
    let refusal = Refusal::new(code, reason);
    if let Ok(bytes) = frame::to_bytes(FrameKind::Refusal, &refusal) {
        // A new socket has room for it.
        let _ = stream.try_send(&bytes);
    }
}

#[cfg(test)]
mod tests;
