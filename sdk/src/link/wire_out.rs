//! The publisher's end of one link.

use std::net::Shutdown;
use std::sync::Arc;
use std::time::Duration;

use armor_socket::{Stream, is_temporary};
use armor_wire::control::LinkStatus;
use armor_wire::frame::{self, FLAG_FRESH, FrameKind, FrameReader};
use armor_wire::keep::Keep;
use armor_wire::liveness::Liveness;
use armor_wire::shared_memory::MemoryUse;

use super::datagrams_out::LinkDatagrams;
use super::memory_out::LinkMemory;
use super::patience::Patience;
use super::publishing::marked_fresh;
use super::queue::{GATHER_LEN, LinkQueue};
use crate::faults::{PeerFault, PeerFaultLog};

/// Position of the flags in a frame (docs/protocol.md, Frames).
pub(super) const FLAGS_AT: usize = 5;

/// The publisher's end of a link.
pub(crate) struct OutgoingLink {
    pub stream: Arc<Stream>,
    pub to: String,
    pub faults: Arc<PeerFaultLog>,
    pub keep: Keep,
    /// How many of its last values a latched output sends at the beginning.
    pub history: u32,
    pub queue: LinkQueue,
    pub reader: FrameReader,
    pub liveness: Liveness,
    pub paused: bool,
    /// The next frame does not follow the previous one, which is intended: it is marked as fresh.
    pub fresh: bool,
    /// The call of user code in which this link was last written to; later data of the same call
    /// are gathered.
    pub last_call: u64,
    pub sent: u64,
    pub dropped: u64,
    pub patience: Patience,
    /// Sequence of the last data given to this link.
    pub last_sequence: Option<u64>,
    /// Whether the subscriber takes data from shared memory.
    pub memory_use: MemoryUse,
    /// The memory, once it is offered: data come by its ring from then on.
    pub memory: Option<LinkMemory>,
    /// The datagrams, if the link has asked for them.
    pub datagrams: Option<Box<LinkDatagrams>>,
    pub broken: bool,
}

/// The result of offering one frame to one link.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum OfferResult {
    Sent,
    /// It waits; `true` if the service thread must be woken to watch the socket.
    Queued(bool),
    Gathered,
    Skipped,
}

impl OutgoingLink {
    /// Writes without waiting. Returns how many bytes the socket has taken. A failure breaks the
    /// link.
    pub fn write(&mut self, bytes: &[u8]) -> usize {
        match self.stream.try_send(bytes) {
            Ok(len) => len,
            Err(error) if is_temporary(&error) => 0,
            Err(_) => {
                self.break_off();
                0
            }
        }
    }

    /// Whether data are sent on it when they are published.
    pub fn is_pushed(&self) -> bool {
        !self.paused && !self.broken && self.keep != Keep::Pull
    }

    /// Whether the newest frame is stored for it, to answer its pulls.
    pub fn is_answered(&self) -> bool {
        self.keep == Keep::Pull && self.memory.is_none() && !self.broken
    }

    /// What carries its data, as `armor graph` shows it.
    fn transport(&self) -> &'static str {
        if let Some(datagrams) = &self.datagrams {
            return datagrams.transport();
        }
        match *self.stream {
            Stream::Unix(_) if self.memory.is_some() => "shm",
            Stream::Unix(_) => "unix",
            Stream::Tcp(_) => "tcp",
        }
    }

    pub fn break_off(&mut self) {
        self.broken = true;
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    /// Sends, gathers or queues a small frame.
    pub fn offer_frame(&mut self, frame: &mut [u8], call: u64) -> OfferResult {
        if !self.sends_frames() {
            return OfferResult::Skipped;
        }
        self.sent += 1;
        if std::mem::take(&mut self.fresh) {
            // All links share this buffer: the mark is for this one alone, so it is removed again.
            frame[FLAGS_AT] |= FLAG_FRESH;
            let offered = self.offer_marked(frame, call);
            frame[FLAGS_AT] &= !FLAG_FRESH;
            return offered;
        }
        self.offer_marked(frame, call)
    }

    fn offer_marked(&mut self, frame: &[u8], call: u64) -> OfferResult {
        if !self.queue.is_empty() {
            self.dropped += self.queue.push(frame);
            if self.queue.is_congested() || self.queue.len() < GATHER_LEN {
                return if self.queue.is_congested() {
                    OfferResult::Queued(false)
                } else {
                    OfferResult::Gathered
                };
            }
            return if self.drain_queue() { OfferResult::Sent } else { OfferResult::Queued(true) };
        }
        // Not the first data of this call of user code: the end of the call flushes what is
        // gathered. Outside a call (0) there is no such end, so nothing is gathered.
        if call != 0 && self.last_call == call {
            self.dropped += self.queue.push(frame);
            return OfferResult::Gathered;
        }
        self.last_call = call;
        let written = self.write(frame);
        if written == frame.len() || self.broken {
            return OfferResult::Sent;
        }
        // Congested first: otherwise the push would count as gathering, to which no policy applies.
        self.queue.set_congested();
        self.dropped += self.queue.push_shared(Arc::new(frame.to_vec()), written);
        OfferResult::Queued(true)
    }

    /// Writes what waits. Returns whether all of it is written.
    pub fn drain_queue(&mut self) -> bool {
        let stream = Arc::clone(&self.stream);
        let before = self.queue.len();
        match self.queue.drain(|bytes| stream.try_send(bytes)) {
            Ok(dropped) => self.dropped += dropped,
            Err(_) => self.break_off(),
        }
        if self.queue.len() < before {
            self.patience.restart();
        }
        self.queue.is_empty()
    }

    /// Informs the subscriber which data are the newest: those that wait, or those that were sent.
    fn answer_sync(&mut self) {
        if !self.queue.is_empty() && !self.drain_queue() {
            return self.queue.insert_answer(frame::synced);
        }
        self.send_unqueued(&frame::synced(false));
    }

    /// Sends the newest data, if they are newer than the last that were sent.
    fn answer_pull(&mut self, newest: Option<&(u64, Arc<Vec<u8>>)>) {
        // The subscriber has not taken the answer before: that is all it gets.
        if !self.queue.is_empty() && !self.drain_queue() {
            return self.queue.insert_answer(frame::synced);
        }
        let newer = newest.filter(|(sequence, _)| self.last_sequence != Some(*sequence));
        let Some((sequence, frame)) = newer.filter(|_| !self.paused) else {
            return self.answer_sync();
        };
        self.last_sequence = Some(*sequence);
        self.sent += 1;
        let fresh = std::mem::take(&mut self.fresh);
        let frame = if fresh { Arc::new(marked_fresh(frame)) } else { Arc::clone(frame) };
        let answer = frame::synced(true);
        let written = self.write(&answer);
        if written < answer.len() {
            self.queue.push_tail(answer[written..].to_vec());
        }
        let written = if self.queue.is_empty() { self.write(&frame) } else { 0 };
        if written < frame.len() && !self.broken {
            self.queue.set_congested();
            self.dropped += self.queue.push_shared(frame, written);
        }
    }

    pub fn status(&self) -> LinkStatus {
        let in_ring = self.memory.as_ref().map_or(0, LinkMemory::count_waiting);
        // What lies ready for a pull neither waits to be sent, nor is it.
        let (waiting, ready) = if self.keep == Keep::Pull { (0, in_ring) } else { (in_ring, 0) };
        LinkStatus {
            to: self.to.clone(),
            keep: self.keep,
            // The subscriber can write into its ring, and so count as ready what was never sent.
            sent: (self.sent - self.dropped).saturating_sub(ready),
            dropped: self.dropped,
            queued: self.queue.count_frames() as u64 + waiting,
            paused: self.paused,
            transport: self.transport().into(),
        }
    }

    /// Reads the subscriber's signals, and answers them; `newest` is the sequence and the frame of the
    /// newest data, where a subscriber pulls. Returns whether it has just resumed.
    pub fn read_signals(&mut self, now: Duration, newest: Option<&(u64, Arc<Vec<u8>>)>) -> bool {
        let mut resumed = false;
        match self.stream.try_receive(self.reader.space()) {
            Ok(0) => self.break_off(),
            Ok(len) => {
                self.reader.filled(len);
                self.liveness.heard(now);
            }
            Err(error) if is_temporary(&error) => return false,
            Err(_) => self.break_off(),
        }
        loop {
            match self.reader.next_frame().map(|frame| frame.map(|frame| frame.kind)) {
                Ok(None) => return resumed,
                Ok(Some(FrameKind::Beat)) => {}
                Ok(Some(FrameKind::Pause)) => self.paused = true,
                Ok(Some(FrameKind::Resume)) => {
                    resumed |= self.paused;
                    self.fresh |= self.paused;
                    self.paused = false;
                }
                Ok(Some(FrameKind::Sync)) if self.keep == Keep::Pull => self.answer_pull(newest),
                Ok(Some(FrameKind::Sync)) => self.answer_sync(),
                Ok(Some(_)) | Err(_) => {
                    let why = format!("`{}` sends what a subscriber does not send", self.to);
                    let peer = self.stream.peer_address().ok().map(|peer| peer.ip());
                    self.faults.log_once(peer, PeerFault::NotASubscriber, why);
                    self.break_off();
                    return false;
                }
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::os::unix::net::UnixStream;

    use armor_wire::frame::{DataHeader, PREFIX_LEN};

    use super::*;

    /// The link of a subscriber that pulls.
    pub fn pull_link(stream: UnixStream) -> OutgoingLink {
        let keep = Keep::Pull;
        OutgoingLink {
            stream: Arc::new(Stream::Unix(stream)),
            to: "sink".into(),
            faults: Arc::default(),
            keep,
            history: 1,
            queue: LinkQueue::new(keep),
            reader: FrameReader::with_limit(0),
            liveness: Liveness::new(Duration::ZERO),
            paused: false,
            fresh: true,
            last_call: 0,
            sent: 0,
            dropped: 0,
            patience: Patience::of(keep),
            last_sequence: None,
            memory_use: MemoryUse::Never,
            memory: None,
            datagrams: None,
            broken: false,
        }
    }

    #[test]
    fn the_first_answer_after_a_pause_is_fresh() {
        let (near, far) = UnixStream::pair().expect("two sockets");
        let (mut link, subscriber) = (pull_link(near), Stream::Unix(far));
        let mut reader = FrameReader::new();
        let mut answer_after = |sequence: u64, signals: &[FrameKind]| {
            let header = DataHeader { sequence, stamp_s: 0.0, instance: 1, fresh: false };
            let newest = (sequence, Arc::new(header.to_bytes(0).to_vec()));
            for signal in signals.iter().chain([&FrameKind::Sync]) {
                let sent = subscriber.try_send(&frame::signal(*signal));
                assert_eq!(sent.expect("it is sent"), PREFIX_LEN);
            }
            link.read_signals(Duration::ZERO, Some(&newest));
            let len = subscriber.try_receive(reader.space()).expect("an answer");
            reader.filled(len);
            let answer = reader.next_frame().expect("a whole frame").expect("that data follow");
            assert_eq!(answer.kind, FrameKind::Synced);
            let data = reader.next_frame().expect("a whole frame").expect("the data");
            data.data().expect("data").0
        };
        let resume = [FrameKind::Pause, FrameKind::Resume];
        let answers = [answer_after(3, &[]), answer_after(5, &[]), answer_after(9, &resume)];
        let answers = answers.map(|header| (header.sequence, header.fresh));
        assert_eq!(answers, [(3, true), (5, false), (9, true)]);
    }
}
