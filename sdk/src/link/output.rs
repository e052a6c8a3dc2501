//! An output: numbers what is published, encodes it once, and gives it to each link.

use std::any::TypeId;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use armor_wire::bincode;
use armor_wire::bincode::enc::write::Writer;
use armor_wire::codec::{self, EncodeError};
use armor_wire::control::OutputStatus;
use armor_wire::frame::{DATA_HEADER_LEN, DataHeader};
use armor_wire::hello::{LinkRequest, Refusal, RefusalCode};
use armor_wire::keep::Keep;
use armor_wire::message::Message;
use armor_wire::registry::DataEntry;
use armor_wire::schema;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::queue::ALL_LEN;
use super::stream::Stream;
use super::wire_out::{LinkOut, Offered};

/// A message with a piece longer than this is written piece by piece, without a copy.
const DIRECT_LEN: usize = 16 << 10;
/// How long a `keep="all"` sender waits for a subscriber that takes nothing at all.
const ALL_DEADLINE: Duration = Duration::from_secs(10);

/// What became of published data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Links it was given to.
    pub to: usize,
    /// Data, this or older, that links dropped because their subscriber was slow.
    pub dropped: u64,
}

/// What must be known of the caller to publish.
pub(crate) struct Publish<'a> {
    pub stamp_s: f64,
    pub instance: u64,
    /// The running call of user code; 0 outside of one.
    pub call: u64,
    /// Set when frames were gathered and must be flushed after the call.
    pub gathered: &'a AtomicBool,
    /// Tells the service thread to look at the links.
    pub wake: &'a dyn Fn(),
}

/// Why data was not published.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PublishError {
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// An output of this process.
pub(crate) struct Output {
    pub id: String,
    pub entry: DataEntry,
    pub message: TypeId,
    schema_hash: u64,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    published: u64,
    links: Vec<LinkOut>,
    buffer: Vec<u8>,
    /// The last value of a latched output, as a frame.
    last: Option<(u64, Arc<Vec<u8>>)>,
    /// Dropped on links that are gone.
    dropped_before: u64,
}

impl Output {
    pub fn new<T: Message>(id: &str, data: &str, latched: bool) -> Self {
        let schema = T::schema().to_string();
        Self {
            id: id.into(),
            message: TypeId::of::<T>(),
            schema_hash: schema::hash_text(&schema),
            entry: DataEntry { data: data.into(), type_name: T::NAME.into(), schema, latched },
            state: Mutex::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a subscriber's request can be served.
    pub fn accepts(&self, link: &LinkRequest, from: &str) -> Result<(), Refusal> {
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

    /// Adds a link after `welcome` has greeted its subscriber, so that whoever is welcomed misses
    /// nothing from then on. A latched value is sent at once.
    pub fn add<E>(
        &self,
        mut link: LinkOut,
        welcome: impl FnOnce() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut state = self.lock();
        welcome()?;
        if !link.paused {
            state.offer_last(&mut link);
        }
        state.links.push(link);
        Ok(())
    }

    /// Publishes `message`.
    pub fn publish<T: Message>(
        &self,
        message: &T,
        how: &Publish<'_>,
    ) -> Result<Sent, PublishError> {
        let mut state = self.lock();
        let sequence = state.published;
        let header =
            DataHeader { sequence, stamp_s: how.stamp_s, instance: how.instance, fresh: false };
        if state.links.iter().any(|link| link.broken) {
            state.bury();
        }
        let dropped = state.dropped();
        if self.entry.latched {
            let frame = Arc::new(encode_frame(message, header)?);
            state.publish_shared(sequence, &frame, how);
            state.last = Some((sequence, frame));
        } else if !state.links.is_empty() && !state.publish_small(message, header, how)? {
            state.publish_large(message, header, how)?;
        }
        // Only now: a message that is refused leaves no gap.
        state.published += 1;
        let to = state.links.iter().filter(|link| !link.paused && !link.broken).count();
        if state.links.iter().any(over_full) {
            state = self.wait_for_room(state);
        }
        Ok(Sent { to, dropped: state.dropped() - dropped })
    }

    /// Waits, as `keep="all"` asks, until the slow links have room; helps writing meanwhile.
    fn wait_for_room<'a>(&'a self, mut state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        let mut deadline = Instant::now() + ALL_DEADLINE;
        loop {
            let before: usize = state.links.iter().map(|link| link.queue.len()).sum();
            for link in state.links.iter_mut().filter(|link| !link.queue.is_empty()) {
                link.drain();
            }
            let after: usize = state.links.iter().map(|link| link.queue.len()).sum();
            let full: Vec<_> = state
                .links
                .iter()
                .filter(|l| over_full(l))
                .map(|l| Arc::clone(&l.stream))
                .collect();
            if full.is_empty() {
                return state;
            }
            if after < before {
                deadline = Instant::now() + ALL_DEADLINE;
            } else if Instant::now() >= deadline {
                for link in state.links.iter_mut().filter(|link| over_full(link)) {
                    tracing::error!(
                        "`{}` has taken nothing of `{}` for {ALL_DEADLINE:?}; link closed",
                        link.to,
                        self.entry.data
                    );
                    link.break_off();
                }
                return state;
            }
            // Others may publish or close links meanwhile.
            drop(state);
            let mut fds: Vec<_> = full.iter().map(|s| PollFd::new(&**s, PollFlags::OUT)).collect();
            let _ = poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 20_000_000 }));
            state = self.lock();
        }
    }

    /// Writes what was gathered.
    pub fn flush(&self) -> bool {
        let mut state = self.lock();
        let mut all = true;
        for link in state.links.iter_mut().filter(|link| !link.queue.is_empty()) {
            all &= link.drain();
        }
        all
    }

    /// Streams the service thread should watch: the stream, and whether something waits on it.
    pub fn streams(&self, out: &mut Vec<(Arc<std::net::TcpStream>, bool)>) {
        let state = self.lock();
        out.extend(state.links.iter().map(|l| (Arc::clone(&l.stream), !l.queue.is_empty())));
    }

    /// Reads, writes and beats on every link; called by the service thread.
    pub fn serve(&self, now: Duration, beat: &[u8]) {
        let mut state = self.lock();
        let State { links, last, .. } = &mut *state;
        for link in links.iter_mut() {
            let resumed = link.listen(now);
            if resumed && let Some((sequence, frame)) = last {
                offer_shared(link, *sequence, frame);
            }
            if !link.queue.is_empty() {
                link.drain();
            }
            if link.liveness.owes_beat(now) && link.queue.is_empty() && !link.broken {
                let written = link.write(beat);
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
        state.bury();
    }

    /// Ends every link.
    pub fn close(&self) {
        let mut state = self.lock();
        state.links.iter_mut().for_each(LinkOut::break_off);
        state.bury();
    }

    pub fn status(&self) -> OutputStatus {
        let state = self.lock();
        OutputStatus {
            id: self.id.clone(),
            data: self.entry.data.clone(),
            type_name: self.entry.type_name.clone(),
            published: state.published,
            links: state.links.iter().map(LinkOut::status).collect(),
        }
    }
}

fn over_full(link: &LinkOut) -> bool {
    link.keep == Keep::All
        && link.queue.is_congested()
        && link.queue.len() > ALL_LEN
        && !link.broken
}

fn offer_shared(link: &mut LinkOut, sequence: u64, frame: &Arc<Vec<u8>>) -> bool {
    if link.paused || link.broken || link.last_sequence == Some(sequence) {
        return false;
    }
    link.last_sequence = Some(sequence);
    link.sent += 1;
    let fresh = std::mem::take(&mut link.fresh);
    let frame = if fresh { Arc::new(marked_fresh(frame)) } else { Arc::clone(frame) };
    let written = if link.queue.is_empty() { link.write(&frame) } else { 0 };
    if written == frame.len() || link.broken {
        return false;
    }
    link.queue.congest();
    link.dropped += link.queue.push_shared(frame, written);
    true
}

fn marked_fresh(frame: &[u8]) -> Vec<u8> {
    let mut frame = frame.to_vec();
    frame[5] |= armor_wire::frame::FLAG_FRESH;
    frame
}

fn encode_frame<T: Message>(message: &T, header: DataHeader) -> Result<Vec<u8>, EncodeError> {
    let len = codec::encoded_len(message)?;
    let mut frame = Vec::with_capacity(DATA_HEADER_LEN + len);
    frame.extend_from_slice(&header.to_bytes(len));
    codec::encode_into(message, &mut frame)?;
    Ok(frame)
}

impl State {
    fn dropped(&self) -> u64 {
        self.dropped_before + self.links.iter().map(|link| link.dropped).sum::<u64>()
    }

    fn bury(&mut self) {
        let before = &mut self.dropped_before;
        self.links.retain(|link| {
            if link.broken {
                *before += link.dropped;
            }
            !link.broken
        });
    }

    fn offer_last(&mut self, link: &mut LinkOut) {
        if let Some((sequence, frame)) = &self.last {
            offer_shared(link, *sequence, frame);
        }
    }

    fn publish_shared(&mut self, sequence: u64, frame: &Arc<Vec<u8>>, how: &Publish<'_>) {
        let mut queued = false;
        for link in &mut self.links {
            queued |= offer_shared(link, sequence, frame);
        }
        if queued {
            (how.wake)();
        }
    }

    /// Encodes into the output's buffer and offers that. `false` if the message is large.
    fn publish_small<T: Message>(
        &mut self,
        message: &T,
        header: DataHeader,
        how: &Publish<'_>,
    ) -> Result<bool, EncodeError> {
        self.buffer.clear();
        self.buffer.extend_from_slice(&[0; DATA_HEADER_LEN]);
        let mut writer = Small { buffer: &mut self.buffer, large: false };
        let result = codec::write(message, &mut writer);
        if writer.large {
            return Ok(false);
        }
        result?;
        let len = self.buffer.len() - DATA_HEADER_LEN;
        self.buffer[..DATA_HEADER_LEN].copy_from_slice(&header.to_bytes(len));
        let (mut gathered, mut queued) = (false, false);
        for link in &mut self.links {
            match link.offer(&mut self.buffer, how.call) {
                Offered::Gathered => gathered = true,
                Offered::Queued(watch) => queued |= watch,
                Offered::Sent | Offered::Skipped => {}
            }
        }
        let first = gathered && !how.gathered.load(Ordering::Relaxed);
        if queued || (first && !how.gathered.swap(true, Ordering::Relaxed)) {
            (how.wake)();
        }
        Ok(true)
    }

    /// Writes straight from the message to every link that is free; the others queue one shared copy.
    fn publish_large<T: Message>(
        &mut self,
        message: &T,
        header: DataHeader,
        how: &Publish<'_>,
    ) -> Result<(), EncodeError> {
        let len = codec::encoded_len(message)?;
        let mut whole = None;
        let mut frame = |fresh: bool| -> Result<Arc<Vec<u8>>, EncodeError> {
            if fresh {
                return Ok(Arc::new(encode_frame(message, DataHeader { fresh, ..header })?));
            }
            let whole = match &whole {
                Some(whole) => whole,
                None => whole.insert(Arc::new(encode_frame(message, header)?)),
            };
            Ok(Arc::clone(whole))
        };
        let mut free = Vec::new();
        let mut queued = false;
        for link in self.links.iter_mut().filter(|link| !link.paused && !link.broken) {
            link.sent += 1;
            let gathered = !link.queue.is_empty() && !link.queue.is_congested();
            let is_free = (link.queue.is_empty() || (gathered && link.drain())) && !link.fresh;
            if is_free {
                free.push(link);
                continue;
            }
            let fresh = std::mem::take(&mut link.fresh);
            let frame = frame(fresh)?;
            let written = if link.queue.is_empty() { link.write(&frame) } else { 0 };
            if written < frame.len() {
                link.queue.congest();
                link.dropped += link.queue.push_shared(frame, written);
                queued = true;
            }
        }
        if !free.is_empty() {
            let mut stream = Stream::new(free, &header.to_bytes(len));
            codec::write(message, &mut stream)?;
            for (link, tail) in stream.finish() {
                link.queue.push_tail(tail);
                queued = true;
            }
        }
        if queued {
            (how.wake)();
        }
        Ok(())
    }
}

/// Takes small pieces; gives up at a large one.
struct Small<'a> {
    buffer: &'a mut Vec<u8>,
    large: bool,
}

impl Writer for Small<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        if self.buffer.len() + bytes.len() > DIRECT_LEN {
            self.large = true;
            return Err(bincode::error::EncodeError::Other("large"));
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }
}
