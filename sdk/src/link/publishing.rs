//! Gives one message to the links of an output: encoded once, small ones from one buffer, latched
//! ones from one shared frame, large ones directly from the message.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use armor_wire::bincode;
use armor_wire::bincode::enc::write::Writer;
use armor_wire::codec::{self, Encodable, EncodeError};
use armor_wire::frame::{DATA_HEADER_LEN, DataHeader, FLAG_FRESH};

use super::kept::KeptFrames;
use super::memory_out::OutputSlots;
use super::stream::FrameFanOut;
use super::wire_out::{FLAGS_AT, OfferResult, OutgoingLink};

/// Messages up to this length are gathered, so that many of them are one system call. A longer one is
/// large: on one host shared memory is faster for it, even where several could be gathered
/// (docs/performance.md); a socket gets it piece by piece, without a copy.
pub(super) const LARGE_LEN: usize = 16 << 10;

/// The circumstances in which a message is published.
pub(crate) struct PublishContext<'a> {
    pub stamp_s: f64,
    pub instance: u64,
    /// The running call of user code; 0 outside of one.
    pub call: u64,
    /// Set when frames were gathered and must be flushed after the call.
    pub gathered: &'a AtomicBool,
    /// Wakes the service thread to look at the links.
    pub wake: &'a dyn Fn(),
    /// Takes the sequence of the message once it is published.
    pub noted: &'a dyn Fn(u64),
}

/// The count, the last value and the links of an output.
#[derive(Default)]
pub(super) struct OutputState {
    pub(super) published: u64,
    pub(super) published_bytes: u64,
    /// Length of the message that is being published, once it has been encoded or measured.
    pub(super) encoded_len: usize,
    pub(super) links: Vec<OutgoingLink>,
    pub(super) buffer: Vec<u8>,
    /// The last values of a latched output, or the last of one from which a subscriber pulls.
    pub(super) kept: KeptFrames,
    /// Every message so far, encoded; `None` unless a test reads them.
    pub(super) record: Option<Vec<Vec<u8>>>,
    /// Dropped on links that are gone.
    pub(super) dropped_before: u64,
    /// The memory that links share with their subscribers.
    pub(super) slots: OutputSlots,
    /// The system has refused memory, which was logged.
    pub(super) has_failed_slot: bool,
}

pub(super) fn offer_shared(link: &mut OutgoingLink, sequence: u64, frame: &Arc<Vec<u8>>) -> bool {
    if !link.sends_frames() || link.last_sequence.is_some_and(|last| last >= sequence) {
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
    link.queue.set_congested();
    link.dropped += link.queue.push_shared(frame, written);
    true
}

pub(super) fn marked_fresh(frame: &[u8]) -> Vec<u8> {
    let mut frame = frame.to_vec();
    frame[FLAGS_AT] |= FLAG_FRESH;
    frame
}

pub(super) fn encode_frame<T: Encodable>(
    message: &T,
    header: DataHeader,
) -> Result<Vec<u8>, EncodeError> {
    let len = codec::encoded_len(message)?;
    let mut frame = Vec::with_capacity(DATA_HEADER_LEN + len);
    frame.extend_from_slice(&header.to_bytes(len));
    codec::encode_into(message, &mut frame)?;
    Ok(frame)
}

impl OutputState {
    pub(super) fn count_dropped(&self) -> u64 {
        self.dropped_before + self.links.iter().map(|link| link.dropped).sum::<u64>()
    }

    pub(super) fn remove_broken(&mut self) {
        let before = &mut self.dropped_before;
        self.links.retain(|link| {
            if link.broken {
                *before += link.dropped;
            }
            !link.broken
        });
    }

    /// Keeps the message for the subscribers that pull, in the memory of the one before if no link
    /// still writes that.
    pub(super) fn store_newest<T: Encodable>(
        &mut self,
        message: &T,
        header: DataHeader,
    ) -> Result<(), EncodeError> {
        let before = self.kept.take_last().and_then(|frame| Arc::try_unwrap(frame).ok());
        let mut frame = before.unwrap_or_default();
        let len = codec::encoded_len(message)?;
        self.encoded_len = len;
        frame.clear();
        frame.extend_from_slice(&header.to_bytes(len));
        codec::encode_into(message, &mut frame)?;
        self.kept.push(header.sequence, Arc::new(frame));
        Ok(())
    }

    pub(super) fn publish_shared(
        &mut self,
        sequence: u64,
        frame: &Arc<Vec<u8>>,
        how: &PublishContext<'_>,
    ) {
        let mut queued = false;
        for link in &mut self.links {
            queued |= offer_shared(link, sequence, frame);
        }
        if queued {
            (how.wake)();
        }
    }

    /// Encodes into the output's buffer and offers that. `false` if the message is large.
    pub(super) fn publish_small<T: Encodable>(
        &mut self,
        message: &T,
        header: DataHeader,
        how: &PublishContext<'_>,
    ) -> Result<bool, EncodeError> {
        self.buffer.clear();
        self.buffer.extend_from_slice(&[0; DATA_HEADER_LEN]);
        let mut writer = SmallMessageWriter { buffer: &mut self.buffer, large: false };
        let result = codec::write(message, &mut writer);
        if writer.large {
            return Ok(false);
        }
        result?;
        let len = self.buffer.len() - DATA_HEADER_LEN;
        self.encoded_len = len;
        self.buffer[..DATA_HEADER_LEN].copy_from_slice(&header.to_bytes(len));
        let (mut gathered, mut queued) = (false, false);
        for link in &mut self.links {
            match link.offer_frame(&mut self.buffer, how.call) {
                OfferResult::Gathered => gathered = true,
                OfferResult::Queued(watch) => queued |= watch,
                OfferResult::Sent | OfferResult::Skipped => {}
            }
        }
        let first = gathered && !how.gathered.load(Ordering::Relaxed);
        if queued || (first && !how.gathered.swap(true, Ordering::Relaxed)) {
            (how.wake)();
        }
        Ok(true)
    }

    /// Writes directly from the message to every free link; the others queue one shared copy.
    pub(super) fn publish_large<T: Encodable>(
        &mut self,
        message: &T,
        header: DataHeader,
        how: &PublishContext<'_>,
    ) -> Result<(), EncodeError> {
        let len = codec::encoded_len(message)?;
        self.encoded_len = len;
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
        for link in self.links.iter_mut().filter(|link| link.sends_frames()) {
            link.sent += 1;
            let gathered = !link.queue.is_empty() && !link.queue.is_congested();
            let is_free =
                (link.queue.is_empty() || (gathered && link.drain_queue())) && !link.fresh;
            if is_free {
                free.push(link);
                continue;
            }
            let fresh = std::mem::take(&mut link.fresh);
            let frame = frame(fresh)?;
            let written = if link.queue.is_empty() { link.write(&frame) } else { 0 };
            if written < frame.len() {
                link.queue.set_congested();
                link.dropped += link.queue.push_shared(frame, written);
                queued = true;
            }
        }
        if !free.is_empty() {
            let mut stream = FrameFanOut::new(free, &header.to_bytes(len));
            codec::write(message, &mut stream)?;
            for (link, tail) in stream.finish_frame() {
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

/// Collects small pieces; fails at the first that makes the message a large one.
struct SmallMessageWriter<'a> {
    buffer: &'a mut Vec<u8>,
    large: bool,
}

impl Writer for SmallMessageWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        if self.buffer.len() + bytes.len() > LARGE_LEN {
            self.large = true;
            return Err(bincode::error::EncodeError::Other("large"));
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }
}
