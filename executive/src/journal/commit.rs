//! The state file next to a journal: the number and hash of the last committed record. They
//! distinguish a crash from a deleted end.
//!
//! Two slots of one page each are written in turn, so that a write that a power failure interrupts
//! leaves the other slot. A slot is a line of JSON, filled up with spaces.

use super::line::{ChainEnd, checksum};

/// The length of a slot: a page, so that no write touches both.
pub(crate) const SLOT_LEN: usize = 4096;

/// One slot: a record that was on the disk when the slot was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Commit {
    /// The last record that may have been acted on.
    pub(super) end: ChainEnd,
    /// Counts the writes of slots; the slot with the higher count is the newer one.
    pub(super) write: u64,
}

/// What a state file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CommitState {
    pub(super) newest: Commit,
    /// The slot that holds it, 0 or 1.
    pub(super) slot: usize,
    /// Whether the other slot is unreadable: it was being written, or is damaged.
    pub(super) is_half: bool,
}

impl Commit {
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut slot = format!("{}{:08x}\"}}", self.unsummed(), self.sum()).into_bytes();
        slot.resize(SLOT_LEN - 1, b' ');
        slot.push(b'\n');
        slot
    }

    fn unsummed(&self) -> String {
        let ChainEnd { number, hash } = self.end;
        let write = self.write;
        format!("{{\"committed\":{number},\"hash\":\"{hash:016x}\",\"write\":{write},\"crc\":\"")
    }

    fn sum(&self) -> u32 {
        checksum(self.unsummed().as_bytes())
    }

    fn decode(slot: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(slot).ok()?.strip_prefix("{\"committed\":")?;
        let (number, rest) = text.split_once(",\"hash\":\"")?;
        let (hash, rest) = rest.split_once("\",\"write\":")?;
        let (write, _) = rest.split_once(',')?;
        let hash = u64::from_str_radix(hash, 16).ok()?;
        let end = ChainEnd { number: number.parse().ok()?, hash };
        let commit = Self { end, write: write.parse().ok()? };
        // Compared as a whole: only one spelling is valid, checksum and filling included.
        (commit.encode() == slot).then_some(commit)
    }
}

impl CommitState {
    /// Reads a state file; `None` if it is damaged beyond what an interrupted write leaves.
    pub(super) fn decode(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != 2 * SLOT_LEN {
            return None;
        }
        let read = |slot: usize| {
            let commit = Commit::decode(&bytes[slot * SLOT_LEN..(slot + 1) * SLOT_LEN])?;
            Some(Self { newest: commit, slot, is_half: false })
        };
        match (read(0), read(1)) {
            (Some(one), Some(two)) if one.newest.write > two.newest.write => Some(one),
            (Some(_), Some(two)) => Some(two),
            (one, two) => one.or(two).map(|only| Self { is_half: true, ..only }),
        }
    }

    /// The slot to be written next, and its content. The newest slot stays as it is.
    pub(super) fn commit(&mut self, end: ChainEnd) -> (usize, Vec<u8>) {
        let newest = Commit { end, write: self.newest.write + 1 };
        *self = Self { newest, slot: 1 - self.slot, is_half: false };
        (self.slot, newest.encode())
    }
}

/// The state file of a journal whose last committed record is `end`.
pub(super) fn new_state(end: ChainEnd) -> Vec<u8> {
    [Commit::default(), Commit { end, write: 1 }].iter().flat_map(Commit::encode).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(bytes: &mut [u8], (slot, content): (usize, Vec<u8>)) {
        bytes[slot * SLOT_LEN..(slot + 1) * SLOT_LEN].copy_from_slice(&content);
    }

    #[test]
    fn slots_are_written_in_turn_and_the_newest_counts() {
        let mut bytes = new_state(ChainEnd::default());
        let mut state = CommitState::decode(&bytes).unwrap();
        assert_eq!(state.newest.end, ChainEnd::default());
        for number in 1..6 {
            let before = state.newest;
            let end = ChainEnd { number, hash: number * 7 };
            let written = state.commit(end);
            let slot = written.0;
            write(&mut bytes, written);
            assert_eq!(CommitState::decode(&bytes), Some(state));
            assert_eq!(state.newest.end, end);
            bytes[slot * SLOT_LEN + 20] ^= 1;
            let torn = CommitState::decode(&bytes).unwrap();
            assert_eq!((torn.newest, torn.is_half), (before, true));
            write(&mut bytes, (slot, state.newest.encode()));
        }
        let text = String::from_utf8(bytes.clone()).unwrap();
        assert!(text.lines().all(|line| line.starts_with("{\"committed\":")), "{text}");
        bytes[30] ^= 4;
        bytes[SLOT_LEN + 30] ^= 4;
        assert_eq!(CommitState::decode(&bytes), None);
        assert_eq!(CommitState::decode(b""), None);
    }

    #[test]
    fn every_flipped_bit_of_a_slot_is_noticed() {
        let slot = Commit { end: ChainEnd { number: 17, hash: 5 }, write: 9 }.encode();
        for bit in 0..SLOT_LEN * 8 {
            let mut flipped = slot.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Commit::decode(&flipped), None, "bit {bit}");
        }
    }
}
