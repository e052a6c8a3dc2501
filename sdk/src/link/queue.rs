//! The frames that wait to be written to one link: gathered small frames, or frames that a slow
//! subscriber has not taken yet. Pure: the socket is a function that takes bytes.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;

use armor_wire::frame::PREFIX_LEN;
use armor_wire::keep::Keep;

/// Gathered frames are written when they reach this length: one socket write of it costs little
/// more than one of a single small frame.
pub(crate) const GATHER_LEN: usize = 60 << 10;
/// A `keep="all"` sender waits while a queue is longer than this.
pub(crate) const ALL_LEN: usize = 256 << 10;

/// A buffer longer than this is given back instead of being kept for the next gathering.
const KEPT_LEN: usize = 2 * GATHER_LEN;

enum Chunk {
    /// A frame that several links share.
    Shared(Arc<Vec<u8>>),
    /// Small frames, this link's own.
    Own(Vec<u8>),
}

impl Chunk {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Shared(bytes) => bytes,
            Self::Own(bytes) => bytes,
        }
    }
}

/// The frames that wait on one link, each chunk with their number: 0 for an answer to the subscriber.
pub(crate) struct LinkQueue {
    keep: Keep,
    chunks: VecDeque<(Chunk, u32)>,
    /// How much of the first chunk is written.
    written: usize,
    /// The first chunk is the rest of a frame that is partly written.
    starts_with_tail: bool,
    bytes: usize,
    /// The socket has refused bytes; until it has taken all, frames wait and the policy applies.
    congested: bool,
    spare: Vec<u8>,
}

impl LinkQueue {
    pub fn new(keep: Keep) -> Self {
        Self {
            keep,
            chunks: VecDeque::new(),
            written: 0,
            starts_with_tail: false,
            bytes: 0,
            congested: false,
            spare: Vec::new(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.chunks.is_empty()
    }

    /// Whether the subscriber is slow, as opposed to frames being gathered.
    pub fn is_congested(&self) -> bool {
        self.congested
    }

    /// Bytes that wait.
    pub fn len(&self) -> usize {
        self.bytes
    }

    /// Frames that wait.
    pub fn count_frames(&self) -> usize {
        self.chunks.iter().map(|(_, frames)| *frames as usize).sum()
    }

    /// Adds a copy of a small frame. Returns how many frames were dropped for it.
    pub fn push(&mut self, frame: &[u8]) -> u64 {
        self.bytes += frame.len();
        // On a congested link each frame is a chunk of its own, so that it can be dropped alone.
        let single = self.congested && !self.keep.is_all();
        if let Some((Chunk::Own(last), frames)) = self.chunks.back_mut()
            && !single
            // The last frame may exceed the limit, but not so far that the buffer is too long to be
            // kept.
            && last.len() + frame.len() <= GATHER_LEN + frame.len().min(GATHER_LEN)
            && last.len() < GATHER_LEN
        {
            last.extend_from_slice(frame);
            *frames += 1;
            return 0;
        }
        let mut own = std::mem::take(&mut self.spare);
        own.clear();
        own.extend_from_slice(frame);
        self.chunks.push_back((Chunk::Own(own), 1));
        self.drop_oldest()
    }

    /// Adds a frame that other links share, of which `written` bytes are already out (the queue
    /// must then be empty). Returns how many frames were dropped for it.
    pub fn push_shared(&mut self, frame: Arc<Vec<u8>>, written: usize) -> u64 {
        self.bytes += frame.len() - written;
        if self.chunks.is_empty() {
            self.written = written;
        }
        self.congested |= written > 0;
        self.chunks.push_back((Chunk::Shared(frame), 1));
        self.drop_oldest()
    }

    /// Adds the rest of a frame whose beginning is written already. The queue must be empty.
    pub fn push_tail(&mut self, tail: Vec<u8>) {
        self.bytes += tail.len();
        self.congested = true;
        self.starts_with_tail = true;
        self.chunks.push_back((Chunk::Own(tail), 1));
    }

    /// The socket has refused bytes of a frame that is about to be pushed.
    pub fn set_congested(&mut self) {
        self.congested = true;
    }

    /// Drops the oldest frames beyond what the policy keeps; never one that is partly written.
    fn drop_oldest(&mut self) -> u64 {
        let most = match self.keep {
            Keep::All { .. } => return 0,
            Keep::Latest | Keep::Pull => 1,
            Keep::Last { count } => count as usize,
        };
        if !self.congested {
            return 0;
        }
        let first = self.count_kept_chunks();
        let mut dropped = 0;
        while self.chunks.len() > first + most {
            if let Some((chunk, frames)) = self.chunks.remove(first) {
                self.bytes -= chunk.bytes().len();
                dropped += u64::from(frames);
            }
        }
        dropped
    }

    /// Puts an answer behind the frame that is partly written, before those that wait: `make` gets
    /// whether there are any.
    pub fn insert_answer<B: Into<Vec<u8>>>(&mut self, make: impl FnOnce(bool) -> B) {
        let first = self.count_kept_chunks();
        let answer = make(self.chunks.len() > first).into();
        self.bytes += answer.len();
        self.chunks.insert(first, (Chunk::Own(answer), 0));
    }

    /// The first chunks, which no policy drops: what is partly written, and answers behind it.
    fn count_kept_chunks(&self) -> usize {
        let begun = usize::from(self.written > 0 || self.starts_with_tail);
        begun + self.chunks.iter().skip(begun).take_while(|(_, frames)| *frames == 0).count()
    }

    /// Gives bytes to `write` until all are written or it would block. Returns how many frames were
    /// dropped because it blocked, or `write`'s error.
    pub fn drain(&mut self, mut write: impl FnMut(&[u8]) -> io::Result<usize>) -> io::Result<u64> {
        while let Some((chunk, _)) = self.chunks.front() {
            let bytes = chunk.bytes();
            match write(&bytes[self.written..]) {
                Ok(len) => {
                    self.written += len;
                    self.bytes -= len;
                    if self.written == bytes.len() {
                        self.written = 0;
                        self.starts_with_tail = false;
                        if let Some((Chunk::Own(own), _)) = self.chunks.pop_front()
                            && own.capacity() <= KEPT_LEN
                        {
                            self.spare = own;
                        }
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    self.congested = true;
                    self.split_chunks();
                    return Ok(self.drop_oldest());
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.congested = false;
        Ok(0)
    }

    /// Makes every chunk a single frame, so that single frames can be dropped.
    fn split_chunks(&mut self) {
        if self.keep.is_all() || self.chunks.iter().all(|(_, frames)| *frames <= 1) {
            return;
        }
        // Frames that are written completely are left out. `partial` bytes are written of the first
        // remaining frame: `drain` must continue inside it.
        let (mut written, mut partial) = (self.written, 0);
        let mut chunks = VecDeque::new();
        for (chunk, frames) in self.chunks.drain(..) {
            if frames <= 1 {
                if std::mem::take(&mut written) > 0 {
                    partial = self.written;
                }
                chunks.push_back((chunk, frames));
                continue;
            }
            let mut rest = chunk.bytes();
            while let Some(len) = frame_len(rest).filter(|len| *len <= rest.len()) {
                let (frame, after) = rest.split_at(len);
                if written >= len {
                    written -= len;
                } else {
                    if written > 0 {
                        partial = std::mem::take(&mut written);
                    }
                    chunks.push_back((Chunk::Own(frame.to_vec()), 1));
                }
                rest = after;
            }
        }
        (self.chunks, self.written) = (chunks, partial);
    }
}

fn frame_len(bytes: &[u8]) -> Option<usize> {
    let len = bytes.first_chunk::<4>()?;
    Some(PREFIX_LEN + u32::from_le_bytes(*len) as usize)
}

#[cfg(test)]
mod tests {
    use armor_wire::frame::{
        self, DATA_HEADER_LEN, DataHeader, FLAG_FOLLOWS, FrameKind, FrameReader,
    };
    use proptest::prelude::*;

    use super::*;

    fn frame(sequence: u64, len: usize) -> Vec<u8> {
        let header = DataHeader { sequence, stamp_s: 0.0, instance: 1, fresh: false };
        let mut frame = header.to_bytes(len).to_vec();
        frame.resize(DATA_HEADER_LEN + len, sequence as u8);
        frame
    }

    #[derive(Clone, Debug)]
    enum Step {
        /// A small frame of so many bytes.
        Push(usize),
        /// A frame shared between links.
        Shared(usize),
        /// The socket takes so many bytes, then blocks.
        Drain(usize),
        /// The subscriber asks for the newest.
        Ask,
    }

    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let step = prop_oneof![
            4 => (0usize..300).prop_map(Step::Push),
            1 => (0usize..5000).prop_map(Step::Shared),
            2 => (0usize..3000).prop_map(Step::Drain),
            1 => Just(Step::Ask),
        ];
        proptest::collection::vec(step, 1..80)
    }

    fn check(keep: Keep, steps: &[Step]) {
        let mut queue = LinkQueue::new(keep);
        let (mut out, mut next, mut dropped) = (Vec::new(), 0u64, 0u64);
        // What was the newest at each question.
        let mut asked = Vec::new();
        let mut drain = |queue: &mut LinkQueue, mut room: usize| {
            let taken = |bytes: &[u8]| {
                let len = bytes.len().min(room);
                room -= len;
                out.extend_from_slice(&bytes[..len]);
                if len == 0 { Err(io::ErrorKind::WouldBlock.into()) } else { Ok(len) }
            };
            queue.drain(taken).expect("the socket only blocks")
        };
        for step in steps {
            match step {
                Step::Push(len) => {
                    dropped += queue.push(&frame(next, *len));
                    next += 1;
                }
                Step::Shared(len) => {
                    dropped += queue.push_shared(Arc::new(frame(next, *len)), 0);
                    next += 1;
                }
                Step::Drain(room) => dropped += drain(&mut queue, *room),
                Step::Ask => {
                    dropped += drain(&mut queue, 0);
                    if queue.is_empty() {
                        queue.push_tail(frame::synced(false).to_vec());
                    } else {
                        queue.insert_answer(frame::synced);
                    }
                    asked.push(next.checked_sub(1));
                }
            }
        }
        dropped += drain(&mut queue, usize::MAX);
        assert_eq!((queue.is_empty(), queue.len(), queue.count_frames()), (true, 0, 0));
        let found = read_frames(&out);
        let data =
            |found: &Found| if let Found::Data(sequence) = found { Some(*sequence) } else { None };
        let sequences: Vec<u64> = found.iter().filter_map(data).collect();
        if keep == Keep::Latest {
            let answers = found.iter().enumerate().filter_map(|(at, found)| match found {
                Found::Answer { follows } => Some((at, *follows)),
                Found::Data(_) => None,
            });
            let answers: Vec<_> = answers.collect();
            assert_eq!(answers.len(), asked.len());
            for ((at, follows), newest) in answers.into_iter().zip(asked) {
                let given = match follows {
                    true => found[at..].iter().find_map(data),
                    false => found[..at].iter().rev().find_map(data),
                };
                assert!(given >= newest, "{given:?} is older than {newest:?}");
            }
        }
        assert!(sequences.is_sorted_by(|a, b| a < b), "in order, each once: {sequences:?}");
        assert_eq!(sequences.len() as u64 + dropped, next, "what is not out is counted");
        assert!(next == 0 || sequences.last() == Some(&(next - 1)), "the newest always arrives");
        if keep.is_all() {
            assert_eq!(dropped, 0);
        }
    }

    enum Found {
        Data(u64),
        Answer { follows: bool },
    }

    fn read_frames(mut bytes: &[u8]) -> Vec<Found> {
        let (mut reader, mut found) = (FrameReader::new(), Vec::new());
        loop {
            while let Some(frame) = reader.next_frame().expect("whole frames") {
                found.push(match frame.kind {
                    FrameKind::Synced => Found::Answer { follows: frame.flags == FLAG_FOLLOWS },
                    _ => Found::Data(frame.data().expect("data").0.sequence),
                });
            }
            if bytes.is_empty() {
                return found;
            }
            let space = reader.space();
            let len = space.len().min(bytes.len());
            space[..len].copy_from_slice(&bytes[..len]);
            reader.filled(len);
            bytes = &bytes[len..];
        }
    }

    proptest! {
        #[test]
        fn whatever_the_socket_takes_frames_stay_whole_and_every_drop_is_counted(steps in steps()) {
            for keep in [Keep::ALL, Keep::Latest, Keep::Last { count: 3 }] {
                check(keep, &steps);
            }
        }
    }

    #[test]
    fn a_slow_subscriber_keeps_the_newest() {
        let mut queue = LinkQueue::new(Keep::Last { count: 2 });
        queue.set_congested();
        let dropped: u64 = (0..10).map(|sequence| queue.push(&frame(sequence, 10))).sum();
        assert_eq!((dropped, queue.count_frames()), (8, 2));
    }

    #[test]
    fn gathering_drops_nothing() {
        let mut queue = LinkQueue::new(Keep::Latest);
        let dropped: u64 = (0..100).map(|sequence| queue.push(&frame(sequence, 10))).sum();
        assert_eq!((dropped, queue.count_frames()), (0, 100), "no subscriber is slow yet");
    }
}
