//! A set of packed states, numbered in the order of insertion: an arena of chunks that never move,
//! and an open-addressing table of state numbers, each stored with a few bits of its hash.

/// Words of a chunk, unless a single state has more.
const CHUNK_WORDS: usize = 1 << 15;
/// The table grows when more than this many eighths are used.
const FULL_EIGHTHS: usize = 5;
/// Most states: a number and at least one bit of its hash share 32 bits.
pub(crate) const MOST_STATES: usize = (1 << 31) - 2;

/// The result of an insertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Insertion {
    New(u32),
    Known(u32),
}

#[derive(Debug)]
pub(crate) struct StateStore {
    words: usize,
    chunks: Vec<Vec<u64>>,
    /// Binary logarithm of the states per chunk.
    chunk_shift: u32,
    len: usize,
    /// Number + 1 in the low bits, hash in the high bits; 0 is empty.
    slots: Vec<u32>,
}

impl StateStore {
    pub fn new(words: usize) -> Self {
        let chunk_shift = (CHUNK_WORDS / words).max(1).ilog2();
        Self { words, chunks: Vec::new(), chunk_shift, len: 0, slots: vec![0; 1 << 10] }
    }

    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns the bytes in use.
    pub fn bytes(&self) -> u64 {
        let chunk = (self.words as u64) << (self.chunk_shift + 3);
        self.chunks.len() as u64 * chunk + self.slots.len() as u64 * 4
    }

    /// Returns the bytes in use plus those that one more state may need.
    pub fn bytes_with_one_more(&self) -> u64 {
        let chunk = (self.words as u64) << (self.chunk_shift + 3);
        let table = if self.is_full() { self.slots.len() as u64 * 4 } else { 0 };
        self.bytes() + chunk + table
    }

    /// Returns whether the next new state makes the table or the arena grow.
    pub fn is_about_to_grow(&self) -> bool {
        self.is_full() || self.len & ((1 << self.chunk_shift) - 1) == 0
    }

    pub fn state(&self, number: u32) -> &[u64] {
        let number = number as usize;
        let at = (number & ((1 << self.chunk_shift) - 1)) * self.words;
        &self.chunks[number >> self.chunk_shift][at..at + self.words]
    }

    /// Returns the slot at which the search for a state with this hash begins. Reading the slots of
    /// several states before searching lets the memory accesses overlap.
    #[inline]
    pub fn first_slot(&self, hash: u64) -> u32 {
        self.slots[hash as usize & (self.slots.len() - 1)]
    }

    /// Inserts a state if it is new, and returns its number.
    pub fn insert(&mut self, state: &[u64], hash: u64) -> Insertion {
        if self.is_full() {
            self.grow_table();
        }
        match self.find_slot(state, hash) {
            Ok(number) => Insertion::Known(number),
            Err(slot) => {
                let number = self.len;
                self.slots[slot] = self.tag_number(number, hash);
                self.push_state(state);
                Insertion::New(number as u32)
            }
        }
    }

    /// Returns the number of a state; `None` if it is not stored.
    pub fn find(&self, state: &[u64]) -> Option<u32> {
        self.find_slot(state, hash_of(state)).ok()
    }

    /// Moves all states into a store of another width, each rewritten by `convert`.
    pub fn converted(&mut self, words: usize, mut convert: impl FnMut(&[u64], &mut [u64])) -> Self {
        let mut other = Self::new(words);
        other.slots = vec![0; self.slots.len()];
        let mut out = vec![0; words];
        for chunk in std::mem::take(&mut self.chunks) {
            for state in chunk.chunks_exact(self.words) {
                convert(state, &mut out);
                other.index_next_state(&out);
                other.push_state(&out);
            }
        }
        other
    }

    #[inline]
    fn find_slot(&self, state: &[u64], hash: u64) -> Result<u32, usize> {
        let index_bits = self.index_bits();
        let tag = (hash >> 32) as u32 >> index_bits << index_bits;
        let index_mask = (1u32 << index_bits) - 1;
        let mask = self.slots.len() - 1;
        let mut slot = hash as usize & mask;
        loop {
            let entry = self.slots[slot];
            if entry == 0 {
                return Err(slot);
            }
            if entry & !index_mask == tag {
                let number = (entry & index_mask) - 1;
                let known = self.state(number);
                // Comparing the first word alone distinguishes most markings, without a call.
                if known[0] == state[0] && known[1..] == state[1..] {
                    return Ok(number);
                }
            }
            slot = (slot + 1) & mask;
        }
    }

    fn push_state(&mut self, state: &[u64]) {
        if self.len & ((1 << self.chunk_shift) - 1) == 0 {
            self.chunks.push(Vec::with_capacity(self.words << self.chunk_shift));
        }
        self.chunks.last_mut().expect("pushed when needed").extend_from_slice(state);
        self.len += 1;
    }

    /// Adds a slot for a new state, which the caller is about to push.
    fn index_next_state(&mut self, state: &[u64]) {
        let hash = hash_of(state);
        self.fill_slot(self.len, hash);
    }

    fn fill_slot(&mut self, number: usize, hash: u64) {
        let mask = self.slots.len() - 1;
        let mut slot = hash as usize & mask;
        while self.slots[slot] != 0 {
            slot = (slot + 1) & mask;
        }
        self.slots[slot] = self.tag_number(number, hash);
    }

    /// The old table goes before the new one comes: the arena has all it needs.
    fn grow_table(&mut self) {
        let size = self.slots.len() * 2;
        self.slots = Vec::new();
        self.slots = vec![0; size];
        for number in 0..self.len {
            let hash = hash_of(self.state(number as u32));
            self.fill_slot(number, hash);
        }
    }

    fn is_full(&self) -> bool {
        (self.len + 1) * 8 > self.slots.len() * FULL_EIGHTHS
    }

    /// Numbers are below the table's size, so they and the 1 added fit as many bits.
    fn index_bits(&self) -> u32 {
        self.slots.len().ilog2().min(31)
    }

    fn tag_number(&self, number: usize, hash: u64) -> u32 {
        let index_bits = self.index_bits();
        ((hash >> 32) as u32 >> index_bits << index_bits) | (number as u32 + 1)
    }
}

/// A hash of all words: multiply and fold, as wyhash does.
#[inline]
pub(crate) fn hash_of(state: &[u64]) -> u64 {
    let mut hash = 0x9e37_79b9_7f4a_7c15;
    for word in state {
        let product = u128::from(hash ^ word) * 0xa076_1d64_78bd_642f;
        hash = (product as u64) ^ ((product >> 64) as u64);
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_state_is_kept_once_and_numbered_in_order() {
        for words in [1, 2, 3, 40_000] {
            let mut store = StateStore::new(words);
            let state = |n: u64| -> Vec<u64> { (0..words as u64).map(|w| n * n + w).collect() };
            let count = if words > 3 { 5 } else { 5000 };
            for n in 0..count {
                assert_eq!(store.insert(&state(n), hash_of(&state(n))), Insertion::New(n as u32));
            }
            for n in 0..count {
                assert_eq!(store.insert(&state(n), hash_of(&state(n))), Insertion::Known(n as u32));
                assert_eq!(store.find(&state(n)), Some(n as u32));
                assert_eq!(store.state(n as u32), state(n));
            }
            assert_eq!(store.find(&state(count)), None);
            assert_eq!(store.len(), count as usize);
        }
    }

    #[test]
    fn states_keep_their_numbers_in_another_width() {
        let mut store = StateStore::new(1);
        for n in 0..3000 {
            store.insert(&[n], hash_of(&[n]));
        }
        let other = store.converted(2, |from, to| to.copy_from_slice(&[0, from[0] * 7]));
        for n in 0..3000 {
            assert_eq!(other.find(&[0, n * 7]), Some(n as u32));
        }
    }
}
