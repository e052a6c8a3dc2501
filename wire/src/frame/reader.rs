//! Turns a stream of bytes into frames. Small frames share one buffer, so that a single read brings
//! many of them; a large one is read straight into place.

use super::{Frame, FrameError, FrameKind, PREFIX_LEN, read_prefix};

/// Most bytes that a [`FrameReader`] takes from one read.
pub const READ_LEN: usize = 64 << 10;
/// Most bytes of the first read: most connections begin with a short handshake.
const FIRST_READ_LEN: usize = 4 << 10;
/// First size of a large frame's buffer, which doubles as it fills: memory follows the bytes that
/// have arrived, not the length that was announced.
const FIRST_LARGE_LEN: usize = 16 << 10;
/// A large frame's buffer above this is given back after use instead of being kept.
const KEPT_LARGE_LEN: usize = 16 << 20;

/// Turns a stream of bytes into frames.
///
/// Read into [`space`](Self::space), report the number of bytes with [`filled`](Self::filled), then
/// take frames with [`next_frame`](Self::next_frame) until it returns `None`.
pub struct FrameReader {
    small: Vec<u8>,
    start: usize,
    end: usize,
    large: Vec<u8>,
    arriving: Option<Arriving>,
    max_body_len: usize,
}

/// A large frame, prefix included, on its way into `large`.
#[derive(Clone, Copy)]
struct Arriving {
    kind: FrameKind,
    flags: u8,
    total: usize,
    filled: usize,
}

impl Default for FrameReader {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameReader {
    /// Creates a reader that allows each kind its full length.
    pub fn new() -> Self {
        Self::with_limit(usize::MAX)
    }

    /// Creates a reader that also refuses bodies longer than `max_body_len`: for peers that have
    /// not completed a handshake.
    pub fn with_limit(max_body_len: usize) -> Self {
        let (small, large) = (Vec::new(), Vec::new());
        Self { small, start: 0, end: 0, large, arriving: None, max_body_len }
    }

    /// Lifts the limit, once the peer has completed its handshake.
    pub fn lift_limit(&mut self) {
        self.max_body_len = usize::MAX;
    }

    /// Returns the buffer for the next bytes. It is never empty once `next_frame` has returned
    /// `None`.
    pub fn space(&mut self) -> &mut [u8] {
        if let Some(Arriving { total, filled, .. }) = self.arriving {
            if filled == self.large.len() {
                let len = (self.large.len() * 2).max(FIRST_LARGE_LEN).min(total);
                self.large.resize(len, 0);
            }
            let end = self.large.len().min(total);
            return &mut self.large[filled..end];
        }
        // A read that filled the buffer suggests that more bytes are waiting.
        let was_full = self.end == self.small.len();
        if self.start > 0 {
            self.small.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if was_full && self.small.len() < READ_LEN {
            let len = if self.small.is_empty() { FIRST_READ_LEN } else { READ_LEN };
            self.small.resize(len, 0);
        }
        &mut self.small[self.end..]
    }

    /// Records that `len` bytes of the space were filled.
    pub fn filled(&mut self, len: usize) {
        match &mut self.arriving {
            Some(arriving) => arriving.filled += len,
            None => self.end += len,
        }
    }

    /// Whether a frame has begun but not arrived whole, once `next_frame` has returned `None`.
    pub fn is_mid_frame(&self) -> bool {
        self.arriving.is_some() || self.end > self.start
    }

    /// Whether the next frame is followed by a whole data frame: it is then not the newest.
    pub fn is_superseded(&self) -> bool {
        let len_of = |bytes: &[u8]| {
            let len = bytes.first_chunk::<4>()?;
            Some(PREFIX_LEN + u32::from_le_bytes(*len) as usize)
        };
        let have = &self.small[self.start..self.end];
        let next = if self.arriving.is_some() { None } else { len_of(have) };
        let Some(rest) = next.and_then(|len| have.get(len..)) else { return false };
        rest.get(4) == Some(&(FrameKind::Data as u8))
            && len_of(rest).is_some_and(|len| len <= rest.len())
    }

    /// Returns the next whole frame, or `None` if more bytes are needed.
    ///
    /// # Errors
    /// [`FrameError`] if the bytes are not this protocol's; the connection should be closed.
    pub fn next_frame(&mut self) -> Result<Option<Frame<'_>>, FrameError> {
        if let Some(Arriving { kind, flags, total, filled }) = self.arriving {
            if filled < total {
                return Ok(None);
            }
            self.arriving = None;
            return Ok(Some(Frame { kind, flags, body: &self.large[PREFIX_LEN..total] }));
        }
        if self.large.capacity() > KEPT_LARGE_LEN {
            self.large = Vec::new();
        }
        let have = &self.small[self.start..self.end];
        let Some(prefix) = have.first_chunk::<PREFIX_LEN>() else {
            return Ok(None);
        };
        let (kind, flags, len) = read_prefix(*prefix)?;
        if len > self.max_body_len {
            return Err(FrameError::TooLong { kind, len });
        }
        let total = PREFIX_LEN + len;
        if have.len() >= total {
            let body = self.start + PREFIX_LEN..self.start + total;
            self.start += total;
            return Ok(Some(Frame { kind, flags, body: &self.small[body] }));
        }
        if total > READ_LEN {
            self.move_to_large(kind, flags, total);
        }
        Ok(None)
    }

    fn move_to_large(&mut self, kind: FrameKind, flags: u8, total: usize) {
        let have = &self.small[self.start..self.end];
        if self.large.len() < have.len() {
            self.large.resize(FIRST_LARGE_LEN.max(have.len()).min(total), 0);
        }
        self.large[..have.len()].copy_from_slice(have);
        self.arriving = Some(Arriving { kind, flags, total, filled: have.len() });
        (self.start, self.end) = (0, 0);
    }
}
