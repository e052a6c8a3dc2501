//! Statistics of each input: age of its newest data, rate, losses.

use std::collections::VecDeque;

/// Rates are taken over this time, in seconds.
const WINDOW_S: f64 = 3.0;
/// Most arrivals kept for a rate; faster inputs are counted over a shorter time.
const MAX_ARRIVALS: usize = 600;
/// A steady input is late after this, and after so many of its periods.
const LATE: (f64, f64) = (1.0, 3.0);
/// A steady input is gone after this, and after so many of its periods.
const GONE: (f64, f64) = (3.0, 10.0);
/// A loss is shown with the health of all links for this time, in seconds.
const LOSS_SHOWN_S: f64 = 10.0;

/// Both clocks at one moment, in seconds. The host's always advances; the system's may stand still,
/// as after the death of the simulator that provides it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockTimes {
    /// Since the program started.
    pub host_s: f64,
    /// Time of the whole system.
    pub system_s: f64,
}

/// How recent the newest data are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freshness {
    /// No data have arrived.
    Nothing,
    /// As recent as expected; or the input is not steady, so that its age means nothing.
    Fresh,
    /// Older than usual.
    Late,
    /// So old that the robot may be anywhere.
    Gone,
}

/// One linked input.
#[derive(Clone, Debug)]
pub struct InputLink {
    /// Its name at the component.
    pub input: &'static str,
    /// The source of the data, `component.output`.
    pub data: String,
    /// Whether data arrive all the time, so that silence is worth a warning.
    pub is_steady: bool,
    /// The problem with the newest data.
    pub problem: Option<String>,
    /// Number of lost data, from gaps in the sequence.
    pub lost: u64,
    /// When data were missing last, by the host's clock, in seconds.
    lost_at_s: Option<f64>,
    arrivals: VecDeque<f64>,
    last: Option<ClockTimes>,
    /// Number of the newest data.
    newest: Option<SequenceNumber>,
}

/// The number of data at their provider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SequenceNumber {
    /// Start of the provider.
    pub instance: u64,
    /// Counted from 0 since then.
    pub sequence: u64,
}

impl InputLink {
    /// Makes a link without data.
    pub fn new(input: &'static str, data: String, is_steady: bool) -> Self {
        let arrivals = VecDeque::new();
        Self {
            input,
            data,
            is_steady,
            problem: None,
            lost: 0,
            lost_at_s: None,
            arrivals,
            last: None,
            newest: None,
        }
    }

    /// Records the arrival of data created at `stamp_s` of system time. Missing numbers count as
    /// lost, wherever it happened, also in this program's own inbox.
    pub fn record_arrival(&mut self, now: ClockTimes, stamp_s: f64, number: SequenceNumber) {
        if let Some(newest) = self.newest.filter(|newest| newest.instance == number.instance) {
            let missing = number.sequence.saturating_sub(newest.sequence.saturating_add(1));
            self.lost += missing;
            if missing > 0 {
                self.lost_at_s = Some(now.host_s);
            }
        }
        self.newest = Some(number);
        self.last = Some(ClockTimes { host_s: now.host_s, system_s: stamp_s });
        self.arrivals.push_back(now.host_s);
        self.forget(now.host_s);
    }

    /// Returns whether data were lost in the last seconds.
    pub fn is_losing(&self, now: ClockTimes) -> bool {
        self.lost_at_s.is_some_and(|at_s| now.host_s - at_s < LOSS_SHOWN_S)
    }

    fn forget(&mut self, host_s: f64) {
        while self.arrivals.len() > MAX_ARRIVALS
            || self.arrivals.front().is_some_and(|at_s| host_s - at_s > WINDOW_S)
                && self.arrivals.len() > 2
        {
            self.arrivals.pop_front();
        }
    }

    /// Returns the age of the newest data in seconds: since their creation in system time, but at
    /// least since their arrival here.
    pub fn age_s(&self, now: ClockTimes) -> Option<f64> {
        let last = self.last?;
        let age_s = (now.host_s - last.host_s).max(now.system_s - last.system_s);
        Some(if age_s.is_finite() { age_s.max(0.0) } else { 0.0 })
    }

    /// Returns the arrivals per second; falls towards 0 during silence.
    pub fn rate_hz(&self, now: ClockTimes) -> f64 {
        let (Some(first), Some(last)) = (self.arrivals.front(), self.arrivals.back()) else {
            return 0.0;
        };
        let count = self.arrivals.len() as f64 - 1.0;
        let period_s = (last - first) / count.max(1.0);
        // Overdue data lower the rate.
        let span_s = (last - first).max(now.host_s - first - period_s);
        if span_s > 0.0 { count / span_s } else { 0.0 }
    }

    /// How recent the newest data are.
    pub fn freshness(&self, now: ClockTimes) -> Freshness {
        let Some(age_s) = self.age_s(now) else { return Freshness::Nothing };
        if !self.is_steady {
            return Freshness::Fresh;
        }
        let period_s = match (self.arrivals.front(), self.arrivals.back()) {
            (Some(first), Some(last)) if self.arrivals.len() > 1 => {
                (last - first) / (self.arrivals.len() - 1) as f64
            }
            _ => 0.0,
        };
        let is_over = |(least_s, periods): (f64, f64)| age_s > least_s.max(periods * period_s);
        match () {
            () if is_over(GONE) => Freshness::Gone,
            () if is_over(LATE) => Freshness::Late,
            () => Freshness::Fresh,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(host_s: f64) -> ClockTimes {
        ClockTimes { host_s, system_s: 1000.0 + host_s }
    }

    fn number(sequence: u32) -> SequenceNumber {
        SequenceNumber { instance: 1, sequence: sequence.into() }
    }

    fn steady(until_s: u32, rate_hz: u32) -> InputLink {
        let mut link = InputLink::new("scan", "laser.scan".into(), true);
        for n in 0..until_s * rate_hz {
            let s = f64::from(n) / f64::from(rate_hz);
            link.record_arrival(at(s), 1000.0 + s, number(n));
        }
        link
    }

    #[test]
    fn silence_makes_a_steady_link_late_and_then_gone() {
        let link = steady(4, 10);
        let last_s = 3.9;
        for (after_s, expected) in
            [(0.1, Freshness::Fresh), (1.5, Freshness::Late), (3.5, Freshness::Gone)]
        {
            assert_eq!(link.freshness(at(last_s + after_s)), expected, "after {after_s} s");
        }
        let mut slow = steady(1, 1);
        slow.record_arrival(at(5.0), 1005.0, number(1));
        assert_eq!(slow.freshness(at(9.0)), Freshness::Fresh, "it comes every five seconds");
    }

    #[test]
    fn a_link_that_speaks_when_something_changes_is_never_late() {
        let mut link = InputLink::new("map", "slam.map".into(), false);
        assert_eq!(link.freshness(at(9.0)), Freshness::Nothing);
        link.record_arrival(at(0.0), 1000.0, number(0));
        assert_eq!(link.freshness(at(900.0)), Freshness::Fresh);
    }

    #[test]
    fn data_grow_old_while_system_time_stands_and_count_what_they_took_on_the_way() {
        let mut link = InputLink::new("scan", "laser.scan".into(), true);
        link.record_arrival(ClockTimes { host_s: 1.0, system_s: 10.0 }, 9.5, number(0));
        assert_eq!(link.age_s(ClockTimes { host_s: 1.0, system_s: 10.0 }), Some(0.5));
        assert_eq!(link.age_s(ClockTimes { host_s: 5.0, system_s: 10.0 }), Some(4.0));
    }

    #[test]
    fn the_rate_is_that_of_the_last_seconds_and_falls_in_silence() {
        let link = steady(6, 20);
        assert!((link.rate_hz(at(5.95)) - 20.0).abs() < 0.5, "{}", link.rate_hz(at(5.95)));
        assert!(link.rate_hz(at(12.0)) < 8.0, "{}", link.rate_hz(at(12.0)));
    }

    #[test]
    fn gaps_in_the_sequence_are_losses() {
        let mut link = steady(1, 10);
        assert_eq!(link.lost, 0);
        link.record_arrival(at(2.0), 1002.0, number(13));
        link.record_arrival(at(3.0), 1003.0, number(18));
        assert_eq!(link.lost, 7);
        link.record_arrival(at(4.0), 1004.0, SequenceNumber { instance: 2, sequence: 900 });
        assert_eq!(link.lost, 7, "of another start nothing was to be had before");
    }
}
