//! Data that arrived while the component was busy, by the input's policy. Pure.

use std::collections::VecDeque;

use armor_wire::frame::DataHeader;
use armor_wire::keep::Keep;

/// A `keep="all"` input holds this much; then its reader waits, and the publisher behind it.
const ALL_LEN: usize = 1 << 20;

/// One data, kept.
pub(crate) struct Item {
    pub header: DataHeader,
    pub lost: u64,
    pub bytes: Vec<u8>,
}

/// The data that wait for one input.
pub(crate) struct Inbox {
    keep: Keep,
    items: VecDeque<Item>,
    len: usize,
}

impl Inbox {
    pub fn new(keep: Keep) -> Self {
        Self { keep, items: VecDeque::new(), len: 0 }
    }

    pub fn set_keep(&mut self, keep: Keep) {
        self.keep = keep;
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// How many wait.
    pub fn count(&self) -> usize {
        self.items.len()
    }

    /// Whether a `keep="all"` reader should wait before it adds more.
    pub fn is_full(&self) -> bool {
        self.keep == Keep::All && self.len >= ALL_LEN
    }

    /// Adds one; returns how many older ones were dropped for it.
    pub fn push(&mut self, item: Item) -> u64 {
        self.len += item.bytes.len().max(1);
        self.items.push_back(item);
        let most = match self.keep {
            Keep::All => return 0,
            Keep::Latest => 1,
            Keep::Last { count } => count as usize,
        };
        let mut dropped = 0;
        while self.items.len() > most {
            if let Some(item) = self.items.pop_front() {
                self.len -= item.bytes.len().max(1);
                dropped += 1;
            }
        }
        dropped
    }

    /// Takes the oldest.
    pub fn pop(&mut self) -> Option<Item> {
        let item = self.items.pop_front()?;
        self.len -= item.bytes.len().max(1);
        Some(item)
    }

    /// Empties it; returns how many there were.
    pub fn clear(&mut self) -> u64 {
        let count = self.items.len() as u64;
        self.items.clear();
        self.len = 0;
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(sequence: u64, len: usize) -> Item {
        let header = DataHeader { sequence, stamp_s: 0.0, instance: 1, fresh: false };
        Item { header, lost: 0, bytes: vec![0; len] }
    }

    fn check(keep: Keep, expected: &[u64]) {
        let mut inbox = Inbox::new(keep);
        let dropped: u64 = (0..6).map(|sequence| inbox.push(item(sequence, 10))).sum();
        let kept: Vec<_> = std::iter::from_fn(|| inbox.pop()).map(|i| i.header.sequence).collect();
        assert_eq!(kept, expected, "keep={keep}");
        assert_eq!(dropped, 6 - expected.len() as u64, "keep={keep}");
    }

    #[test]
    fn each_policy_keeps_the_newest_it_promises() {
        check(Keep::Latest, &[5]);
        check(Keep::Last { count: 3 }, &[3, 4, 5]);
        check(Keep::All, &[0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn only_keep_all_is_ever_full() {
        let mut all = Inbox::new(Keep::All);
        let mut latest = Inbox::new(Keep::Latest);
        for inbox in [&mut all, &mut latest] {
            inbox.push(item(0, 2 << 20));
        }
        assert_eq!((all.is_full(), latest.is_full()), (true, false));
        assert_eq!(all.clear(), 1);
        assert!(!all.is_full() && all.is_empty());
    }
}
