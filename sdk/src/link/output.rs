//! An output: numbers what is published, encodes it once, and gives it to each link.

use std::any::TypeId;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_wire::codec::{self, Encodable, EncodeError, EncodedPieces, MAX_DATA_LEN};
use armor_wire::control::OutputStatus;
use armor_wire::frame::{DATA_HEADER_LEN, DataHeader};
use armor_wire::hello::{LinkRequest, Refusal, RefusalCode};
use armor_wire::message::Message;
use armor_wire::registry::DataEntry;
use armor_wire::schema::{self, ANY_SCHEMA};
use armor_wire::shared_memory::MemoryUse;
use parking_lot::{Mutex, MutexGuard};

use super::publishing::{LARGE_LEN, OutputState, PublishContext, encode_frame, offer_shared};
use super::queue::ALL_LEN;
use super::wire_out::OutgoingLink;
use super::writability::wait_until_writable;
use crate::message_type::MessageType;
use crate::tap::TOOL_PREFIX;

/// Most links of one output, and most of them to tools: each of them costs every message a system
/// call. The links that a file asks for are far fewer, and tools cannot take their places.
const MAX_LINKS: usize = 512;
const MAX_TOOLS: usize = 64;

/// A sender that waits for a subscriber looks again after this: the socket wakes it earlier, a ring
/// does not.
const QUEUE_WAIT: Duration = Duration::from_millis(20);
const RING_WAIT: Duration = Duration::from_micros(50);
/// A subscriber that keeps up empties its ring within a few calls. Within this time the sender only gives
/// way to others: a sleep would take longer.
const RING_YIELD: Duration = Duration::from_micros(100);

/// The result of publishing data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Links it was given to.
    pub to: usize,
    /// Data, this or older, that links dropped because their subscriber was slow.
    pub dropped: u64,
}

/// An output of this process.
pub(crate) struct OutputPort {
    pub id: String,
    pub entry: DataEntry,
    pub message: TypeId,
    schema_hash: u64,
    /// No message of its type is too large, so none is measured.
    is_bounded: bool,
    /// Messages of its type may be so large that shared memory is worth it.
    may_be_large: bool,
    state: Mutex<OutputState>,
}

impl OutputPort {
    pub fn new<T: Message>(id: &str, data: &str, latched: bool) -> Self {
        let schema = T::schema();
        let (data, type_name) = (data.into(), T::NAME.into());
        let entry = DataEntry { data, type_name, schema: schema.to_string(), latched };
        Self::of_entry(id, TypeId::of::<T>(), entry, schema.max_len())
    }

    /// An output whose messages are given encoded, by their schema.
    pub fn of_schema(id: &str, data: &str, message_type: &MessageType, latched: bool) -> Self {
        let entry = DataEntry {
            data: data.into(),
            type_name: message_type.name.clone(),
            schema: message_type.schema.clone(),
            latched,
        };
        let most_len = schema::parse(&entry.schema).ok().and_then(|schema| schema.max_len());
        Self::of_entry(id, TypeId::of::<EncodedPieces<'static>>(), entry, most_len)
    }

    fn of_entry(id: &str, message: TypeId, entry: DataEntry, most_len: Option<usize>) -> Self {
        Self {
            id: id.into(),
            message,
            schema_hash: schema::hash_text(&entry.schema),
            is_bounded: most_len.is_some_and(|len| len <= MAX_DATA_LEN),
            may_be_large: most_len.is_none_or(|len| len > LARGE_LEN),
            entry,
            state: Mutex::default(),
        }
    }

    /// Whether it was declared without a type, and has none yet: it has no links and publishes nothing.
    pub fn lacks_type(&self) -> bool {
        self.entry.schema == ANY_SCHEMA
    }

    /// The same output with the type of what it passes on.
    pub fn with_type(&self, message_type: &MessageType) -> Self {
        let entry = DataEntry {
            type_name: message_type.name.clone(),
            schema: message_type.schema.clone(),
            ..self.entry.clone()
        };
        let most_len = schema::parse(&entry.schema).ok().and_then(|schema| schema.max_len());
        let typed = Self::of_entry(&self.id, self.message, entry, most_len);
        typed.lock_state().record = self.lock_state().record.take();
        typed
    }

    fn lock_state(&self) -> MutexGuard<'_, OutputState> {
        self.state.lock()
    }

    /// Hash of the schema that it was declared with.
    pub fn schema_hash(&self) -> u64 {
        self.schema_hash
    }

    /// Records every message from now on.
    pub fn start_recording(&self) {
        self.lock_state().record.get_or_insert_default();
    }

    /// The messages that were published since the recording began, encoded.
    pub fn recorded(&self) -> Vec<Vec<u8>> {
        self.lock_state().record.clone().unwrap_or_default()
    }

    /// Whether a subscriber's request can be served.
    pub fn check_request(&self, link: &LinkRequest, from: &str) -> Result<(), Refusal> {
        self.check_places(from)?;
        if link.schema_hash == 0 || link.schema_hash == self.schema_hash {
            return Ok(());
        }
        let (ours, theirs) = (self.entry.data.as_str(), format!("`{from}`"));
        let how = schema::difference((ours, &self.entry.schema), (&theirs, &link.schema));
        let text = format!(
            "`{ours}` is a {}, which is not what {theirs} expects\n{how}",
            self.entry.type_name
        );
        Err(Refusal::new(RefusalCode::TypeMismatch, text))
    }

    fn check_places(&self, from: &str) -> Result<(), Refusal> {
        let is_tool = |name: &str| name.starts_with(TOOL_PREFIX);
        let mut state = self.lock_state();
        state.remove_broken();
        let tools = state.links.iter().filter(|link| is_tool(&link.to)).count();
        let (what, taken, places) = if is_tool(from) {
            ("tools", tools, MAX_TOOLS)
        } else {
            ("components", state.links.len() - tools, MAX_LINKS - MAX_TOOLS)
        };
        drop(state);
        if taken < places {
            return Ok(());
        }
        let data = &self.entry.data;
        let text = format!("`{data}` is already linked to {taken} {what}, the most it serves");
        Err(Refusal::new(RefusalCode::Limit, text))
    }

    /// Adds a link after `welcome` has been sent on it, both under the lock: a welcomed subscriber
    /// misses nothing that is published afterwards. A latched value is sent immediately.
    pub fn add_link<E>(
        &self,
        mut link: OutgoingLink,
        welcome: impl FnOnce() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut state = self.lock_state();
        welcome()?;
        link.offer_datagrams();
        if self.entry.latched {
            if !link.to.starts_with(TOOL_PREFIX) {
                state.kept.ask_for(link.history);
            }
            state.links.push(link);
            let newest = state.links.len() - 1;
            state.offer_kept(newest);
        } else {
            state.links.push(link);
        }
        Ok(())
    }

    /// Publishes `message`.
    pub fn publish<T: Encodable>(
        &self,
        message: &T,
        how: &PublishContext<'_>,
    ) -> Result<Sent, EncodeError> {
        let mut state = self.lock_state();
        if state.links.iter().any(OutgoingLink::is_ring_full) {
            state = self.wait_for_room(state);
        }
        let sequence = state.published;
        let header =
            DataHeader { sequence, stamp_s: how.stamp_s, instance: how.instance, fresh: false };
        if state.links.iter().any(|link| link.broken) {
            state.remove_broken();
        }
        let dropped = state.count_dropped();
        // Of a message that could not be sent.
        state.encoded_len = 0;
        if self.entry.latched {
            let frame = Arc::new(encode_frame(message, header)?);
            state.encoded_len = frame.len() - DATA_HEADER_LEN;
            // Before the others: what they cannot carry takes the stream.
            if state.may_use_datagrams() && state.send_frame_in_datagrams(&frame) {
                (how.wake)();
            }
            state.publish_shared(sequence, &frame, how);
            if state.wants_memory(self.may_be_large) {
                state.share_frame(&frame, None);
            }
            state.kept.push(sequence, frame);
        } else {
            if state.may_use_datagrams() && state.publish_in_datagrams(message, header)? {
                (how.wake)();
            }
            if state.wants_memory(self.may_be_large) {
                state.publish_in_memory(message, &header)?;
            }
            if state.links.iter().any(OutgoingLink::is_answered) {
                state.store_newest(message, header)?;
            } else {
                state.kept.clear();
            }
            if state.links.iter().any(OutgoingLink::sends_frames)
                && !state.publish_small(message, header, how)?
            {
                state.publish_large(message, header, how)?;
            }
            if state.links.is_empty() && !self.is_bounded {
                // Whether it can be sent must not depend on who subscribes.
                codec::encoded_len(message)?;
            }
        }
        if let Some(record) = &mut state.record {
            record.push(codec::encode(message)?);
        }
        // Counted only now: a message that cannot be encoded leaves no gap in the sequence.
        state.published += 1;
        (how.noted)(sequence);
        state.published_bytes += std::mem::take(&mut state.encoded_len) as u64;
        let to = state.links.iter().filter(|link| link.is_pushed()).count();
        if state.links.iter().any(is_over_full) {
            state = self.wait_for_room(state);
        }
        Ok(Sent { to, dropped: state.count_dropped() - dropped })
    }

    /// Whether the publication of a small message might wait: a subscriber with `keep="all"` has not taken
    /// what was sent before, or its memory is full.
    pub fn may_wait(&self) -> bool {
        let waits = |link: &OutgoingLink| {
            (link.keep.is_all() && link.queue.is_congested()) || link.is_ring_full()
        };
        self.lock_state().links.iter().any(waits)
    }

    /// Waits until the slow `keep="all"` links have room, and writes to them meanwhile.
    fn wait_for_room<'a>(
        &'a self,
        mut state: MutexGuard<'a, OutputState>,
    ) -> MutexGuard<'a, OutputState> {
        let start = Instant::now();
        loop {
            for link in state.links.iter_mut().filter(|link| !link.queue.is_empty()) {
                link.drain_queue();
            }
            let now = Instant::now();
            for link in state.links.iter_mut().filter(|link| is_over_full(link)) {
                let Some(limit) = link.patience.end_at(now) else { continue };
                tracing::error!(
                    "`{}` has taken nothing of `{}` for {limit:?}; link closed",
                    link.to,
                    self.entry.data
                );
                link.break_off();
            }
            let full: Vec<_> = state
                .links
                .iter()
                .filter(|l| is_over_full(l) && l.memory.is_none())
                .map(|l| Arc::clone(&l.stream))
                .collect();
            let is_ring_full = state.links.iter().any(OutgoingLink::is_ring_full);
            if full.is_empty() && !is_ring_full {
                return state;
            }
            // Without the lock, so that other threads can publish or close links meanwhile.
            drop(state);
            if full.is_empty() && now - start < RING_YIELD {
                std::thread::yield_now();
                state = self.lock_state();
                continue;
            }
            wait_until_writable(&full, if is_ring_full { RING_WAIT } else { QUEUE_WAIT });
            state = self.lock_state();
        }
    }

    /// Writes what waits on the links. Returns whether all of it is written.
    pub fn flush_links(&self) -> bool {
        let mut state = self.lock_state();
        let mut all = true;
        for link in state.links.iter_mut().filter(|link| !link.queue.is_empty()) {
            all &= link.drain_queue();
        }
        all
    }

    /// Streams the service thread should watch: the stream, and whether something waits on it.
    pub fn list_streams(&self, out: &mut Vec<(Arc<armor_socket::Stream>, bool)>) {
        let state = self.lock_state();
        out.extend(state.links.iter().map(|l| (Arc::clone(&l.stream), !l.queue.is_empty())));
    }

    /// Reads, writes and beats on every link; called by the service thread.
    pub fn serve_links(&self, now: Duration, beat: &[u8]) {
        let mut state = self.lock_state();
        for at in 0..state.links.len() {
            let OutputState { links, kept, .. } = &mut *state;
            let has_resumed = links[at].read_signals(now, kept.last());
            // A subscriber that was paused has missed the latched value if it changed meanwhile.
            if has_resumed && self.entry.latched {
                state.offer_kept(at);
            }
            let link = &mut state.links[at];
            if !link.queue.is_empty() {
                link.drain_queue();
            }
            if link.liveness.owes_beat(now) && link.queue.is_empty() && !link.broken {
                let written = link.write(beat);
                // The rest of a partly written beat must follow before any other frame. A beat of
                // which nothing is written is left out: the bytes that fill the socket show life.
                if written > 0 && written < beat.len() {
                    link.queue.push_shared(Arc::new(beat.to_vec()), written);
                }
                link.liveness.spoke(now);
            }
            if link.liveness.is_silent(now) && !link.broken {
                tracing::warn!(
                    "`{}` has fallen silent; its link to `{}` is closed",
                    link.to,
                    self.entry.data
                );
                link.break_off();
            }
        }
        state.remove_broken();
        state.clear_paused_rings();
    }

    /// Takes a datagram of a subscriber. Returns whether it is one of this output's.
    pub fn receive_receipt(&self, token: u64, packet: &[u8], from: SocketAddr) -> bool {
        self.lock_state().receive_receipt(token, packet, from)
    }

    /// Sends again the datagrams that are due. Returns the time until it must be called again; `None`
    /// if nothing waits.
    pub fn look_after_datagrams(&self) -> Option<Duration> {
        self.lock_state().look_after_datagrams()
    }

    /// Gives memory that is not used back to the system; called by the service thread every
    /// [`LOOK`](armor_wire::liveness::LOOK).
    pub fn release_idle_memory(&self) {
        self.lock_state().release_idle_slots();
    }

    /// Ends every link.
    pub fn close_links(&self) {
        let mut state = self.lock_state();
        state.links.iter_mut().for_each(OutgoingLink::break_off);
        state.remove_broken();
    }

    /// Whether any subscriber is linked.
    pub fn has_links(&self) -> bool {
        self.lock_state().links.iter().any(|link| !link.broken)
    }

    pub fn status(&self) -> OutputStatus {
        let state = self.lock_state();
        OutputStatus {
            id: self.id.clone(),
            data: self.entry.data.clone(),
            type_name: self.entry.type_name.clone(),
            published: state.published,
            published_bytes: state.published_bytes,
            links: state.links.iter().map(OutgoingLink::status).collect(),
        }
    }
}

impl OutputState {
    /// Sends the last values of a latched output that the link has not carried yet.
    fn offer_kept(&mut self, at: usize) {
        let history = self.links[at].history;
        let kept: Vec<_> = self.kept.newest(history).cloned().collect();
        for (sequence, frame) in kept {
            // What is too long for datagrams takes the stream.
            if self.links[at].is_in_datagrams() {
                self.send_frame_in_datagrams(&frame);
            }
            offer_shared(&mut self.links[at], sequence, &frame);
            if self.links[at].memory_use != MemoryUse::Never {
                self.share_frame(&frame, Some(at));
            }
        }
    }
}

fn is_over_full(link: &OutgoingLink) -> bool {
    let is_queue_full = link.queue.is_congested() && link.queue.len() > ALL_LEN && !link.broken;
    (link.keep.is_all() && is_queue_full) || link.is_ring_full()
}
