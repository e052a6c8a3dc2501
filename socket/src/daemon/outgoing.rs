//! The bounded buffer of bytes for one peer. The daemon fills it without waiting; the connection's
//! task empties it in as few writes as possible.

use armor_wire::frame::{self, FrameKind};
use armor_wire::message::WireType;
use parking_lot::{Mutex, MutexGuard};
use tokio::sync::Notify;

use armor_wire::peer::CloseReason;

/// A buffer above this is given back after use instead of being kept for each connection.
const KEPT_LEN: usize = 64 << 10;

/// The bytes that wait for one peer.
pub(crate) struct Outgoing {
    state: Mutex<OutgoingState>,
    changed: Notify,
    max_len: usize,
}

#[derive(Default)]
struct OutgoingState {
    bytes: Vec<u8>,
    welcomed: bool,
    end: Option<PendingEnd>,
}

enum PendingEnd {
    /// Immediately; waiting bytes are discarded.
    Now(CloseReason),
    /// After all waiting bytes are written.
    Written(CloseReason),
}

/// The next step of the connection's task.
pub(crate) enum Next {
    /// Writes the bytes it was given.
    Write,
    /// Ends the connection.
    End(CloseReason),
}

impl Outgoing {
    pub(crate) fn new(max_len: usize) -> Self {
        Self { state: Mutex::default(), changed: Notify::new(), max_len }
    }

    /// Appends a frame. A peer that reads too slowly for it is closed.
    pub(crate) fn push_frame<T: WireType>(&self, kind: FrameKind, value: &T) {
        let mut state = self.lock();
        if state.end.is_some() {
            return;
        }
        state.welcomed |= kind == FrameKind::Welcome;
        if let Err(error) = frame::append(kind, value, &mut state.bytes) {
            state.end = Some(PendingEnd::Now(CloseReason::Unsendable(error)));
        } else if state.bytes.len() > self.max_len {
            state.end = Some(PendingEnd::Now(CloseReason::NotReading));
        }
        self.changed.notify_one();
    }

    /// Appends a beat, if the peer was welcomed; before that it expects another answer.
    pub(crate) fn push_beat(&self) {
        let mut state = self.lock();
        if state.welcomed && state.end.is_none() {
            state.bytes.extend_from_slice(&frame::signal(FrameKind::Beat));
            self.changed.notify_one();
        }
    }

    /// Ends the connection once everything up to here is written.
    pub(crate) fn end_with(&self, reason: CloseReason) {
        let mut state = self.lock();
        if state.end.is_none() {
            state.end = Some(PendingEnd::Written(reason));
            self.changed.notify_one();
        }
    }

    /// Waits for bytes, which replace those in `bytes`, or for the end.
    pub(crate) async fn next_step(&self, bytes: &mut Vec<u8>) -> Next {
        loop {
            if let Some(next) = self.take_step(bytes) {
                return next;
            }
            self.changed.notified().await;
        }
    }

    fn take_step(&self, bytes: &mut Vec<u8>) -> Option<Next> {
        bytes.clear();
        if bytes.capacity() > KEPT_LEN {
            *bytes = Vec::new();
        }
        let mut state = self.lock();
        if let Some(PendingEnd::Now(reason)) =
            state.end.take_if(|end| matches!(end, PendingEnd::Now(_)))
        {
            return Some(Next::End(reason));
        }
        if !state.bytes.is_empty() {
            std::mem::swap(&mut state.bytes, bytes);
            return Some(Next::Write);
        }
        match state.end.take() {
            Some(PendingEnd::Now(reason) | PendingEnd::Written(reason)) => Some(Next::End(reason)),
            None => None,
        }
    }

    fn lock(&self) -> MutexGuard<'_, OutgoingState> {
        self.state.lock()
    }
}

#[cfg(test)]
mod tests {
    use armor_wire::hello::{Refusal, RefusalCode, Welcome};

    use super::*;

    fn welcome() -> Welcome {
        Welcome { name: "registry".into(), instance: 1, schema: String::new() }
    }

    #[test]
    fn beats_wait_for_the_welcome() {
        let outgoing = Outgoing::new(1 << 10);
        let mut bytes = Vec::new();
        outgoing.push_beat();
        assert!(outgoing.take_step(&mut bytes).is_none());
        outgoing.push_frame(FrameKind::Welcome, &welcome());
        outgoing.push_beat();
        assert!(matches!(outgoing.take_step(&mut bytes), Some(Next::Write)));
        assert!(bytes.ends_with(&frame::signal(FrameKind::Beat)));
    }

    #[test]
    fn a_refusal_is_written_before_the_end() {
        let outgoing = Outgoing::new(1 << 10);
        let mut bytes = Vec::new();
        outgoing.push_frame(FrameKind::Refusal, &Refusal::new(RefusalCode::Limit, "full"));
        outgoing.end_with(CloseReason::Daemon("full".into()));
        outgoing.push_frame(FrameKind::Control, &1u64);
        assert!(matches!(outgoing.take_step(&mut bytes), Some(Next::Write)));
        assert_eq!(bytes[4], FrameKind::Refusal as u8);
        assert!(matches!(
            outgoing.take_step(&mut bytes),
            Some(Next::End(CloseReason::Daemon(reason))) if reason == "full"
        ));
    }

    #[test]
    fn a_peer_that_does_not_read_is_ended_and_its_buffer_stays_bounded() {
        let outgoing = Outgoing::new(100);
        for _ in 0..1000 {
            outgoing.push_frame(FrameKind::Control, &[0u64; 5]);
        }
        assert!(outgoing.lock().bytes.len() < 200);
        let mut bytes = Vec::new();
        assert!(matches!(outgoing.take_step(&mut bytes), Some(Next::End(CloseReason::NotReading))));
    }
}
