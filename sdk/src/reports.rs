//! What the component reports to the executive: numbered, and kept until it is acknowledged, so
//! that a restarted executive misses none.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_wire::control::ReportKind;
use parking_lot::Mutex;

use crate::wake::Wakers;

/// Most reports that wait for an executive: a component that runs without one must not fill memory.
/// Beyond it the oldest event is dropped and counted; the first one is logged.
const MAX_WAITING: usize = 256;
/// After this time without another error, a component that is active counts as healthy again.
const HEALTHY_AFTER: Duration = Duration::from_secs(10);

/// Most bytes of a reason. It is sent with reports and states, in frames of at most 1 MiB, and a longer one
/// would never arrive: the component would look dead, and its mission would wait.
const MAX_REASON_LEN: usize = 4096;

/// After this time an event that is not acknowledged counts as one that no executive takes.
const UNTAKEN_AFTER: Duration = Duration::from_secs(1);

/// A report that is not acknowledged yet.
#[derive(Clone, Debug)]
pub(crate) struct PendingReport {
    pub number: u64,
    /// When it was made.
    pub since: Instant,
    pub activation: u64,
    pub outcome: ReportKind,
}

impl PendingReport {
    fn is_event(&self) -> bool {
        matches!(self.outcome, ReportKind::Event { .. })
    }
}

#[derive(Default)]
struct WaitingReports {
    last_number: u64,
    reports: VecDeque<PendingReport>,
    dropped: u64,
}

/// What is wrong with the component.
#[derive(Default)]
struct KnownErrors {
    /// The error recorded last, and when; none once it is over.
    last: Option<(String, Instant)>,
    /// Errors that last until they are resolved, by their subject.
    standing: BTreeMap<String, String>,
}

/// The reports that wait for an acknowledgement, and the component's last error.
pub(crate) struct ReportQueue {
    waiting: Mutex<WaitingReports>,
    errors: Mutex<KnownErrors>,
    wakers: Arc<Wakers>,
}

impl ReportQueue {
    pub fn new(wakers: Arc<Wakers>) -> Self {
        Self { waiting: Mutex::default(), errors: Mutex::default(), wakers }
    }

    /// Adds a report and wakes the service thread to send it.
    pub fn add_report(&self, activation: u64, mut outcome: ReportKind) {
        if let ReportKind::Failed { reason } = &mut outcome {
            *reason = cut_reason(reason);
        }
        let mut waiting = self.waiting.lock();
        waiting.last_number += 1;
        let number = waiting.last_number;
        waiting.reports.push_back(PendingReport {
            number,
            since: Instant::now(),
            activation,
            outcome,
        });
        if waiting.reports.len() > MAX_WAITING {
            // Missions wait for `done` and `failed` first of all, so events go before them.
            let oldest = waiting.reports.iter().position(PendingReport::is_event).unwrap_or(0);
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

    /// How many events no executive has taken: those that have waited for a while, and the reports
    /// that were dropped.
    pub fn count_untaken_events(&self, now: Instant) -> u64 {
        let waiting = self.waiting.lock();
        let is_untaken = |report: &&PendingReport| {
            report.is_event() && now.saturating_duration_since(report.since) >= UNTAKEN_AFTER
        };
        waiting.dropped + waiting.reports.iter().filter(is_untaken).count() as u64
    }

    /// Records and logs an error of the component.
    pub fn record_error(&self, reason: &str) {
        let reason = cut_reason(reason);
        tracing::error!("{reason}");
        self.errors.lock().last = Some((reason, Instant::now()));
    }

    /// Records and logs an error that lasts until its subject is
    /// [resolved](Self::resolve_error).
    pub fn record_standing_error(&self, subject: &str, reason: &str) {
        let reason = cut_reason(reason);
        tracing::error!("{reason}");
        self.errors.lock().standing.insert(subject.into(), reason);
    }

    /// The standing error of a subject.
    pub fn find_standing_error(&self, subject: &str) -> Option<String> {
        self.errors.lock().standing.get(subject).cloned()
    }

    /// Forgets the standing error of a subject.
    pub fn resolve_error(&self, subject: &str) {
        self.errors.lock().standing.remove(subject);
    }

    /// Forgets the last error: another activation begins.
    pub fn forget_last_error(&self) {
        self.errors.lock().last = None;
    }

    /// The number of the newest report; 0 if there was none.
    pub fn last_number(&self) -> u64 {
        self.waiting.lock().last_number
    }

    /// What is wrong with the component; empty if nothing is. `is_active`: it is at work, so an
    /// error is over after a while.
    pub fn current_error(&self, is_active: bool, now: Instant) -> String {
        let errors = self.errors.lock();
        let is_over = |at: Instant| is_active && now.saturating_duration_since(at) >= HEALTHY_AFTER;
        let last = errors.last.as_ref().filter(|(_, at)| !is_over(*at));
        let mut all: Vec<_> = last.iter().map(|(reason, _)| reason.as_str()).collect();
        all.extend(errors.standing.values().map(String::as_str));
        all.join("; ")
    }
}

/// The reason, or its beginning with the number of bytes that it had.
fn cut_reason(reason: &str) -> String {
    if reason.len() <= MAX_REASON_LEN {
        return reason.to_owned();
    }
    let start = &reason[..reason.floor_char_boundary(MAX_REASON_LEN)];
    format!("{start}… ({} bytes in all)", reason.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_that_is_too_long_for_a_frame_is_cut() {
        let queue = ReportQueue::new(Arc::new(Wakers::new().unwrap()));
        let reason = "ü".repeat(2 << 20);
        queue.add_report(1, ReportKind::Failed { reason: reason.clone() });
        queue.record_error(&reason);
        queue.record_standing_error("speed", &reason);
        let report = queue.list_after(0).remove(0);
        let ReportKind::Failed { reason } = report.outcome else { panic!("another report") };
        assert!(reason.ends_with("ü… (4194304 bytes in all)"), "{} bytes", reason.len());
        assert!(reason.len() < 5000);
        assert!(queue.current_error(true, Instant::now()).len() < 10_000);
    }

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
    fn events_that_no_executive_takes_are_counted_and_ends_are_not() {
        let queue = ReportQueue::new(Arc::new(Wakers::new().unwrap()));
        queue.add_report(1, event(0.5));
        queue.add_report(1, ReportKind::Done);
        queue.add_report(1, event(0.75));
        let (now, later) = (Instant::now(), Instant::now() + UNTAKEN_AFTER);
        assert_eq!(queue.count_untaken_events(now), 0, "an executive may be about to take them");
        assert_eq!(queue.count_untaken_events(later), 2);
        queue.remove_acknowledged(1);
        assert_eq!(queue.count_untaken_events(later), 1);
    }

    #[test]
    fn without_an_executive_the_oldest_event_is_dropped_and_no_end() {
        let queue = ReportQueue::new(Arc::new(Wakers::new().unwrap()));
        queue.add_report(1, ReportKind::Done);
        for value in 0..MAX_WAITING {
            queue.add_report(2, event(value as f64));
        }
        let numbers = numbers(&queue, 0);
        let now = Instant::now();
        assert_eq!((numbers.len(), queue.count_untaken_events(now)), (MAX_WAITING, 1));
        assert_eq!(numbers[..2], [1, 3], "the first event is dropped, `done` is not");
    }

    #[test]
    fn an_error_is_over_when_the_component_works_again_and_a_standing_one_when_it_is_resolved() {
        let queue = ReportQueue::new(Arc::new(Wakers::new().unwrap()));
        queue.record_error("no echo");
        let (now, later) = (Instant::now(), Instant::now() + HEALTHY_AFTER);
        assert_eq!(queue.current_error(true, now), "no echo");
        assert_eq!(queue.current_error(false, later), "no echo", "nothing has replaced it");
        assert_eq!(queue.current_error(true, later), "");
        queue.record_standing_error("speed", "too fast");
        assert_eq!(queue.current_error(false, now), "no echo; too fast");
        queue.forget_last_error();
        assert_eq!(queue.current_error(true, later), "too fast");
        queue.resolve_error("speed");
        assert_eq!(queue.current_error(true, now), "");
    }
}
