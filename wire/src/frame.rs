//! Frames: eight bytes of prefix, then a body. Written and read without IO.
//!
//! [`FrameReader`] keeps small frames in one buffer, so that a single read brings many of them, and
//! lets a large one be read straight into place.

use thiserror::Error;

use crate::codec::{self, MAX_CONTROL_LEN, MAX_DATA_LEN, MAX_HELLO_LEN};
use crate::message::WireType;

/// Length of the prefix of every frame in bytes.
pub const PREFIX_LEN: usize = 8;
/// Length of what precedes the payload of a data frame: prefix, sequence, stamp, instance.
pub const DATA_HEADER_LEN: usize = PREFIX_LEN + 24;
/// How much a [`FrameReader`] reads at once in bytes.
pub const READ_LEN: usize = 64 << 10;

/// What a frame is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FrameKind {
    /// The first frame of a connection, from the one who connected.
    Hello = 1,
    /// The answer to a hello: go on.
    Welcome = 2,
    /// The answer to a hello: no, and why.
    Refusal = 3,
    /// Data of an output.
    Data = 4,
    /// "I am alive."
    Beat = 5,
    /// From a subscriber: send nothing until `Resume`.
    Pause = 6,
    /// From a subscriber: go on sending.
    Resume = 7,
    /// A request, command or answer of the protocol that the hello named.
    Control = 8,
}

impl FrameKind {
    fn from_byte(byte: u8) -> Option<Self> {
        use FrameKind::{Beat, Control, Data, Hello, Pause, Refusal, Resume, Welcome};
        [Hello, Welcome, Refusal, Data, Beat, Pause, Resume, Control]
            .into_iter()
            .find(|kind| *kind as u8 == byte)
    }

    /// The longest body such a frame may have, in bytes.
    pub fn max_body_len(self) -> usize {
        match self {
            Self::Hello => MAX_HELLO_LEN,
            Self::Welcome | Self::Refusal | Self::Control => MAX_CONTROL_LEN,
            Self::Data => MAX_DATA_LEN + DATA_HEADER_LEN - PREFIX_LEN,
            Self::Beat | Self::Pause | Self::Resume => 0,
        }
    }
}

/// Flag of a data frame: the jump of its sequence number is meant, nothing was lost before it.
pub const FLAG_FRESH: u8 = 1;

/// Why bytes are not frames of this protocol. The connection is of no more use.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// The kind is none of ours: it is not our protocol that is spoken.
    #[error("a frame of unknown kind {0}")]
    UnknownKind(u8),
    /// The length exceeds what such a frame may have.
    #[error("a {kind:?} frame of {len} bytes; at most {} are allowed", kind.max_body_len())]
    TooLong {
        /// The frame's kind.
        kind: FrameKind,
        /// Its announced length.
        len: usize,
    },
    /// A data frame too short for its own header, or reserved bits that are set.
    #[error("a malformed {0:?} frame")]
    Malformed(FrameKind),
    /// A frame that has no place at this point of the conversation.
    #[error("a {got:?} frame where {wanted} is expected")]
    Unexpected {
        /// What came.
        got: FrameKind,
        /// What should have come.
        wanted: &'static str,
    },
}

/// One frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// What it is for.
    pub kind: FrameKind,
    /// Its flags.
    pub flags: u8,
    /// Its body.
    pub body: &'a [u8],
}

/// The fixed part of a data frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataHeader {
    /// Counts what the output has published, from 0.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Process start that published it.
    pub instance: u64,
    /// The sequence jump before it is meant ([`FLAG_FRESH`]).
    pub fresh: bool,
}

impl DataHeader {
    /// The bytes before a payload of `payload_len` bytes.
    pub fn to_bytes(self, payload_len: usize) -> [u8; DATA_HEADER_LEN] {
        let mut bytes = [0; DATA_HEADER_LEN];
        let len = payload_len + DATA_HEADER_LEN - PREFIX_LEN;
        let flags = if self.fresh { FLAG_FRESH } else { 0 };
        bytes[..PREFIX_LEN].copy_from_slice(&prefix(FrameKind::Data, flags, len));
        bytes[8..16].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[16..24].copy_from_slice(&self.stamp_s.to_le_bytes());
        bytes[24..32].copy_from_slice(&self.instance.to_le_bytes());
        bytes
    }
}

impl<'a> Frame<'a> {
    /// Takes a data frame apart into header and payload.
    ///
    /// # Errors
    /// [`FrameError`] if it is not a data frame or too short to be one.
    pub fn data(&self) -> Result<(DataHeader, &'a [u8]), FrameError> {
        if self.kind != FrameKind::Data {
            return Err(FrameError::Unexpected { got: self.kind, wanted: "data" });
        }
        let Some((header, payload)) = self.body.split_first_chunk::<24>() else {
            return Err(FrameError::Malformed(self.kind));
        };
        let word = |at: usize| {
            let mut word = [0; 8];
            word.copy_from_slice(&header[at..at + 8]);
            u64::from_le_bytes(word)
        };
        let header = DataHeader {
            sequence: word(0),
            stamp_s: f64::from_bits(word(8)),
            instance: word(16),
            fresh: self.flags & FLAG_FRESH != 0,
        };
        Ok((header, payload))
    }
}

fn prefix(kind: FrameKind, flags: u8, body_len: usize) -> [u8; PREFIX_LEN] {
    // Every body is bounded by `max_body_len`, far below 4 GiB.
    let len = u32::try_from(body_len).unwrap_or(u32::MAX).to_le_bytes();
    [len[0], len[1], len[2], len[3], kind as u8, flags, 0, 0]
}

/// A frame with an empty body.
pub fn signal(kind: FrameKind) -> [u8; PREFIX_LEN] {
    prefix(kind, 0, 0)
}

/// Appends a frame whose body is `value`.
///
/// # Errors
/// If the value is longer than such a frame may be; `bytes` is then as before.
pub fn append<T: WireType>(
    kind: FrameKind,
    value: &T,
    bytes: &mut Vec<u8>,
) -> Result<(), FrameError> {
    let start = bytes.len();
    bytes.extend_from_slice(&[0; PREFIX_LEN]);
    let encoded = codec::encode_into(value, bytes);
    let len = bytes.len() - start - PREFIX_LEN;
    if encoded.is_err() || len > kind.max_body_len() {
        bytes.truncate(start);
        return Err(FrameError::TooLong { kind, len });
    }
    bytes[start..start + PREFIX_LEN].copy_from_slice(&prefix(kind, 0, len));
    Ok(())
}

/// A frame whose body is `value`.
///
/// # Errors
/// As [`append`].
pub fn to_bytes<T: WireType>(kind: FrameKind, value: &T) -> Result<Vec<u8>, FrameError> {
    let mut bytes = Vec::new();
    append(kind, value, &mut bytes)?;
    Ok(bytes)
}

/// Turns a stream of bytes into frames.
///
/// Read into [`space`](Self::space), say how much with [`filled`](Self::filled), then take frames
/// with [`next_frame`](Self::next_frame) until it has none.
pub struct FrameReader {
    small: Vec<u8>,
    start: usize,
    end: usize,
    large: Vec<u8>,
    /// How much of `large` has arrived, while a large frame is being read.
    large_filled: Option<usize>,
    /// The large frame was handed out; its buffer is free again.
    large_taken: bool,
    max_body_len: usize,
}

/// A large frame's buffer above this is given back after use instead of being kept.
const KEPT_LARGE_LEN: usize = 16 << 20;

impl Default for FrameReader {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameReader {
    /// A reader that allows each kind its full length.
    pub fn new() -> Self {
        Self::with_limit(usize::MAX)
    }

    /// A reader that also refuses bodies longer than `max_body_len`: for strangers.
    pub fn with_limit(max_body_len: usize) -> Self {
        Self {
            small: Vec::new(),
            start: 0,
            end: 0,
            large: Vec::new(),
            large_filled: None,
            large_taken: false,
            max_body_len,
        }
    }

    /// Lifts the limit, once the peer has proven who it is.
    pub fn lift_limit(&mut self) {
        self.max_body_len = usize::MAX;
    }

    /// Where the next bytes go. Never empty once `next_frame` has returned `None`.
    pub fn space(&mut self) -> &mut [u8] {
        if let Some(filled) = self.large_filled {
            return &mut self.large[filled..];
        }
        if self.small.is_empty() {
            // The first read of most connections is a short handshake.
            self.small.resize(4 << 10, 0);
        }
        if self.start > 0 {
            self.small.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if self.end == self.small.len() && self.small.len() < READ_LEN {
            self.small.resize(READ_LEN, 0);
        }
        &mut self.small[self.end..]
    }

    /// Says that `len` bytes of the space were filled.
    pub fn filled(&mut self, len: usize) {
        match &mut self.large_filled {
            Some(filled) => *filled += len,
            None => self.end += len,
        }
    }

    /// Whether a frame has begun but not arrived whole.
    pub fn is_mid_frame(&self) -> bool {
        self.large_filled.is_some() || self.end > self.start
    }

    /// The next whole frame, or `None` if more bytes are needed.
    ///
    /// # Errors
    /// [`FrameError`] if the bytes are not this protocol's; the connection should be closed.
    pub fn next_frame(&mut self) -> Result<Option<Frame<'_>>, FrameError> {
        if self.large_taken {
            self.large_taken = false;
            if self.large.capacity() > KEPT_LARGE_LEN {
                self.large = Vec::new();
            }
        }
        if let Some(filled) = self.large_filled {
            if filled < self.large.len() {
                return Ok(None);
            }
            self.large_filled = None;
            self.large_taken = true;
            let (kind, flags, _) = self.parse_prefix(&self.large)?;
            return Ok(Some(Frame { kind, flags, body: &self.large[PREFIX_LEN..] }));
        }
        let have = &self.small[self.start..self.end];
        if have.len() < PREFIX_LEN {
            return Ok(None);
        }
        let (kind, flags, len) = self.parse_prefix(have)?;
        let total = PREFIX_LEN + len;
        if have.len() >= total {
            let body = self.start + PREFIX_LEN..self.start + total;
            self.start += total;
            return Ok(Some(Frame { kind, flags, body: &self.small[body] }));
        }
        if total > READ_LEN {
            // `resize` of a kept buffer touches only what is new.
            let have = self.start..self.end;
            self.large.resize(total, 0);
            self.large[..have.len()].copy_from_slice(&self.small[have.clone()]);
            self.large_filled = Some(have.len());
            (self.start, self.end) = (0, 0);
        }
        Ok(None)
    }

    fn parse_prefix(&self, bytes: &[u8]) -> Result<(FrameKind, u8, usize), FrameError> {
        let len = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize;
        let kind = FrameKind::from_byte(bytes[4]).ok_or(FrameError::UnknownKind(bytes[4]))?;
        if len > kind.max_body_len().min(self.max_body_len) {
            return Err(FrameError::TooLong { kind, len });
        }
        if bytes[6] != 0 || bytes[7] != 0 || bytes[5] & !FLAG_FRESH != 0 {
            return Err(FrameError::Malformed(kind));
        }
        Ok((kind, bytes[5], len))
    }
}
