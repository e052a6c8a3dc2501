//! The last values of an output, for subscribers that come later or ask for them.

use std::collections::VecDeque;
use std::sync::Arc;

/// The longest history that a latched output keeps.
const MAX_KEPT: u32 = 64;
/// More bytes are kept only if the newest frame alone has more.
const MAX_LEN: usize = 64 << 20;

/// The last frames, oldest first, each with its sequence.
pub(super) struct KeptFrames {
    most: u32,
    frames: VecDeque<(u64, Arc<Vec<u8>>)>,
}

impl Default for KeptFrames {
    fn default() -> Self {
        Self { most: 1, frames: VecDeque::new() }
    }
}

impl KeptFrames {
    /// A subscriber asks for the last `count`. Those of a subscriber that comes back are still
    /// kept, so this never becomes less.
    pub fn ask_for(&mut self, count: u32) {
        self.most = self.most.max(count.min(MAX_KEPT));
    }

    /// Adds the newest frame.
    pub fn push(&mut self, sequence: u64, frame: Arc<Vec<u8>>) {
        self.frames.push_back((sequence, frame));
        let mut len: usize = self.frames.iter().map(|(_, frame)| frame.len()).sum();
        while self.frames.len() > self.most as usize || (len > MAX_LEN && self.frames.len() > 1) {
            len -= self.frames.pop_front().map_or(0, |(_, frame)| frame.len());
        }
    }

    /// The newest frame.
    pub fn last(&self) -> Option<&(u64, Arc<Vec<u8>>)> {
        self.frames.back()
    }

    /// Takes the newest frame out.
    pub fn take_last(&mut self) -> Option<Arc<Vec<u8>>> {
        self.frames.pop_back().map(|(_, frame)| frame)
    }

    /// The newest `count` frames, oldest first.
    pub fn newest(&self, count: u32) -> impl Iterator<Item = &(u64, Arc<Vec<u8>>)> {
        self.frames.iter().skip(self.frames.len().saturating_sub(count.max(1) as usize))
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.frames.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_are_kept_as_the_longest_history_asks_for() {
        let mut kept = KeptFrames::default();
        let frame = || Arc::new(Vec::new());
        (0..5).for_each(|sequence| kept.push(sequence, frame()));
        let newest = |kept: &KeptFrames, count| -> Vec<u64> {
            kept.newest(count).map(|(sequence, _)| *sequence).collect()
        };
        assert_eq!(newest(&kept, 3), [4]);
        kept.ask_for(3);
        kept.ask_for(2);
        (5..9).for_each(|sequence| kept.push(sequence, frame()));
        assert_eq!((newest(&kept, 9), newest(&kept, 2)), (vec![6, 7, 8], vec![7, 8]));
        assert_eq!(newest(&kept, 0), [8]);
        kept.push(9, Arc::new(vec![0; MAX_LEN + 1]));
        assert_eq!(newest(&kept, 9), [9], "too long together");
        kept.clear();
        kept.ask_for(u32::MAX);
        (9..200).for_each(|sequence| kept.push(sequence, frame()));
        assert_eq!(newest(&kept, 1000).len(), 64);
    }
}
