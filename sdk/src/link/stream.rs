//! Writes a large message to several links without copying it first: bulk arrays go from the
//! message to the sockets, piece by piece, while it is encoded.

use std::io::IoSlice;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::is_temporary;
use armor_wire::bincode;
use armor_wire::bincode::enc::write::Writer;

use super::queue::GATHER_LEN;
use super::wire_out::OutgoingLink;
use super::writability::wait_until_writable;

/// Pieces from this size on are not copied together.
const BULK_LEN: usize = 4 << 10;
/// How long a sender waits for a subscriber to take a piece. A subscriber that takes nothing costs
/// this time once per message; the rest of the frame then waits in its queue.
const PATIENCE: Duration = Duration::from_micros(250);

/// One large frame on its way to several links.
pub(crate) struct FrameFanOut<'a> {
    links: Vec<FanOutLink<'a>>,
    small: Vec<u8>,
}

struct FanOutLink<'a> {
    link: &'a mut OutgoingLink,
    /// How much of the current piece is written.
    written: usize,
    /// The part of the frame that the link has not taken; once it is not empty, all later pieces go
    /// there.
    tail: Vec<u8>,
}

impl<'a> FrameFanOut<'a> {
    /// Begins a frame with `header`.
    pub fn new(links: Vec<&'a mut OutgoingLink>, header: &[u8]) -> Self {
        let begin = |link| FanOutLink { link, written: 0, tail: Vec::new() };
        Self { links: links.into_iter().map(begin).collect(), small: header.to_vec() }
    }

    /// Writes the rest. Returns the links that could not take the whole frame, with what is left.
    pub fn finish_frame(mut self) -> impl Iterator<Item = (&'a mut OutgoingLink, Vec<u8>)> {
        self.write_piece(&[]);
        let behind = |s: &FanOutLink<'_>| !s.tail.is_empty() && !s.link.broken;
        self.links.into_iter().filter(behind).map(|streamed| (streamed.link, streamed.tail))
    }

    /// Gives a piece, the copied-together bytes and then `bulk`, to every link.
    fn write_piece(&mut self, bulk: &[u8]) {
        let small = std::mem::take(&mut self.small);
        let mut last_progress = Instant::now();
        loop {
            let mut progress = false;
            let mut waiting = Vec::new();
            for streamed in self.links.iter_mut().filter(|streamed| streamed.tail.is_empty()) {
                progress |= streamed.write(&small, bulk);
                if streamed.written < small.len() + bulk.len() && !streamed.link.broken {
                    waiting.push(Arc::clone(&streamed.link.stream));
                }
            }
            if waiting.is_empty() {
                break;
            }
            let now = Instant::now();
            if progress {
                last_progress = now;
            } else if now.duration_since(last_progress) >= PATIENCE {
                break;
            }
            wait_until_writable(&waiting, PATIENCE);
        }
        for streamed in &mut self.links {
            streamed.keep_rest(&small, bulk);
        }
        self.small = small;
        self.small.clear();
    }
}

impl FanOutLink<'_> {
    /// Writes as much of the piece as the link takes. Returns whether it took any.
    fn write(&mut self, small: &[u8], bulk: &[u8]) -> bool {
        let before = self.written;
        while self.written < small.len() + bulk.len() && !self.link.broken {
            let len = match self.written.checked_sub(small.len()) {
                Some(from) => self.link.write(&bulk[from..]),
                None => self.write_vectored(&small[self.written..], bulk),
            };
            if len == 0 {
                break;
            }
            self.written += len;
        }
        self.written > before
    }

    fn write_vectored(&mut self, small: &[u8], bulk: &[u8]) -> usize {
        let pieces = [IoSlice::new(small), IoSlice::new(bulk)];
        match self.link.stream.try_send_vectored(&pieces) {
            Ok(len) => len,
            Err(error) if is_temporary(&error) => 0,
            Err(_) => {
                self.link.break_off();
                0
            }
        }
    }

    /// Ends the piece: the part that the link has not taken goes to its tail.
    fn keep_rest(&mut self, small: &[u8], bulk: &[u8]) {
        let from = std::mem::take(&mut self.written);
        if from < small.len() + bulk.len() {
            self.tail.extend_from_slice(&small[from.min(small.len())..]);
            self.tail.extend_from_slice(&bulk[from.saturating_sub(small.len())..]);
        }
    }
}

impl Writer for FrameFanOut<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        if bytes.len() < BULK_LEN {
            self.small.extend_from_slice(bytes);
            if self.small.len() >= GATHER_LEN {
                self.write_piece(&[]);
            }
        } else {
            self.write_piece(bytes);
        }
        Ok(())
    }
}
