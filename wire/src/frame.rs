//! Frames: eight bytes of prefix, then a body. Written and read without IO.

mod reader;
#[cfg(test)]
mod tests;

pub use reader::{FrameReader, READ_LEN};

use thiserror::Error;

use crate::codec::{self, MAX_CONTROL_LEN, MAX_DATA_LEN, MAX_HELLO_LEN, MAX_PREFACE_LEN};
use crate::message::WireType;

/// Length of the prefix of every frame in bytes.
pub const PREFIX_LEN: usize = 8;
/// Length of what precedes the payload of a data frame: prefix, sequence, stamp, instance.
pub const DATA_HEADER_LEN: usize = PREFIX_LEN + 24;

/// What a frame is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FrameKind {
    /// The first frame of a connection, from the client.
    Hello = 1,
    /// Accepts a hello.
    Welcome = 2,
    /// Refuses a hello, with the reason.
    Refusal = 3,
    /// Data of an output.
    Data = 4,
    /// A sign of life.
    Beat = 5,
    /// From a subscriber: send nothing until `Resume`.
    Pause = 6,
    /// From a subscriber: continue sending.
    Resume = 7,
    /// A request, command or answer of the protocol that the hello named.
    Control = 8,
    /// Before the hello, from a gate: on whose behalf the connection acts.
    Preface = 9,
    /// From a subscriber: which data are the newest? One that pulls is sent them if they are newer
    /// than the last that it was sent.
    Sync = 10,
    /// The answer: nothing newer than what came before it has been published, but for the data
    /// that follow immediately if it announces them ([`FLAG_FOLLOWS`]).
    Synced = 11,
    /// From a publisher, with a file: from here on data come by shared memory.
    MemoryOffer = 12,
    /// From a publisher, with a file: a slot of its shared memory.
    SlotOffer = 13,
    /// From a publisher: a slot that will not be used any more.
    SlotEnd = 14,
    /// From a publisher: data are in shared memory.
    Ready = 15,
    /// From a publisher: data can come in datagrams.
    DatagramOffer = 16,
    /// From a publisher: data come in datagrams from here on, or by the stream again.
    DatagramSwitch = 17,
}

impl FrameKind {
    fn from_byte(byte: u8) -> Option<Self> {
        use FrameKind::{
            Beat, Control, Data, DatagramOffer, DatagramSwitch, Hello, MemoryOffer, Pause, Preface,
            Ready, Refusal, Resume, SlotEnd, SlotOffer, Sync, Synced, Welcome,
        };
        let kinds = [
            Hello,
            Welcome,
            Refusal,
            Data,
            Beat,
            Pause,
            Resume,
            Control,
            Preface,
            Sync,
            Synced,
            MemoryOffer,
            SlotOffer,
            SlotEnd,
            Ready,
            DatagramOffer,
            DatagramSwitch,
        ];
        kinds.into_iter().find(|kind| *kind as u8 == byte)
    }

    /// The longest body such a frame may have, in bytes.
    pub fn max_body_len(self) -> usize {
        match self {
            Self::Hello => MAX_HELLO_LEN,
            Self::Preface => MAX_PREFACE_LEN,
            Self::Welcome | Self::Refusal | Self::Control => MAX_CONTROL_LEN,
            Self::Data => MAX_DATA_LEN + DATA_HEADER_LEN - PREFIX_LEN,
            Self::MemoryOffer | Self::SlotOffer | Self::DatagramOffer => 12,
            Self::DatagramSwitch => 9,
            Self::SlotEnd => 4,
            Self::Beat | Self::Pause | Self::Resume | Self::Sync | Self::Synced | Self::Ready => 0,
        }
    }
}

/// Flag of a data frame: its sequence number jumps on purpose; no data were lost before it.
pub const FLAG_FRESH: u8 = 1;
/// Flag of an answer to [`FrameKind::Sync`]: the next data are the newest.
pub const FLAG_FOLLOWS: u8 = 1;

/// Why bytes are not frames of this protocol. The connection must be closed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FrameError {
    /// The kind does not exist: the peer speaks another protocol.
    #[error("a frame of unknown kind {0}")]
    UnknownKind(u8),
    /// The length exceeds what such a frame may have.
    #[error("a {kind:?} frame of {len} bytes; at most {} are allowed", kind.max_body_len())]
    TooLong {
        /// The frame's kind.
        kind: FrameKind,
        /// Its length as announced, or one more than is allowed if it was never encoded whole.
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
    /// Whether the sequence jumps on purpose before it ([`FLAG_FRESH`]).
    pub fresh: bool,
}

impl DataHeader {
    /// The bytes before a payload of `payload_len` bytes, at most [`MAX_DATA_LEN`].
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

/// Kind, flags and length of the body that follows.
fn read_prefix(bytes: [u8; PREFIX_LEN]) -> Result<(FrameKind, u8, usize), FrameError> {
    let [a, b, c, d, kind, flags, reserved @ ..] = bytes;
    let len = u32::from_le_bytes([a, b, c, d]) as usize;
    let kind = FrameKind::from_byte(kind).ok_or(FrameError::UnknownKind(kind))?;
    if len > kind.max_body_len() {
        return Err(FrameError::TooLong { kind, len });
    }
    let known = match kind {
        FrameKind::Data => FLAG_FRESH,
        FrameKind::Synced => FLAG_FOLLOWS,
        _ => 0,
    };
    if flags & !known != 0 || reserved != [0, 0] {
        return Err(FrameError::Malformed(kind));
    }
    Ok((kind, flags, len))
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

/// The answer to [`FrameKind::Sync`]; whether the newest data follow it.
pub fn synced(follows: bool) -> [u8; PREFIX_LEN] {
    prefix(FrameKind::Synced, if follows { FLAG_FOLLOWS } else { 0 }, 0)
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
        return Err(FrameError::TooLong { kind, len: len.max(kind.max_body_len() + 1) });
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
