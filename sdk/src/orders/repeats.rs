//! How many times an order that changes nothing was repeated, and which of the repetitions are to be
//! written down.

use std::collections::BTreeMap;

/// Most keys that are counted; those beyond are not written down at all.
pub const MAX_REPEATED: usize = 64;

/// Counts repetitions by a key, such as the author of an order. Those whose count is a power of two are
/// written down, so that a flood of any length is a few dozen lines, and the last of them states
/// its size.
#[derive(Clone, Debug)]
pub struct Repeats<K>(BTreeMap<K, u64>);

impl<K> Default for Repeats<K> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<K: Ord> Repeats<K> {
    /// Counts one more; returns the count if this one is to be written down.
    pub fn note(&mut self, key: K) -> Option<u64> {
        if self.0.len() >= MAX_REPEATED && !self.0.contains_key(&key) {
            return None;
        }
        let count = self.0.entry(key).or_default();
        *count = count.saturating_add(1);
        count.is_power_of_two().then_some(*count)
    }

    /// Begins again: what was repeated has changed.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_is_written_down_at_powers_of_two() {
        let mut repeats = Repeats::default();
        let noted: Vec<_> = (0..10).filter_map(|_| repeats.note("olga")).collect();
        assert_eq!(noted, [1, 2, 4, 8]);
        assert_eq!(repeats.note("bob"), Some(1), "another one");
        repeats.clear();
        assert_eq!(repeats.note("olga"), Some(1));
    }

    #[test]
    fn a_flood_of_keys_is_bounded() {
        let mut repeats = Repeats::default();
        let noted = (0..10_000).filter_map(|key| repeats.note(key)).count();
        assert_eq!(noted, MAX_REPEATED);
        assert_eq!(repeats.note(0), Some(2));
    }
}
