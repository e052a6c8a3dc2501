//! One connection from its first byte to its last: the handshake, then reading, writing and beating
//! in one task, then the end.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::acting::{Opening, Preface};
use armor_wire::codec;
use armor_wire::frame::{self, FrameError, FrameKind, FrameReader};
use armor_wire::hello::{HandshakeError, Hello};
use armor_wire::liveness::{LOOK, Liveness};
use armor_wire::message::WireType;
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tokio::time::{self, Instant, MissedTickBehavior};

use crate::daemon::close_log::CloseLog;
use crate::daemon::limits::{LINGER, MAX_REQUEST_LEN, ServerLimits};
use crate::daemon::outgoing::{Next, Outgoing};
use crate::daemon::seats::HandshakeSeat;
use crate::daemon::stream::AsyncStream;
use armor_wire::peer::{CloseReason, PeerId};

/// What a connection reports to the server.
#[allow(clippy::large_enum_variant, reason = "there is one `Hello` for each connection")]
pub(crate) enum ConnectionEvent<Q> {
    /// A hello was read.
    Hello { address: SocketAddr, hello: Hello, preface: Option<Preface>, outgoing: Arc<Outgoing> },
    /// A message was read.
    Message { arrived: Duration, message: Q },
    /// A beat was read.
    Beat,
    /// The connection is over.
    Closed { reason: CloseReason },
}

/// The channel to the server.
pub(crate) type EventSender<Q> = mpsc::Sender<(PeerId, ConnectionEvent<Q>)>;

/// One connection.
pub(crate) struct PeerConnection<Q> {
    pub(crate) peer: PeerId,
    pub(crate) address: SocketAddr,
    pub(crate) limits: ServerLimits,
    /// When the server started.
    pub(crate) epoch: Instant,
    pub(crate) events: EventSender<Q>,
}

impl<Q: WireType + Send> PeerConnection<Q> {
    /// Serves the connection until it ends. The end is reported to the server if the hello was,
    /// unless the server itself ended the connection.
    pub(crate) async fn serve_peer(
        &self,
        stream: &AsyncStream,
        seat: &HandshakeSeat,
        faults: &CloseLog,
    ) {
        let mut frames = FrameReader::with_limit(MAX_REQUEST_LEN);
        let hello = time::timeout(self.limits.handshake, read_hello(stream, &mut frames));
        let hello = tokio::select! {
            hello = hello => hello.unwrap_or(Err(CloseReason::SlowHello)),
            () = seat.wait_for_loss() => Err(CloseReason::Crowded),
        };
        // Held until the connection ends.
        let seat = seat.take();
        let hello = if seat.is_some() { hello } else { Err(CloseReason::Crowded) };
        let outgoing = Arc::new(Outgoing::new(self.limits.outgoing_len));
        match hello {
            Ok((hello, preface)) => {
                let (address, outgoing) = (self.address, Arc::clone(&outgoing));
                self.send_event(ConnectionEvent::Hello { address, hello, preface, outgoing }).await;
            }
            Err(reason) => {
                faults.log_close(self.address, &reason);
                if let CloseReason::Hello(HandshakeError::Refused(refusal)) = reason
                    && let Ok(bytes) = frame::to_bytes(FrameKind::Refusal, &refusal)
                    && stream.write_all(&bytes).await.is_ok()
                {
                    drain_and_close(stream).await;
                }
                return;
            }
        }
        let liveness = Mutex::new(Liveness::new(self.now()));
        let reason = tokio::select! {
            reason = self.read_frames(stream, &mut frames, &liveness) => reason,
            reason = self.write_frames(stream, &outgoing, &liveness) => reason,
            reason = self.send_beats(&outgoing, &liveness) => reason,
        };
        faults.log_close(self.address, &reason);
        if matches!(reason, CloseReason::Daemon(_)) {
            drain_and_close(stream).await;
        } else {
            self.send_event(ConnectionEvent::Closed { reason }).await;
        }
    }

    async fn read_frames(
        &self,
        stream: &AsyncStream,
        frames: &mut FrameReader,
        liveness: &Mutex<Liveness>,
    ) -> CloseReason {
        loop {
            loop {
                let event = match frames.next_frame() {
                    Ok(None) => break,
                    Ok(Some(frame)) if frame.kind == FrameKind::Beat => ConnectionEvent::Beat,
                    Ok(Some(frame)) if frame.kind == FrameKind::Control => {
                        match codec::decode_control(frame.body) {
                            Ok(message) => {
                                ConnectionEvent::Message { arrived: self.now(), message }
                            }
                            Err(error) => return error.into(),
                        }
                    }
                    Ok(Some(frame)) => {
                        return FrameError::Unexpected { got: frame.kind, wanted: "control" }
                            .into();
                    }
                    Err(error) => return error.into(),
                };
                liveness.lock().heard(self.now());
                self.send_event(event).await;
            }
            match stream.read(frames.space()).await {
                Ok(0) if frames.is_mid_frame() => return CloseReason::Truncated,
                Ok(0) => return CloseReason::Ended,
                Ok(len) => frames.filled(len),
                Err(error) => return CloseReason::Broken(error),
            }
        }
    }

    async fn write_frames(
        &self,
        stream: &AsyncStream,
        outgoing: &Outgoing,
        liveness: &Mutex<Liveness>,
    ) -> CloseReason {
        let mut bytes = Vec::new();
        loop {
            if let Next::End(reason) = outgoing.next_step(&mut bytes).await {
                return reason;
            }
            let mut rest = bytes.as_slice();
            while !rest.is_empty() {
                match time::timeout(self.limits.stall, stream.write(rest)).await {
                    Err(_) | Ok(Ok(0)) => return CloseReason::NotReading,
                    Ok(Ok(len)) => rest = &rest[len..],
                    Ok(Err(error)) => return CloseReason::Broken(error),
                }
            }
            liveness.lock().spoke(self.now());
        }
    }

    async fn send_beats(&self, outgoing: &Outgoing, liveness: &Mutex<Liveness>) -> CloseReason {
        // All connections look at the same moments, so that an idle daemon wakes four times a
        // second, independent of their number.
        let looks = self.now().as_nanos() / LOOK.as_nanos() + 1;
        let first = self.epoch + LOOK * u32::try_from(looks).unwrap_or(u32::MAX);
        let mut look = time::interval_at(first, LOOK);
        look.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut before = self.now();
        loop {
            look.tick().await;
            let now = self.now();
            let mut liveness = liveness.lock();
            if now.saturating_sub(before) > 2 * LOOK {
                // This process itself was suspended; what the peer sent meanwhile is not read yet.
                liveness.heard(now);
            }
            if liveness.is_silent(now) {
                return CloseReason::Silent;
            }
            if liveness.owes_beat(now) {
                outgoing.push_beat();
            }
            before = now;
        }
    }

    fn now(&self) -> Duration {
        self.epoch.elapsed()
    }

    async fn send_event(&self, event: ConnectionEvent<Q>) {
        // Dropping the server also aborts this task.
        let _ = self.events.send((self.peer, event)).await;
    }
}

async fn read_hello(
    stream: &AsyncStream,
    frames: &mut FrameReader,
) -> Result<(Hello, Option<Preface>), CloseReason> {
    let mut opening = Opening::default();
    loop {
        if let Some(frame) = frames.next_frame()? {
            if let Some(hello) = opening.read_frame(&frame)? {
                return Ok((hello, opening.into_preface()));
            }
            let beat = frame::signal(FrameKind::Beat);
            stream.write_all(&beat).await.map_err(CloseReason::Broken)?;
            continue;
        }
        match stream.read(frames.space()).await.map_err(CloseReason::Broken)? {
            0 if frames.is_mid_frame() => return Err(CloseReason::Truncated),
            0 => return Err(CloseReason::Ended),
            len => frames.filled(len),
        }
    }
}

/// Waits until the peer has read the last frames: closing a socket that has unread bytes would
/// reset the connection and discard them.
async fn drain_and_close(stream: &AsyncStream) {
    let _ = stream.shutdown_writing();
    let mut waste = [0; 4 << 10];
    let drain = async { while matches!(stream.read(&mut waste).await, Ok(len) if len > 0) {} };
    let _ = time::timeout(LINGER, drain).await;
}
