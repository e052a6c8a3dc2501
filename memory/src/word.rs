//! A word that two processes share.

use std::sync::atomic::{AtomicU64, Ordering};

/// An atomic 64-bit word. A trait, so that the protocol also runs on the words of a model checker.
///
/// Every access is sequentially consistent: the protocol relies on the order of accesses to
/// different words in both directions (a writer stores, then looks whether the reader sleeps; the
/// reader announces that it sleeps, then looks for data).
pub trait Word {
    /// Reads it.
    fn load(&self) -> u64;
    /// Writes it.
    fn store(&self, value: u64);
    /// Writes it and returns what was there.
    fn swap(&self, value: u64) -> u64;
    /// Writes `new` if `old` is there. Returns whether it was.
    fn replace(&self, old: u64, new: u64) -> bool;
}

impl Word for AtomicU64 {
    fn load(&self) -> u64 {
        self.load(Ordering::SeqCst)
    }

    fn store(&self, value: u64) {
        self.store(value, Ordering::SeqCst);
    }

    fn swap(&self, value: u64) -> u64 {
        self.swap(value, Ordering::SeqCst)
    }

    fn replace(&self, old: u64, new: u64) -> bool {
        self.compare_exchange(old, new, Ordering::SeqCst, Ordering::SeqCst).is_ok()
    }
}
