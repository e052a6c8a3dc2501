//! The bytes of the forms: Armor's and those of ROS 1, without gaps, and CDR, in which a number begins
//! at a multiple of its size.

use thiserror::Error;

/// Why the bytes of a message do not fit its layout.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{problem} at byte {at}")]
pub struct LayoutError {
    /// What is wrong.
    pub problem: &'static str,
    /// Where.
    pub at: usize,
}

/// CDR in the byte order of this encoding: little-endian, version 1.
pub(super) const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Reads either form from its beginning to its end.
#[derive(Clone, Copy)]
pub(super) struct ByteReader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Without gaps, as ROS 1 has it, and not CDR.
    is_packed: bool,
}

impl<'a> ByteReader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, is_packed: false }
    }

    /// Reads bytes of ROS 1.
    pub fn packed(bytes: &'a [u8]) -> Self {
        Self { is_packed: true, ..Self::new(bytes) }
    }

    /// Whether the bytes are those of ROS 1.
    pub fn is_packed(&self) -> bool {
        self.is_packed
    }

    pub fn error(&self, problem: &'static str) -> LayoutError {
        LayoutError { problem, at: self.at }
    }

    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub fn take(&mut self, len: usize) -> Result<&'a [u8], LayoutError> {
        let end = self.at.checked_add(len).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| self.error("the message ends too early"))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    pub fn take_array<const N: usize>(&mut self) -> Result<[u8; N], LayoutError> {
        let mut out = [0; N];
        out.copy_from_slice(self.take(N)?);
        Ok(out)
    }

    /// A count of Armor, whose items take at least `least` bytes each.
    pub fn take_count(&mut self, least: usize) -> Result<usize, LayoutError> {
        let count = u64::from_le_bytes(self.take_array()?);
        self.check_count(count, least)
    }

    /// A count of CDR, the same.
    pub fn take_ros_count(&mut self, least: usize) -> Result<usize, LayoutError> {
        let count = u32::from_le_bytes(self.take_aligned()?);
        self.check_count(count.into(), least)
    }

    fn check_count(&self, count: u64, least: usize) -> Result<usize, LayoutError> {
        let most = self.left() / least.max(1);
        usize::try_from(count)
            .ok()
            .filter(|count| *count <= most)
            .ok_or_else(|| self.error("a count exceeds the message"))
    }

    /// Passes over the gap before a value of `size` bytes. Positions count from behind the
    /// encapsulation header.
    pub fn align(&mut self, size: usize) -> Result<(), LayoutError> {
        if self.is_packed {
            return Ok(());
        }
        self.take(gap(self.at - ENCAPSULATION.len(), size)).map(|_| ())
    }

    pub fn take_aligned<const N: usize>(&mut self) -> Result<[u8; N], LayoutError> {
        self.align(N)?;
        self.take_array()
    }
}

/// Writes CDR, or the bytes of ROS 1.
pub(super) struct RosWriter {
    pub bytes: Vec<u8>,
    /// Without gaps, as ROS 1 has it, and not CDR.
    is_packed: bool,
}

impl RosWriter {
    /// Begins in the memory of `bytes`, with room for so many.
    pub fn reuse(mut bytes: Vec<u8>, room: usize) -> Self {
        bytes.clear();
        bytes.reserve(room);
        bytes.extend_from_slice(&ENCAPSULATION);
        Self { bytes, is_packed: false }
    }

    /// Begins bytes of ROS 1, with room for so many.
    pub fn packed(room: usize) -> Self {
        Self { bytes: Vec::with_capacity(room), is_packed: true }
    }

    /// The counter with which a header begins in ROS 1, which sets it itself.
    pub fn put_counter(&mut self) {
        if self.is_packed {
            self.bytes.extend_from_slice(&[0; 4]);
        }
    }

    pub fn align(&mut self, size: usize) {
        if self.is_packed {
            return;
        }
        let len = self.bytes.len();
        self.bytes.resize(len + gap(len - ENCAPSULATION.len(), size), 0);
    }

    pub fn put_aligned<const N: usize>(&mut self, value: [u8; N]) {
        self.align(N);
        self.bytes.extend_from_slice(&value);
    }

    /// The count of a sequence.
    pub fn put_count(&mut self, count: usize) -> Result<(), LayoutError> {
        let at = self.bytes.len();
        let count = u32::try_from(count)
            .map_err(|_| LayoutError { problem: "a list is too long for ROS", at })?;
        self.put_aligned(count.to_le_bytes());
        Ok(())
    }

    /// A text: its length with the zero at its end, which ROS 1 does not have, the text, the zero.
    pub fn put_text(&mut self, text: &[u8]) -> Result<(), LayoutError> {
        let zero: &[u8] = if self.is_packed { &[] } else { &[0] };
        self.put_count(text.len() + zero.len())?;
        self.bytes.extend_from_slice(text);
        self.bytes.extend_from_slice(zero);
        Ok(())
    }
}

fn gap(position: usize, size: usize) -> usize {
    (size - position % size) % size
}
