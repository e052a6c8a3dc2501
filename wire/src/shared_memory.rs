//! How the two ends of a link agree on memory that they share: the bodies of the frames
//! [`MemoryOffer`](crate::frame::FrameKind::MemoryOffer),
//! [`SlotOffer`](crate::frame::FrameKind::SlotOffer) and [`SlotEnd`](crate::frame::FrameKind::SlotEnd),
//! and the beginning of a slot (docs/protocol.md, Shared memory).

use crate::Message;
use crate::frame::DataHeader;

/// Length of what precedes the payload in a slot. More than its content needs, so that payloads
/// begin at a cache line.
pub const SLOT_HEADER_LEN: usize = 64;

/// Whether a subscriber takes data from shared memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum MemoryUse {
    /// All data come over the stream.
    #[default]
    Never,
    /// The publisher offers memory when its messages are large.
    Large,
    /// The publisher offers memory immediately.
    Always,
}

/// The page of the link: its file is sent with this frame. From here on data come by the ring in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "MemoryOffer")]
pub struct MemoryOfferBody {
    /// Cells of the ring.
    pub cells: u32,
    /// Entries of the table of slots.
    pub slots: u32,
    /// How many slots the subscriber may hold, those in the ring not counted.
    pub held: u32,
}

/// A slot: its file is sent with this frame, before the first entry of the ring that names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "SlotOffer")]
pub struct SlotOfferBody {
    /// Its number, 1 to 2³¹ - 1, as in the ring.
    pub slot: u32,
    /// Its entry in the table.
    pub index: u32,
    /// Its length in bytes.
    pub len: u32,
}

/// A slot that will not be used any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "SlotEnd")]
pub struct SlotEndBody {
    /// Its number.
    pub slot: u32,
}

/// Writes the beginning of a slot; `slot` is at least [`SLOT_HEADER_LEN`] bytes long.
pub fn write_slot_header(slot: &mut [u8], header: &DataHeader, payload_len: usize) {
    let words = [header.sequence, header.stamp_s.to_bits(), header.instance, payload_len as u64];
    for (bytes, word) in slot.chunks_exact_mut(8).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
}

/// Reads a slot: the header of its message, which is not fresh, and the payload. `None` if the
/// length in it is not possible.
pub fn read_slot(slot: &[u8]) -> Option<(DataHeader, &[u8])> {
    let (header, rest) = slot.split_at_checked(SLOT_HEADER_LEN)?;
    let word = |at: usize| {
        let bytes = header.chunks_exact(8).nth(at).and_then(|bytes| bytes.first_chunk());
        bytes.map_or(0, |bytes| u64::from_le_bytes(*bytes))
    };
    let payload = rest.get(..usize::try_from(word(3)).ok()?)?;
    let stamp_s = f64::from_bits(word(1));
    Some((DataHeader { sequence: word(0), stamp_s, instance: word(2), fresh: false }, payload))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_read_as_it_was_written() {
        let header = DataHeader { sequence: 3, stamp_s: 1.5, instance: 7, fresh: false };
        let mut slot = vec![9; 100];
        write_slot_header(&mut slot, &header, 30);
        assert_eq!(read_slot(&slot), Some((header, &[9; 30][..])));
        write_slot_header(&mut slot, &header, 36);
        assert_eq!(read_slot(&slot).map(|(_, payload)| payload.len()), Some(36));
        write_slot_header(&mut slot, &header, 37);
        assert_eq!(read_slot(&slot), None);
        write_slot_header(&mut slot, &header, usize::MAX);
        assert_eq!(read_slot(&slot), None);
        assert_eq!(read_slot(&slot[..63]), None);
    }
}
