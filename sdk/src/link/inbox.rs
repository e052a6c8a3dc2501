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
