//! A publisher and its subscribers as threads on the words of this machine. Under Miri, which also lets
//! a thread read old values where nothing orders it, this shows what loom's sequential words cannot
//! (memory/README.md).

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use armor_memory::{PageLayout, PageWords, Placement, RingEntry, RingReader, RingWriter, SlotPool};

const MESSAGES: u64 = if cfg!(miri) { 60 } else { 20_000 };
const READERS: usize = 2;
const SLOTS: u32 = 6;
/// Words of a message, all of which are its number. Nothing but the protocol orders them.
const WORDS: usize = 4;

struct Shared {
    layout: PageLayout,
    pages: [Vec<AtomicU64>; READERS],
    slots: [[AtomicU64; WORDS]; SLOTS as usize],
    has_ended: AtomicBool,
}

impl Shared {
    fn new(cells: u32) -> Self {
        let layout = PageLayout { cells, slots: SLOTS };
        let page = |_| (0..layout.count_words()).map(|_| AtomicU64::new(0)).collect();
        Self {
            layout,
            pages: std::array::from_fn(page),
            slots: Default::default(),
            has_ended: AtomicBool::new(false),
        }
    }

    fn page(&self, reader: usize) -> PageWords<'_, AtomicU64> {
        PageWords::of(&self.pages[reader], self.layout)
    }

    /// Publishes messages 1 to [`MESSAGES`]; returns how many each link has dropped.
    fn publish(&self) -> [u64; READERS] {
        let (mut pool, mut dropped) = (SlotPool::<()>::default(), [0; READERS]);
        let mut rings: [RingWriter; READERS] = std::array::from_fn(|_| RingWriter::default());
        for message in 1..=MESSAGES {
            let is_held = |index| (0..READERS).any(|reader| self.page(reader).is_held(index));
            let place = match pool.place(1, SLOTS, is_held) {
                Placement::Reuse(place) => place,
                Placement::Add { index, .. } => pool.add(index, 1, ()),
                Placement::Exhausted => {
                    dropped.iter_mut().for_each(|dropped| *dropped += 1);
                    continue;
                }
            };
            let (slot, index) = (pool.slot_mut(place).number, pool.slot_mut(place).index);
            let words = &self.slots[index as usize];
            words.iter().for_each(|word| word.store(message, Ordering::Relaxed));
            for (reader, ring) in rings.iter_mut().enumerate() {
                let page = self.page(reader);
                page.lend(index);
                if let Some(old) = ring.push(page, RingEntry { slot, fresh: false }) {
                    page.release(old.slot - 1);
                    dropped[reader] += 1;
                }
            }
        }
        self.has_ended.store(true, Ordering::Release);
        dropped
    }

    /// Reads until the publisher has ended and nothing is left; returns how many messages.
    fn read(&self, reader: usize) -> u64 {
        let (page, mut ring) = (self.page(reader), RingReader::default());
        let (mut last, mut count) = (0, 0);
        loop {
            let has_ended = self.has_ended.load(Ordering::Acquire);
            if let Some(entry) = ring.take(page) {
                let index = entry.slot - 1;
                let words = &self.slots[index as usize];
                let read = words.each_ref().map(|word| word.load(Ordering::Relaxed));
                page.release(index);
                assert_eq!(read, [read[0]; WORDS], "a message of two");
                assert!(read[0] > last, "{} after {last}", read[0]);
                (last, count) = (read[0], count + 1);
            } else if has_ended {
                assert_eq!(last, MESSAGES, "the newest arrives");
                return count;
            } else {
                std::thread::yield_now();
            }
        }
    }
}

fn check_threads(cells: u32) {
    let shared = Shared::new(cells);
    std::thread::scope(|scope| {
        let readers = [0, 1].map(|reader| {
            let shared = &shared;
            scope.spawn(move || shared.read(reader))
        });
        let dropped = shared.publish();
        for ((reader, thread), dropped) in readers.into_iter().enumerate().zip(dropped) {
            let read = thread.join().expect("no panic");
            assert_eq!(read + dropped, MESSAGES, "every drop of {reader} is counted");
            assert_eq!(shared.page(reader).count_held(0..SLOTS), 0, "all slots are released");
        }
    });
}

#[test]
fn no_message_is_torn_or_old_with_a_ring_of_one() {
    check_threads(1);
}

#[test]
fn no_message_is_torn_or_old_with_a_ring_of_two() {
    check_threads(2);
}
