//! How often a component publishes its progress.

use crate::messages::Progress;

/// A task's progress is published again after this, in seconds of system time.
const PERIOD_S: f64 = 1.0;

/// Decides when a component publishes its [`Progress`]: immediately when the task changes, and
/// otherwise once per second of system time. A component may ask at every tick: the details are
/// made only for a message that is due.
///
/// ```
/// use armor_sdk::messages::ProgressPace;
///
/// let mut pace = ProgressPace::default();
/// let describe = || (Some(0.25), "3.2 m to go".to_owned());
/// assert_eq!(pace.next_progress(7.0, "driving", describe).expect("it is new").fraction, 0.25);
/// assert!(pace.next_progress(7.1, "driving", describe).is_none());
/// ```
#[derive(Clone, Debug, Default)]
pub struct ProgressPace {
    /// When a message was due last, and its task.
    last: Option<(f64, String)>,
}

impl ProgressPace {
    /// Returns the message to publish at `now_s`, if one is due. An empty `task` means that no task
    /// is active. `describe` returns the share of the task that is done, 0 … 1, if it is known, and
    /// the details for people.
    pub fn next_progress(
        &mut self,
        now_s: f64,
        task: &str,
        describe: impl FnOnce() -> (Option<f64>, String),
    ) -> Option<Progress> {
        // The absolute value: system time goes back when its source is restarted.
        let is_recent = |&(at_s, _): &(f64, String)| (now_s - at_s).abs() < PERIOD_S;
        if self.last.as_ref().filter(|last| is_recent(last)).is_some_and(|last| last.1 == task) {
            return None;
        }
        self.last = Some((now_s, task.to_owned()));
        let (fraction, detail) = describe();
        let fraction = fraction.map_or(f32::NAN, |fraction| fraction as f32);
        Some(Progress { stamp: now_s, task: task.to_owned(), fraction, detail })
    }

    /// Returns the message that no task is active any more.
    pub fn end(&mut self, now_s: f64) -> Option<Progress> {
        self.next_progress(now_s, "", || (None, String::new()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_task_is_due_immediately_and_the_same_task_after_a_second() {
        let mut pace = ProgressPace::default();
        let mut check = |now_s: f64, task: &str, expected: bool| {
            let mut was_described = false;
            let due = pace.next_progress(now_s, task, || {
                was_described = true;
                (None, String::new())
            });
            assert_eq!((due.is_some(), was_described), (expected, expected), "{task}, {now_s} s");
        };
        check(5.0, "exploring", true);
        check(5.2, "exploring", false);
        check(5.3, "explored", true);
        check(6.2, "explored", false);
        check(6.3, "explored", true);
        check(1.0, "explored", true);
        check(1.5, "explored", false);
        check(1.6, "", true);
    }

    #[test]
    fn an_unknown_share_is_not_a_number() {
        let mut pace = ProgressPace::default();
        let progress = pace.next_progress(1.0, "driving", || (None, "2.0 m to go".into()));
        let progress = progress.expect("it is new");
        assert_eq!((progress.stamp, progress.detail.as_str()), (1.0, "2.0 m to go"));
        assert_eq!(progress.known_fraction(), None);
        assert_eq!(pace.end(1.1).expect("the task has ended").task, "");
        assert_eq!(pace.end(1.2), None);
    }
}
