//! Which share of its ticks a component misses because its code takes longer than its period. Pure:
//! the service thread looks at every beat and hands in the counters.

use std::time::Duration;

/// Shares are measured over windows of this length.
const WINDOW: Duration = Duration::from_secs(5);

/// The ticks of a component so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TickCounts {
    pub called: u64,
    pub skipped: u64,
}

/// The two windows that ended last.
#[derive(Debug, Default)]
pub(crate) struct TickWatch {
    begin: Duration,
    at_begin: TickCounts,
    /// The share of skipped ticks in each, the newer one last.
    shares: [f64; 2],
}

impl TickWatch {
    /// Takes the counters at `now`.
    pub fn look(&mut self, counts: TickCounts, now: Duration) {
        if now.saturating_sub(self.begin) < WINDOW {
            return;
        }
        let called = counts.called.saturating_sub(self.at_begin.called) as f64;
        let skipped = counts.skipped.saturating_sub(self.at_begin.skipped) as f64;
        let share = if skipped > 0.0 { skipped / (called + skipped) } else { 0.0 };
        (self.begin, self.at_begin) = (now, counts);
        self.shares = [self.shares[1], share];
    }

    /// The share of ticks that were skipped lately, 0 to 1: the smaller one of the two windows, so
    /// that one slow call, which counts in one of them, is no finding.
    pub fn skipped_share(&self) -> f64 {
        self.shares[0].min(self.shares[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share after each window in which so many ticks were called and skipped.
    fn shares(windows: &[(u64, u64)]) -> Vec<f64> {
        let (mut watch, mut counts) = (TickWatch::default(), TickCounts::default());
        let mut now = Duration::ZERO;
        let mut end_window = |&(called, skipped): &(u64, u64)| {
            now += WINDOW / 2;
            watch.look(TickCounts { called: counts.called, skipped: u64::MAX / 2 }, now);
            now += WINDOW / 2;
            counts.called += called;
            counts.skipped += skipped;
            watch.look(counts, now);
            watch.skipped_share()
        };
        windows.iter().map(&mut end_window).collect()
    }

    #[test]
    fn a_component_that_is_too_slow_in_two_windows_is_found_and_one_slow_call_is_not() {
        assert_eq!(shares(&[(20, 30), (25, 25), (40, 10), (50, 0)]), [0.0, 0.5, 0.2, 0.0]);
        assert_eq!(shares(&[(50, 0), (10, 40), (50, 0), (50, 0)]), [0.0; 4], "one slow call");
        assert_eq!(shares(&[(0, 0), (0, 0)]), [0.0; 2], "a frozen component");
    }
}
