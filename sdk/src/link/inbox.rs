//! Data that arrived while the component was busy, by the input's policy. Pure.

use std::collections::VecDeque;

use armor_wire::frame::DataHeader;
use armor_wire::keep::Keep;

use super::payload::StoredPayload;

/// A `keep="all"` inbox is full at this length; then its reader waits, and the publisher with it.
const ALL_LEN: usize = 1 << 20;

/// One message that waits.
pub(crate) struct InboxItem {
    /// Its place in the order in which the data of all inputs arrived.
    pub arrival: u64,
    pub header: DataHeader,
    pub lost: u64,
    /// When it was read, in the registry's time, if calls are traced; otherwise 0.
    pub arrived_s: f64,
    pub payload: StoredPayload,
}

/// The data that wait for one input.
pub(crate) struct Inbox {
    keep: Keep,
    items: VecDeque<InboxItem>,
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
        self.keep.is_all() && self.len >= ALL_LEN
    }

    /// The arrival of the oldest.
    pub fn oldest_arrival(&self) -> Option<u64> {
        self.items.front().map(|item| item.arrival)
    }

    /// Adds an item. Returns how many older ones were dropped for it. The item after a dropped one
    /// takes its arrival: otherwise the newest data of a fast publisher would always be younger
    /// than the data at another input, and never be delivered.
    pub fn push(&mut self, item: InboxItem) -> u64 {
        self.len += item.payload.len().max(1);
        self.items.push_back(item);
        let most = match self.keep {
            Keep::All { .. } => return 0,
            Keep::Latest | Keep::Pull => 1,
            Keep::Last { count } => count as usize,
        };
        let mut dropped = 0;
        while self.items.len() > most {
            if let Some(item) = self.items.pop_front() {
                self.len -= item.payload.len().max(1);
                dropped += 1;
                if let Some(next) = self.items.front_mut() {
                    next.arrival = item.arrival;
                }
            }
        }
        dropped
    }

    /// Takes the oldest.
    pub fn pop(&mut self) -> Option<InboxItem> {
        let item = self.items.pop_front()?;
        self.len -= item.payload.len().max(1);
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

/// The inbox whose data are delivered next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct InboxTurn {
    /// Index of the input.
    pub input: usize,
    /// The arrival of its oldest data, which have waited longest of all.
    pub oldest: u64,
    /// The oldest arrival at any other input: from there on it is another input's turn.
    pub end: u64,
}

/// Finds the inbox whose oldest data have waited longest, from the oldest arrival of each.
pub(crate) fn next_turn(oldest: impl Iterator<Item = Option<u64>>) -> Option<InboxTurn> {
    let mut first: Option<(usize, u64)> = None;
    let mut end = u64::MAX;
    for (index, arrival) in oldest.enumerate() {
        let Some(arrival) = arrival else { continue };
        match first {
            Some((_, earliest)) if earliest < arrival => end = end.min(arrival),
            _ => end = first.replace((index, arrival)).map_or(end, |(_, earlier)| earlier),
        }
    }
    first.map(|(input, oldest)| InboxTurn { input, oldest, end })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(sequence: u64, len: usize) -> InboxItem {
        let header = DataHeader { sequence, stamp_s: 0.0, instance: 1, fresh: false };
        let payload = StoredPayload::Copied(vec![0; len]);
        InboxItem { arrival: 10 + sequence, header, lost: 0, arrived_s: 0.0, payload }
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
        check(Keep::ALL, &[0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn the_input_whose_data_have_waited_longest_has_its_turn_until_another_has_waited_longer() {
        let check = |oldest: &[Option<u64>], expected: Option<(usize, u64, u64)>| {
            let expected = expected.map(|(input, oldest, end)| InboxTurn { input, oldest, end });
            assert_eq!(next_turn(oldest.iter().copied()), expected, "{oldest:?}");
        };
        check(&[], None);
        check(&[None, None], None);
        check(&[None, Some(7)], Some((1, 7, u64::MAX)));
        check(&[Some(3), None, Some(7)], Some((0, 3, 7)));
        check(&[Some(9), Some(4), Some(6)], Some((1, 4, 6)));
        check(&[Some(9), Some(6), Some(4), Some(5)], Some((2, 4, 5)));
    }

    #[test]
    fn the_item_after_a_dropped_one_takes_its_place() {
        let mut inbox = Inbox::new(Keep::Last { count: 2 });
        for sequence in 0..5 {
            inbox.push(item(sequence, 10));
        }
        assert_eq!(inbox.oldest_arrival(), Some(10));
        assert_eq!(inbox.pop().map(|item| item.header.sequence), Some(3));
        assert_eq!(inbox.oldest_arrival(), Some(14));
    }

    #[test]
    fn only_keep_all_is_ever_full() {
        let mut all = Inbox::new(Keep::ALL);
        let mut latest = Inbox::new(Keep::Latest);
        for inbox in [&mut all, &mut latest] {
            inbox.push(item(0, 2 << 20));
        }
        assert_eq!((all.is_full(), latest.is_full()), (true, false));
        assert_eq!(all.clear(), 1);
        assert!(!all.is_full() && all.is_empty());
    }
}
