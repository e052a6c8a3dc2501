//! What the component reports to the executive: numbered, and kept until it is acknowledged, so
//! that a restarted executive misses none.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use armor_wire::control::ReportKind;
use parking_lot::Mutex;

use crate::wake::Wakers;

/// Most reports that wait for an executive: a component that runs without one must not fill memory.
/// Beyond it the oldest event is dropped and counted; the first one is logged.
const MAX_WAITING: usize = 256;

/// A report that is not acknowledged yet.
#[derive(Clone, Debug)]
pub(crate) struct PendingReport {
    pub number: u64,
    pub activation: u64,
    pub outcome: ReportKind,
}

#[derive(Default)]
struct WaitingReports {
    last_number: u64,
    reports: VecDeque<PendingReport>,
    dropped: u64,
}

/// The reports that wait for an acknowledgement, and the component's last error.
pub(crate) struct ReportQueue {
    waiting: Mutex<WaitingReports>,
    last_error: Mutex<String>,
    errors: AtomicU64,
    wakers: Arc<Wakers>,
}

impl ReportQueue {
    pub fn new(wakers: Arc<Wakers>) -> Self {
        Self {
            waiting: Mutex::default(),
            last_error: Mutex::default(),
            errors: AtomicU64::new(0),
            wakers,
        }
    }

    /// Adds a report and wakes the service thread to send it.
    pub fn add_report(&self, activation: u64, outcome: ReportKind) {
        let mut waiting = self.waiting.lock();
        waiting.last_number += 1;
        let number = waiting.last_number;
        waiting.reports.push_back(PendingReport { number, activation, outcome });
        if waiting.reports.len() > MAX_WAITING {
            // Missions wait for `done` and `failed` first of all, so events go before them.
            let is_event =
                |report: &PendingReport| matches!(report.outcome, ReportKind::Event { .. });
            let oldest = waiting.reports.iter().position(is_event).unwrap_or(0);
            waiting.reports.remove(oldest);
            waiting.dropped += 1;
            // A component that runs without a mission reports as often as any other.
            if waiting.dropped == 1 {
                tracing::warn!(
                    "a report was dropped: no executive has taken the last {MAX_WAITING}; further \
                     ones are counted by `armor ps`"
                );
            }
        }
        drop(waiting);
        self.wakers.wake_service();
    }

    /// Removes the reports up to `number`, which the executive has recorded.
    pub fn remove_acknowledged(&self, number: u64) {
        self.waiting.lock().reports.retain(|report| report.number > number);
    }

    /// The reports after `number`, in order.
    pub fn list_after(&self, number: u64) -> Vec<PendingReport> {
        let waiting = self.waiting.lock();
        waiting.reports.iter().filter(|report| report.number > number).cloned().collect()
    }

    pub fn is_empty(&self) -> bool {
        self.waiting.lock().reports.is_empty()
    }

    /// How many reports were dropped because no executive took them.
    pub fn count_dropped(&self) -> u64 {
        self.waiting.lock().dropped
    }

    /// Records and logs an error of the component.
    pub fn record_error(&self, reason: &str) {
        tracing::error!("{reason}");
        reason.clone_into(&mut self.last_error.lock());
        self.errors.fetch_add(1, Ordering::Relaxed);
    }

    /// The errors recorded so far.
    pub fn count_errors(&self) -> u64 {
        self.errors.load(Ordering::Relaxed)
    }

    /// The number of the newest report; 0 if there was none.
    pub fn last_number(&self) -> u64 {
        self.waiting.lock().last_number
    }

    /// The error recorded last; empty if there was none.
    pub fn last_error(&self) -> String {
        self.last_error.lock().clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(value: f64) -> ReportKind {
        ReportKind::Event { name: "half".into(), value }
    }

    fn numbers(queue: &ReportQueue, after: u64) -> Vec<u64> {
        queue.list_after(after).iter().map(|report| report.number).collect()
    }

    #[test]
    fn reports_are_numbered_and_kept_until_acknowledged() {
        let queue = ReportQueue::new(Arc::new(Wakers::new().unwrap()));
        for value in [0.25, 0.5, 0.75] {
            queue.add_report(7, event(value));
        }
        assert_eq!(numbers(&queue, 0), [1, 2, 3]);
        assert_eq!(numbers(&queue, 2), [3], "what was sent on this connection is not sent again");
        queue.remove_acknowledged(2);
        assert_eq!(numbers(&queue, 0), [3]);
        queue.remove_acknowledged(3);
        assert!(queue.is_empty());
    }

    #[test]
    fn without_an_executive_the_oldest_event_is_dropped_and_no_end() {
        let queue = ReportQueue::new(Arc::new(Wakers::new().unwrap()));
        queue.add_report(1, ReportKind::Done);
        for value in 0..MAX_WAITING {
            queue.add_report(2, event(value as f64));
        }
        let numbers = numbers(&queue, 0);
        assert_eq!((numbers.len(), queue.count_dropped()), (MAX_WAITING, 1));
        assert_eq!(numbers[..2], [1, 3], "the first event is dropped, `done` is not");
    }
}
