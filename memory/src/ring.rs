//! The ring of a link: the publisher pushes, the subscriber takes the oldest, and what is not taken
//! in time is taken back by the publisher, which therefore never waits.
//!
//! Each cell holds an entry with its position. The publisher exchanges a cell for the new entry; if
//! the old one was still there, the subscriber has missed it. The subscriber empties a cell only if
//! it still holds the position that it expects. Whichever of the two comes first has the old entry,
//! the other one knows that it has not.

use crate::page::PageWords;
use crate::step::{ProtocolStep, pass_step};
use crate::word::Word;

/// A message in the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingEntry {
    /// The number of the slot that holds it, 1 to `2³¹ - 1`; a number is never used again.
    pub slot: u32,
    /// The sequence jumps on purpose before it: no message was lost.
    pub fresh: bool,
}

/// Most significant bit of the lower half of a cell.
const FRESH: u32 = 1 << 31;

/// A cell with an entry at a position; 0 is an empty cell.
fn fill(position: u64, entry: RingEntry) -> u64 {
    let fresh = if entry.fresh { FRESH } else { 0 };
    u64::from(position as u32) << 32 | u64::from((entry.slot & !FRESH) | fresh)
}

fn read(cell: u64) -> Option<RingEntry> {
    let low = cell as u32;
    (cell != 0).then_some(RingEntry { slot: low & !FRESH, fresh: low & FRESH != 0 })
}

/// The publisher's end.
#[derive(Debug, Default)]
pub struct RingWriter {
    pushed: u64,
}

impl RingWriter {
    /// Whether the next push would take back an entry.
    pub fn is_full<W: Word>(&self, page: PageWords<'_, W>) -> bool {
        self.cell(page).load() != 0
    }

    /// Adds an entry. Returns the oldest one if the subscriber has not taken it: it is not in the ring
    /// any more.
    pub fn push<W: Word>(&mut self, page: PageWords<'_, W>, entry: RingEntry) -> Option<RingEntry> {
        let old = self.cell(page).swap(fill(self.pushed, entry));
        pass_step(ProtocolStep::CellExchanged);
        self.pushed += 1;
        page.pushed.store(self.pushed);
        read(old)
    }

    /// Takes back all entries that the subscriber has not taken.
    pub fn clear<W: Word>(&mut self, page: PageWords<'_, W>) -> impl Iterator<Item = RingEntry> {
        page.cells.iter().filter_map(|cell| read(cell.swap(0)))
    }

    /// How many entries the subscriber has not taken.
    pub fn count_waiting<W: Word>(&self, page: PageWords<'_, W>) -> u64 {
        page.cells.iter().filter(|cell| cell.load() != 0).count() as u64
    }

    fn cell<'a, W>(&self, page: PageWords<'a, W>) -> &'a W {
        &page.cells[(self.pushed % page.cells.len() as u64) as usize]
    }
}

/// The subscriber's end.
#[derive(Debug, Default)]
pub struct RingReader {
    taken: u64,
}

impl RingReader {
    /// Takes the oldest entry.
    pub fn take<W: Word>(&mut self, page: PageWords<'_, W>) -> Option<RingEntry> {
        let size = page.cells.len() as u64;
        loop {
            let pushed = page.pushed.load();
            // A publisher that writes nonsense costs one look at each cell.
            if self.taken >= pushed {
                return None;
            }
            self.taken = self.taken.max(pushed.saturating_sub(size));
            let cell = &page.cells[(self.taken % size) as usize];
            let value = cell.load();
            let is_expected = (value >> 32) as u32 == self.taken as u32;
            self.taken += 1;
            let Some(entry) = read(value).filter(|_| is_expected) else { continue };
            pass_step(ProtocolStep::EntrySeen);
            if cell.replace(value, 0) {
                pass_step(ProtocolStep::EntryTaken);
                return Some(entry);
            }
        }
    }

    /// Whether an entry may be there.
    pub fn has_entries<W: Word>(&self, page: PageWords<'_, W>) -> bool {
        page.pushed.load() > self.taken
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::sync::atomic::AtomicU64;

    use proptest::prelude::*;

    use super::*;
    use crate::page::PageLayout;

    fn words(layout: PageLayout) -> Vec<AtomicU64> {
        (0..layout.count_words()).map(|_| AtomicU64::new(0)).collect()
    }

    fn entry(slot: u32) -> RingEntry {
        RingEntry { slot, fresh: slot.is_multiple_of(3) }
    }

    proptest! {
        #[test]
        fn it_is_a_queue_that_drops_the_oldest(cells in 1u32..6, steps in proptest::collection::vec(0u8..5, 0..200)) {
            let layout = PageLayout { cells, slots: 1 };
            let words = words(layout);
            let page = PageWords::of(&words, layout);
            let (mut writer, mut reader) = (RingWriter::default(), RingReader::default());
            let (mut model, mut next) = (VecDeque::new(), 0);
            for step in steps {
                match step {
                    0..=2 => {
                        next += 1;
                        prop_assert_eq!(writer.is_full(page), model.len() == cells as usize);
                        let dropped = if model.len() == cells as usize { model.pop_front() } else { None };
                        prop_assert_eq!(writer.push(page, entry(next)), dropped);
                        model.push_back(entry(next));
                    }
                    3 => prop_assert_eq!(reader.take(page), model.pop_front()),
                    _ => {
                        let mut cleared: Vec<_> = writer.clear(page).collect();
                        cleared.sort_by_key(|entry| entry.slot);
                        prop_assert_eq!(std::mem::take(&mut model), cleared);
                    }
                }
                prop_assert_eq!(writer.count_waiting(page), model.len() as u64);
                prop_assert!(model.is_empty() || reader.has_entries(page));
            }
        }

        #[test]
        fn a_page_of_any_content_ends(content in proptest::collection::vec(any::<u64>(), 40)) {
            let layout = PageLayout { cells: 4, slots: 20 };
            let words: Vec<_> = content.into_iter().map(AtomicU64::new).collect();
            let page = PageWords::of(&words, layout);
            let mut reader = RingReader::default();
            for _ in 0..5 {
                if reader.take(page).is_none() {
                    break;
                }
            }
            prop_assert_eq!(reader.take(page), None);
        }
    }
}
