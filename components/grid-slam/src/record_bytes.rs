//! The bytes of a record of the mapper's state: `length: u32, kind: u8, payload, CRC-32C of kind and
//! payload: u32`, little endian. What the payload means: `state.rs`. Pure.

use crate::pose::Pose;
use crc::{CRC_32_ISCSI, Crc};

const SUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
/// Most bytes of a record: a scan of 250,000 beams.
const MAX_RECORD: usize = 1 << 20;
/// Coordinates beyond it are no place on a map, metres.
const MAX_M: f64 = 1e5;

/// A record as it was found.
pub(crate) struct RawRecord<'a> {
    pub kind: u8,
    pub payload: &'a [u8],
    /// Bytes of all of it.
    pub len: usize,
}

/// Adds a record to the end.
pub(crate) fn append_record(bytes: &mut Vec<u8>, kind: u8, Payload(payload): &Payload) {
    let begin = bytes.len() + 4;
    bytes.extend((payload.len() as u32).to_le_bytes());
    bytes.push(kind);
    bytes.extend(payload);
    bytes.extend(SUM.checksum(&bytes[begin..]).to_le_bytes());
}

/// The record at the begin of the bytes, if it is whole.
pub(crate) fn take_record(bytes: &[u8]) -> Option<RawRecord<'_>> {
    let (length, rest) = bytes.split_first_chunk()?;
    let length = u32::from_le_bytes(*length) as usize;
    let body = rest.get(..length.checked_add(1).filter(|all| *all <= MAX_RECORD)?)?;
    let sum = rest[body.len()..].first_chunk()?;
    let is_whole = SUM.checksum(body) == u32::from_le_bytes(*sum);
    let (kind, payload) = body.split_first()?;
    is_whole.then_some(RawRecord { kind: *kind, payload, len: body.len() + 8 })
}

/// Returns whether what is left can be the begin of a record, or bytes that the disk never got.
pub(crate) fn is_torn(rest: &[u8]) -> bool {
    if rest.iter().all(|byte| *byte == 0) {
        return true;
    }
    let Some((length, body)) = rest.split_first_chunk() else { return true };
    let length = u32::from_le_bytes(*length) as usize;
    length < MAX_RECORD && body.len() <= length + 5
}

/// The content of a record, as it is written.
#[derive(Default)]
pub(crate) struct Payload(Vec<u8>);

impl Payload {
    pub fn byte(&mut self, byte: u8) {
        self.0.push(byte);
    }

    pub fn range(&mut self, range_m: f32) {
        self.0.extend(range_m.to_le_bytes());
    }

    pub fn number(&mut self, number: f64) {
        self.0.extend(number.to_le_bytes());
    }

    pub fn index(&mut self, index: usize) {
        self.0.extend((index as u32).to_le_bytes());
    }

    pub fn pose(&mut self, pose: &Pose) {
        [pose.x_m, pose.y_m, pose.yaw_rad].into_iter().for_each(|number| self.number(number));
    }

    pub fn text(&mut self, text: &str) {
        self.index(text.len());
        self.0.extend(text.as_bytes());
    }
}

/// The content of a record, as it is read: each part is `None` if the bytes do not have it.
pub(crate) struct PayloadReader<'a>(&'a [u8]);

impl<'a> PayloadReader<'a> {
    pub fn new(payload: &'a [u8]) -> Self {
        Self(payload)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    pub fn number_or_infinite(&mut self) -> Option<f64> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(f64::from_le_bytes(*bytes)).filter(|number| !number.is_nan())
    }

    pub fn number(&mut self) -> Option<f64> {
        self.number_or_infinite().filter(|number| number.is_finite())
    }

    pub fn index(&mut self) -> Option<usize> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u32::from_le_bytes(*bytes) as usize)
    }

    pub fn far_pose(&mut self) -> Option<Pose> {
        Some(Pose::new(self.number()?, self.number()?, self.number()?))
    }

    /// A pose on a map.
    pub fn pose(&mut self) -> Option<Pose> {
        self.far_pose().filter(|pose| pose.x_m.abs().max(pose.y_m.abs()) < MAX_M)
    }

    pub fn text(&mut self) -> Option<String> {
        let length = self.index()?;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(std::str::from_utf8(text).ok()?.to_owned())
    }

    /// All that is left, as ranges.
    pub fn ranges(&mut self) -> Option<Vec<f32>> {
        let (ranges, rest) = std::mem::take(&mut self.0).as_chunks();
        rest.is_empty().then(|| ranges.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect())
    }
}

/// Gives every record the sum of its bytes, as far as their lengths lead; `bytes` begin with a record.
#[cfg(test)]
pub(crate) fn seal_records(bytes: &mut [u8]) {
    let mut at = 0;
    while let Some(length) = bytes.get(at..).and_then(|rest| rest.first_chunk()) {
        let end = at + 5 + u32::from_le_bytes(*length) as usize;
        if end + 4 > bytes.len() {
            return;
        }
        let sum = SUM.checksum(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&sum.to_le_bytes());
        at = end + 4;
    }
}
