//! A counter with one writer at a time.

use std::sync::atomic::{AtomicU64, Ordering};

/// Counts events of which only one thread at a time can be the cause, because a lock or the design
/// keeps other writers out. Any thread may read it.
///
/// A load and a store in place of an atomic addition: the addition costs more than the rest of a
/// small message's bookkeeping.
#[derive(Debug, Default)]
pub(crate) struct SingleWriterCounter(AtomicU64);

impl SingleWriterCounter {
    /// Counts one more; returns the new count.
    pub fn increment(&self) -> u64 {
        self.add(1)
    }

    /// Counts `more`; returns the new count.
    pub fn add(&self, more: u64) -> u64 {
        let count = self.0.load(Ordering::Relaxed).wrapping_add(more);
        self.0.store(count, Ordering::Relaxed);
        count
    }

    pub fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
