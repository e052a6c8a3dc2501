//! The bytes of datagrams.

use super::fragments::FragmentSet;
use super::{DATAGRAM_LEN, MAX_DATAGRAM_MESSAGE};

/// Length of what precedes a fragment.
pub(super) const HEADER_LEN: usize = 48;
/// Length of each fragment of a message but the last.
pub(super) const FRAGMENT_LEN: usize = DATAGRAM_LEN - HEADER_LEN;
/// Most fragments of a message.
pub(super) const MAX_FRAGMENTS: usize = MAX_DATAGRAM_MESSAGE.div_ceil(FRAGMENT_LEN);
/// Length of what a receipt reports of one incomplete message: its sequence and its fragments.
const PART_LEN: usize = 8 + FragmentSet::BYTES;
/// Most incomplete messages in a receipt.
pub(super) const MAX_PARTS: usize = 8;

const FRAGMENT: u8 = 1;
const PROBE: u8 = 2;
const RECEIPT: u8 = 3;
/// The sequence jumps on purpose before this message.
const FRESH: u8 = 1;

/// A datagram from the publisher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DataPacket<'a> {
    pub token: u64,
    /// Counts the datagrams of the link, from 1.
    pub number: u64,
    /// No message before this sequence is sent again.
    pub floor: u64,
    /// A part of a message; none in a probe, which is only to be received.
    pub fragment: Option<Fragment<'a>>,
}

/// A part of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fragment<'a> {
    pub sequence: u64,
    pub stamp_s: f64,
    pub fresh: bool,
    /// Length of the whole payload.
    pub payload_len: usize,
    pub index: usize,
    pub bytes: &'a [u8],
}

/// A datagram from the subscriber.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Receipt {
    pub token: u64,
    /// Counts the receipts of the link, from 1.
    pub number: u64,
    /// How many changes between stream and datagrams it has followed.
    pub switches: u32,
    /// Highest number of a datagram that has arrived; 0 before the first.
    pub heard: u64,
    /// All messages before this sequence have arrived, or are not waited for.
    pub base: u64,
    /// Bit i: message `base + i` has arrived.
    pub arrived: u64,
    /// Messages of which only some fragments have arrived.
    pub parts: Vec<(u64, FragmentSet)>,
}

/// The token with which a datagram begins.
pub fn read_token(packet: &[u8]) -> Option<u64> {
    packet.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}

/// The number of fragments of a payload: one for an empty one, too.
pub(super) fn count_fragments(payload_len: usize) -> usize {
    payload_len.div_ceil(FRAGMENT_LEN).max(1)
}

/// The bytes of fragment `index`.
pub(super) fn cut_fragment(payload: &[u8], index: usize) -> &[u8] {
    let start = (index * FRAGMENT_LEN).min(payload.len());
    &payload[start..payload.len().min(start + FRAGMENT_LEN)]
}

impl<'a> DataPacket<'a> {
    /// Writes it at the beginning of `buffer`; returns its length.
    pub fn write(&self, buffer: &mut [u8; DATAGRAM_LEN]) -> usize {
        let (header, rest) = buffer.split_at_mut(HEADER_LEN);
        header.fill(0);
        header[..8].copy_from_slice(&self.token.to_le_bytes());
        header[8..16].copy_from_slice(&self.number.to_le_bytes());
        header[16] = PROBE;
        header[40..].copy_from_slice(&self.floor.to_le_bytes());
        let Some(fragment) = &self.fragment else { return HEADER_LEN };
        header[16] = FRAGMENT;
        header[17] = if fragment.fresh { FRESH } else { 0 };
        // Both are bounded by the longest message.
        header[18..20].copy_from_slice(&(fragment.index as u16).to_le_bytes());
        header[20..24].copy_from_slice(&(fragment.payload_len as u32).to_le_bytes());
        header[24..32].copy_from_slice(&fragment.sequence.to_le_bytes());
        header[32..40].copy_from_slice(&fragment.stamp_s.to_le_bytes());
        rest[..fragment.bytes.len()].copy_from_slice(fragment.bytes);
        HEADER_LEN + fragment.bytes.len()
    }

    /// Reads a datagram; `None` if it is none of a publisher.
    pub fn read(packet: &'a [u8]) -> Option<Self> {
        let (header, bytes) = packet.split_first_chunk::<HEADER_LEN>()?;
        let (token, number) = (word(header, 0), word(header, 8));
        let floor = word(header, 40);
        let (kind, flags) = (header[16], header[17]);
        if kind == PROBE {
            let is_empty = header[17..40].iter().all(|byte| *byte == 0) && bytes.is_empty();
            return is_empty.then_some(Self { token, number, floor, fragment: None });
        }
        let payload_len = u32::from_le_bytes([header[20], header[21], header[22], header[23]]);
        let payload_len = usize::try_from(payload_len).ok()?;
        let index = usize::from(u16::from_le_bytes([header[18], header[19]]));
        if kind != FRAGMENT
            || flags & !FRESH != 0
            || payload_len > MAX_DATAGRAM_MESSAGE
            || index >= count_fragments(payload_len)
            || bytes.len() != FRAGMENT_LEN.min(payload_len - index * FRAGMENT_LEN)
        {
            return None;
        }
        let (sequence, stamp_s) = (word(header, 24), f64::from_bits(word(header, 32)));
        let fresh = flags & FRESH != 0;
        let fragment = Fragment { sequence, stamp_s, fresh, payload_len, index, bytes };
        Some(Self { token, number, floor, fragment: Some(fragment) })
    }
}

impl Receipt {
    /// Its bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_LEN + self.parts.len() * PART_LEN);
        bytes.extend_from_slice(&self.token.to_le_bytes());
        bytes.extend_from_slice(&self.number.to_le_bytes());
        let count = self.parts.len().min(MAX_PARTS);
        bytes.extend_from_slice(&[RECEIPT, count as u8, 0, 0]);
        bytes.extend_from_slice(&self.switches.to_le_bytes());
        for word in [self.heard, self.base, self.arrived] {
            bytes.extend_from_slice(&word.to_le_bytes());
        }
        for (sequence, fragments) in &self.parts[..count] {
            bytes.extend_from_slice(&sequence.to_le_bytes());
            bytes.extend_from_slice(&fragments.to_bytes());
        }
        bytes
    }

    /// Reads a datagram; `None` if it is none of a subscriber.
    pub fn read(packet: &[u8]) -> Option<Self> {
        let (header, rest) = packet.split_first_chunk::<HEADER_LEN>()?;
        let count = usize::from(header[17]);
        let is_whole = count <= MAX_PARTS && rest.len() == count * PART_LEN;
        if header[16] != RECEIPT || header[18..20] != [0, 0] || !is_whole {
            return None;
        }
        let read_part = |part: &[u8]| {
            let (sequence, fragments) = part.split_first_chunk::<8>()?;
            let fragments = FragmentSet::from_bytes(*fragments.first_chunk()?);
            Some((u64::from_le_bytes(*sequence), fragments))
        };
        Some(Self {
            token: word(header, 0),
            number: word(header, 8),
            switches: u32::from_le_bytes([header[20], header[21], header[22], header[23]]),
            heard: word(header, 24),
            base: word(header, 32),
            arrived: word(header, 40),
            parts: rest.chunks_exact(PART_LEN).map(read_part).collect::<Option<_>>()?,
        })
    }
}

fn word(header: &[u8; HEADER_LEN], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&header[at..at + 8]);
    u64::from_le_bytes(word)
}

// A receipt is a datagram, and every fragment has its bit.
const _: () = assert!(HEADER_LEN + MAX_PARTS * PART_LEN <= DATAGRAM_LEN);
const _: () = assert!(MAX_FRAGMENTS <= FragmentSet::BYTES * 8);
