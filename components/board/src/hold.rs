//! Which of several writers holds an element: by priority, or the newest; a silent one loses it.

/// How the holder is chosen among the writers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoldPolicy {
    /// The first writer that is not silent.
    Priority,
    /// The writer of the message with the newest stamp.
    Newest,
}

/// The hold of an element. Writers are numbered from 0, the one with the highest priority first.
#[derive(Clone, Debug)]
pub struct ElementHold {
    policy: HoldPolicy,
    /// A writer that has sent nothing for longer is silent.
    timeout_s: f64,
    /// When each writer was heard last.
    heard_s: Vec<Option<f64>>,
    holder: Option<usize>,
    /// Stamp of the last message that was passed on.
    passed_s: Option<f64>,
}

impl ElementHold {
    /// An element that no writer holds.
    pub fn new(writers: usize, policy: HoldPolicy, timeout_s: f64) -> Self {
        let heard_s = vec![None; writers];
        Self { policy, timeout_s, heard_s, holder: None, passed_s: None }
    }

    /// Changes how the holder is chosen, from the next message on.
    pub fn set_rules(&mut self, policy: HoldPolicy, timeout_s: f64) {
        (self.policy, self.timeout_s) = (policy, timeout_s);
    }

    /// The writer that holds the element.
    pub fn holder(&self) -> Option<usize> {
        self.holder
    }

    /// The age of the element: of the last message that was passed on.
    pub fn age_s(&self, now_s: f64) -> Option<f64> {
        self.passed_s.map(|stamp_s| now_s - stamp_s)
    }

    /// A message of a writer has arrived. Returns whether it is passed on; its writer holds the element
    /// then.
    pub fn receive(&mut self, writer: usize, stamp_s: f64, now_s: f64) -> bool {
        self.heard_s[writer] = Some(now_s);
        let holder = self.holder.filter(|holder| !self.is_silent(*holder, now_s));
        let is_passed = match (holder, self.policy) {
            (None, _) => true,
            (Some(holder), _) if holder == writer => true,
            (Some(holder), HoldPolicy::Priority) => writer < holder,
            (Some(_), HoldPolicy::Newest) => self.passed_s.is_none_or(|passed| stamp_s >= passed),
        };
        if is_passed {
            (self.holder, self.passed_s) = (Some(writer), Some(stamp_s));
        } else {
            self.holder = holder;
        }
        is_passed
    }

    /// Takes the element from a silent holder, and gives it to the next writer that is not silent.
    pub fn release_silent(&mut self, now_s: f64) {
        // After a step back of the time, no silence counts from a time that is still to come.
        for heard_s in self.heard_s.iter_mut().flatten() {
            *heard_s = heard_s.min(now_s);
        }
        if self.holder.is_none_or(|holder| !self.is_silent(holder, now_s)) {
            return;
        }
        let mut others = (0..self.heard_s.len()).filter(|writer| !self.is_silent(*writer, now_s));
        self.holder = match self.policy {
            HoldPolicy::Priority => others.next(),
            HoldPolicy::Newest => others.max_by(|a, b| {
                let heard = |writer: &usize| self.heard_s[*writer].unwrap_or(f64::NEG_INFINITY);
                heard(a).total_cmp(&heard(b))
            }),
        };
    }

    fn is_silent(&self, writer: usize, now_s: f64) -> bool {
        self.heard_s[writer].is_none_or(|heard_s| now_s - heard_s > self.timeout_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a writer sends: writer, stamp, time of arrival; whether it is passed on.
    type Sent = (usize, f64, f64, bool);

    fn check(policy: HoldPolicy, sent: &[Sent]) -> ElementHold {
        let mut hold = ElementHold::new(3, policy, 0.5);
        for (writer, stamp_s, now_s, expected) in sent {
            let is_passed = hold.receive(*writer, *stamp_s, *now_s);
            assert_eq!(is_passed, *expected, "writer {writer} at {now_s}: {hold:?}");
        }
        hold
    }

    #[test]
    fn the_first_writer_that_is_not_silent_holds_the_element() {
        let mut hold = check(
            HoldPolicy::Priority,
            &[
                (1, 1.0, 1.0, true),
                (2, 1.1, 1.1, false),
                (0, 1.2, 1.2, true),
                (1, 1.3, 1.3, false),
                // Writer 0 is silent: the next message of any writer takes the element.
                (2, 1.8, 1.8, true),
                (1, 1.9, 1.9, true),
                (0, 2.0, 2.0, true),
            ],
        );
        assert_eq!(hold.holder(), Some(0));
        assert_eq!(hold.age_s(2.25), Some(0.25));
        hold.release_silent(2.5);
        assert_eq!(hold.holder(), Some(0), "exactly the timeout is not longer than it");
        hold.receive(2, 2.5, 2.5);
        hold.release_silent(2.6);
        assert_eq!(hold.holder(), Some(2), "of those that are heard");
        hold.release_silent(3.1);
        assert_eq!((hold.holder(), hold.age_s(3.1)), (None, Some(1.1)));
    }

    #[test]
    fn the_newest_writer_holds_the_element_and_stamps_never_run_back_between_two() {
        let mut hold = check(
            HoldPolicy::Newest,
            &[
                (2, 1.0, 1.0, true),
                (0, 0.9, 1.05, false),
                (0, 1.0, 1.1, true),
                (1, 1.2, 1.2, true),
                // Its own stamps are a writer's own affair.
                (1, 0.3, 1.3, true),
                (2, 0.2, 1.4, false),
                // Writer 1 is silent, and whatever comes is newer than nothing.
                (2, 0.2, 1.9, true),
            ],
        );
        assert_eq!(hold.holder(), Some(2));
        hold.receive(0, 0.1, 2.3);
        hold.receive(1, 0.1, 2.35);
        hold.release_silent(2.41);
        assert_eq!(hold.holder(), Some(1), "of those that are heard, the one heard last");
    }

    #[test]
    fn a_holder_is_not_kept_by_a_time_that_has_run_back() {
        for policy in [HoldPolicy::Priority, HoldPolicy::Newest] {
            let mut hold = check(policy, &[(0, 100.0, 100.0, true)]);
            hold.release_silent(10.0);
            assert!(hold.holder().is_some());
            hold.release_silent(10.6);
            assert_eq!(hold.holder(), None);
            assert!(hold.receive(1, 10.7, 10.7));
        }
    }
}
