//! What the two ends of a link share: the words of its page, and where each of them is.

use crate::word::Word;

/// Words of a cache line: what both ends write often is not in the same line.
const LINE: usize = 8;
/// Where the cells of the ring begin.
const CELLS_AT: usize = 2 * LINE;

/// Most cells of a ring.
pub const MAX_CELLS: u32 = 32;
/// Most slots of an output, and so entries in the table of those that a subscriber holds.
pub const MAX_SLOTS: u32 = 256;

/// The sizes of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageLayout {
    /// Cells of the ring, 1 to [`MAX_CELLS`].
    pub cells: u32,
    /// Entries of the table, 1 to [`MAX_SLOTS`].
    pub slots: u32,
}

impl PageLayout {
    /// Whether both sizes are within their limits.
    pub fn is_valid(self) -> bool {
        (1..=MAX_CELLS).contains(&self.cells) && (1..=MAX_SLOTS).contains(&self.slots)
    }

    /// How many words the page has.
    pub fn count_words(self) -> usize {
        CELLS_AT + self.cells as usize + self.slots as usize
    }
}

/// The words of a page.
#[derive(Debug)]
pub struct PageWords<'a, W> {
    /// 1 while the subscriber sleeps and must be woken.
    sleeps: &'a W,
    /// How many entries have been pushed.
    pub(crate) pushed: &'a W,
    /// The ring.
    pub(crate) cells: &'a [W],
    /// For each slot, by its index: 1 while the subscriber may read it.
    holds: &'a [W],
}

impl<W> Clone for PageWords<'_, W> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<W> Copy for PageWords<'_, W> {}

impl<'a, W: Word> PageWords<'a, W> {
    /// The parts of a page of [`PageLayout::count_words`] words.
    ///
    /// # Panics
    /// If there are fewer words.
    pub fn of(words: &'a [W], layout: PageLayout) -> Self {
        let (cells, holds) = words[CELLS_AT..].split_at(layout.cells as usize);
        Self {
            sleeps: &words[0],
            pushed: &words[LINE],
            cells,
            holds: &holds[..layout.slots as usize],
        }
    }

    /// Publisher: lends a slot to the subscriber, before it is pushed.
    pub fn lend(&self, slot: u32) {
        if let Some(hold) = self.holds.get(slot as usize) {
            hold.store(1);
        }
    }

    /// Either end: the subscriber does not read the slot any more.
    pub fn release(&self, slot: u32) {
        if let Some(hold) = self.holds.get(slot as usize) {
            hold.store(0);
        }
    }

    /// Publisher: whether the subscriber may still read the slot.
    pub fn is_held(&self, slot: u32) -> bool {
        self.holds.get(slot as usize).is_some_and(|hold| hold.load() != 0)
    }

    /// Publisher: how many of these slots the subscriber may read.
    pub fn count_held(&self, slots: impl Iterator<Item = u32>) -> usize {
        slots.filter(|slot| self.is_held(*slot)).count()
    }

    /// Publisher, after a push: whether the subscriber sleeps and must be woken. It is asked once
    /// for each sleep.
    pub fn must_wake(&self) -> bool {
        // Both ends exchange the word, whichever comes second sees what the first did before. A load
        // would not order that.
        self.sleeps.swap(0) != 0
    }

    /// Subscriber: it will sleep. It must look at the ring once more afterwards, since what was
    /// pushed before this call wakes no thread.
    pub fn announce_sleep(&self) {
        self.sleeps.swap(1);
    }

    /// Subscriber: it does not sleep.
    pub fn announce_awake(&self) {
        self.sleeps.swap(0);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use super::*;

    #[test]
    fn a_held_slot_is_counted_until_it_is_released_and_a_sleeper_is_woken_once() {
        let layout = PageLayout { cells: 2, slots: 3 };
        let words: Vec<_> = (0..layout.count_words()).map(|_| AtomicU64::new(0)).collect();
        let page = PageWords::of(&words, layout);
        page.lend(0);
        page.lend(2);
        page.lend(3);
        assert_eq!((page.count_held(0..9), page.is_held(2), page.is_held(3)), (2, true, false));
        page.release(2);
        page.release(1000);
        assert_eq!((page.count_held(0..9), page.is_held(2)), (1, false));
        assert!(!page.must_wake());
        page.announce_sleep();
        assert!(page.must_wake() && !page.must_wake());
        page.announce_sleep();
        page.announce_awake();
        assert!(!page.must_wake());
    }

    #[test]
    fn only_sizes_within_the_limits_are_valid() {
        for (cells, slots, valid) in [(1, 1, true), (32, 256, true), (0, 1, false), (1, 0, false)] {
            assert_eq!(PageLayout { cells, slots }.is_valid(), valid);
        }
        assert!(!PageLayout { cells: 33, slots: 1 }.is_valid());
        assert!(!PageLayout { cells: 1, slots: 257 }.is_valid());
    }
}
