//! Every interleaving of a publisher and its subscribers, by loom: no slot is written while it is
//! read, none is read with another message than the ring promises, and no end sleeps while a message
//! waits for them.

use armor_memory::{
    PageLayout, PageWords, Placement, RingEntry, RingReader, RingWriter, SlotPool, Word,
};
use loom::cell::UnsafeCell;
use loom::sync::Arc;
use loom::sync::atomic::{AtomicU64, Ordering};
use loom::thread;

/// A word that loom watches.
#[derive(Debug)]
struct WatchedWord(AtomicU64);

impl Word for WatchedWord {
    fn load(&self) -> u64 {
        self.0.load(Ordering::SeqCst)
    }
    fn store(&self, value: u64) {
        self.0.store(value, Ordering::SeqCst);
    }
    fn swap(&self, value: u64) -> u64 {
        self.0.swap(value, Ordering::SeqCst)
    }
    fn replace(&self, old: u64, new: u64) -> bool {
        self.0.compare_exchange(old, new, Ordering::SeqCst, Ordering::SeqCst).is_ok()
    }
}

const SLOTS: u32 = 3;

/// The memory of an output and of its links.
struct Shared {
    layout: PageLayout,
    pages: Vec<Vec<WatchedWord>>,
    slots: Vec<WatchedSlot>,
}

/// The memory of a slot.
struct WatchedSlot {
    /// Loom fails if one thread is in `with_mut` while another one is in `with` or `with_mut`.
    access: UnsafeCell<()>,
    /// The number of the message in it. Loom does not see this, so it orders nothing.
    message: std::sync::atomic::AtomicU64,
}

impl WatchedSlot {
    fn write(&self, message: u64) {
        self.access.with_mut(|_| self.message.store(message, Ordering::Relaxed));
    }

    fn read(&self) -> u64 {
        self.access.with(|_| self.message.load(Ordering::Relaxed))
    }
}

impl Shared {
    fn new(readers: usize, cells: u32) -> Arc<Self> {
        let layout = PageLayout { cells, slots: SLOTS };
        let page = || (0..layout.count_words()).map(|_| WatchedWord(AtomicU64::new(0))).collect();
        let pages = (0..readers).map(|_| page()).collect();
        let slot = || WatchedSlot { access: UnsafeCell::new(()), message: Default::default() };
        let slots = (0..SLOTS).map(|_| slot()).collect();
        Arc::new(Self { layout, pages, slots })
    }

    fn page(&self, reader: usize) -> PageWords<'_, WatchedWord> {
        PageWords::of(&self.pages[reader], self.layout)
    }
}

/// The publisher of messages 1 to `count`. Returns how many each link has dropped.
fn publish(shared: &Shared, count: u64) -> Vec<u64> {
    let readers = shared.pages.len();
    let mut pool = SlotPool::<()>::default();
    let mut rings: Vec<_> = (0..readers).map(|_| RingWriter::default()).collect();
    let mut dropped = vec![0; readers];
    for message in 1..=count {
        let is_held = |index| (0..readers).any(|reader| shared.page(reader).is_held(index));
        let place = match pool.place(1, SLOTS, is_held) {
            Placement::Reuse(place) => place,
            Placement::Add { index, .. } => pool.add(index, 1, ()),
            Placement::Exhausted => {
                dropped.iter_mut().for_each(|dropped| *dropped += 1);
                continue;
            }
        };
        let (number, index) = (pool.slot_mut(place).number, pool.slot_mut(place).index);
        // The numbers of slots and their indices: 1 and 0, 2 and 1, …
        assert_eq!(number, index + 1);
        shared.slots[index as usize].write(message);
        for (reader, ring) in rings.iter_mut().enumerate() {
            let page = shared.page(reader);
            page.lend(index);
            if let Some(old) = ring.push(page, RingEntry { slot: number, fresh: false }) {
                // The same slot cannot come twice: it is held until it is released.
                assert_ne!(old.slot, number);
                page.release(old.slot - 1);
                dropped[reader] += 1;
            }
        }
    }
    dropped
}

/// Reads what is in the ring. Returns the messages.
fn read(shared: &Shared, reader: usize, ring: &mut RingReader, looks: usize) -> Vec<u64> {
    let page = shared.page(reader);
    let mut messages = Vec::new();
    for _ in 0..looks {
        if let Some(entry) = ring.take(page) {
            let index = entry.slot - 1;
            messages.push(shared.slots[index as usize].read());
            page.release(index);
        }
    }
    messages
}

/// How many preemptions an interleaving may have. `None`: any number, so that all are explored that
/// differ in what a thread reads.
type MostPreemptions = Option<usize>;

/// Returns how many interleavings were explored.
fn explore(preemptions: MostPreemptions, body: impl Fn() + Send + Sync + 'static) -> u64 {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = preemptions;
    let count = std::sync::Arc::new(std::sync::atomic::AtomicU64::new(0));
    let explored = std::sync::Arc::clone(&count);
    builder.check(move || {
        explored.fetch_add(1, Ordering::Relaxed);
        body();
    });
    count.load(Ordering::Relaxed)
}

/// What a publisher and its subscribers do in a model.
#[derive(Clone, Copy, Debug)]
struct Scenario {
    readers: usize,
    /// Cells of each ring.
    cells: u32,
    messages: u64,
    /// How many times each subscriber looks into its ring while messages are published.
    looks: usize,
}

fn check_readers(scenario: Scenario, preemptions: MostPreemptions) {
    let Scenario { readers, cells, messages, looks } = scenario;
    let count = explore(preemptions, move || {
        let shared = Shared::new(readers, cells);
        let threads: Vec<_> = (0..readers)
            .map(|reader| {
                let shared = Arc::clone(&shared);
                thread::spawn(move || {
                    let mut ring = RingReader::default();
                    let read = read(&shared, reader, &mut ring, looks);
                    (ring, read)
                })
            })
            .collect();
        let dropped = publish(&shared, messages);
        for (reader, thread) in threads.into_iter().enumerate() {
            let (mut ring, mut seen) = thread.join().expect("no panic");
            // What is left is the newest.
            seen.extend(read(&shared, reader, &mut ring, cells as usize));
            assert!(seen.is_sorted_by(|a, b| a < b), "in order, each once: {seen:?}");
            assert_eq!(seen.len() as u64 + dropped[reader], messages, "every drop is counted");
            assert_eq!(shared.page(reader).count_held(0..SLOTS), 0, "all slots are released");
        }
    });
    println!("{scenario:?}, preemptions {preemptions:?}: {count} interleavings");
}

#[test]
fn one_subscriber_of_the_newest() {
    check_readers(Scenario { readers: 1, cells: 1, messages: 3, looks: 2 }, None);
}

#[test]
fn one_subscriber_of_the_last_two() {
    check_readers(Scenario { readers: 1, cells: 2, messages: 3, looks: 2 }, None);
}

#[test]
fn two_subscribers_share_three_slots() {
    check_readers(Scenario { readers: 2, cells: 1, messages: 3, looks: 2 }, Some(3));
}

/// Every interleaving. With `ARMOR_FULL=1` also of three messages, so that the third slot is needed:
/// 4,574,803, in 7 min of an optimised build.
#[test]
fn two_subscribers_share_three_slots_in_every_order() {
    let of_messages = |messages| Scenario { readers: 2, cells: 1, messages, looks: 1 };
    check_readers(of_messages(2), None);
    if std::env::var_os("ARMOR_FULL").is_some() {
        check_readers(of_messages(3), None);
    }
}

#[test]
fn a_subscriber_that_sleeps_is_woken() {
    explore(None, || {
        let shared = Shared::new(1, 1);
        // Counts the wake-ups, as the socket of the link carries them.
        let wakes = Arc::new(AtomicU64::new(0));
        let publisher = thread::spawn({
            let (shared, wakes) = (Arc::clone(&shared), Arc::clone(&wakes));
            move || {
                publish(&shared, 1);
                if shared.page(0).must_wake() {
                    wakes.fetch_add(1, Ordering::SeqCst);
                }
            }
        });
        let (page, mut ring) = (shared.page(0), RingReader::default());
        page.announce_sleep();
        let has_seen_it = ring.take(page).is_some();
        publisher.join().expect("no panic");
        assert!(has_seen_it || wakes.load(Ordering::SeqCst) == 1);
    });
}
