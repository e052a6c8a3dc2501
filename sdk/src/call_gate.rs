//! Who may run the component's code: one thread at a time. Threads that read inputs enter when the
//! gate is free and otherwise leave their data in an inbox, the backlog; the main loop enters next
//! whenever it asks.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use parking_lot::{Mutex, MutexGuard};

/// The lock around the component, and what its users must agree on without holding it.
pub(crate) struct CallGate<T> {
    component: Mutex<T>,
    /// How many times data were put into an inbox since the backlog was last taken.
    backlog: AtomicUsize,
    /// Data put into inboxes so far.
    arrivals: AtomicU64,
    main_waits: AtomicBool,
}

impl<T> CallGate<T> {
    pub fn new(component: T) -> Self {
        Self {
            component: Mutex::new(component),
            backlog: AtomicUsize::new(0),
            arrivals: AtomicU64::new(0),
            main_waits: AtomicBool::new(false),
        }
    }

    /// Enters if no thread is inside and the main loop does not wait.
    ///
    /// Without the second condition a flood of data could keep the main loop, and so ticks and
    /// orders, waiting for ever: the lock is not fair.
    pub fn try_enter(&self) -> Option<MutexGuard<'_, T>> {
        if self.main_waits() { None } else { self.component.try_lock() }
    }

    /// Enters from the main loop as the next one.
    pub fn enter_from_main(&self) -> MutexGuard<'_, T> {
        self.main_waits.store(true, Ordering::SeqCst);
        let component = self.component.lock();
        self.main_waits.store(false, Ordering::SeqCst);
        component
    }

    /// Whether the main loop wants to enter; a thread inside leaves as soon as it can.
    pub fn main_waits(&self) -> bool {
        self.main_waits.load(Ordering::Relaxed)
    }

    /// The place of data that are put into an inbox, in the order of all inputs' data.
    pub fn next_arrival(&self) -> u64 {
        self.arrivals.fetch_add(1, Ordering::Relaxed)
    }

    /// The place that the next data will get.
    pub fn arrivals(&self) -> u64 {
        self.arrivals.load(Ordering::SeqCst)
    }

    /// Notes that an inbox may hold data.
    pub fn add_backlog(&self) {
        self.backlog.fetch_add(1, Ordering::SeqCst);
    }

    /// Clears the note, before the inboxes are looked at: data added meanwhile are noted again.
    pub fn clear_backlog(&self) {
        self.backlog.swap(0, Ordering::SeqCst);
    }

    pub fn has_backlog(&self) -> bool {
        self.backlog.load(Ordering::SeqCst) != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thread_is_inside_and_the_main_loop_is_next() {
        let gate = CallGate::new(0);
        let inside = gate.try_enter().expect("the component is free");
        assert!(gate.try_enter().is_none());
        std::thread::scope(|scope| {
            let main = scope.spawn(|| *gate.enter_from_main());
            while !gate.main_waits() {
                std::thread::yield_now();
            }
            drop(inside);
            assert_eq!(main.join().unwrap(), 0);
        });
        assert!(gate.try_enter().is_some(), "the main loop has left");
    }

    #[test]
    fn arrivals_are_numbered_and_the_backlog_is_noted_until_cleared() {
        let gate = CallGate::new(());
        assert_eq!((gate.next_arrival(), gate.next_arrival(), gate.arrivals()), (0, 1, 2));
        gate.add_backlog();
        assert!(gate.has_backlog());
        gate.clear_backlog();
        assert!(!gate.has_backlog());
    }
}
