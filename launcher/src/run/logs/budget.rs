//! How much one process may print: a burst of lines, then a rate.

use std::time::Duration;

/// Lines in one burst.
const BURST: f64 = 10_000.0;
/// Lines per second on average: far more than a person reads, far less than fills a disk.
const RATE_HZ: f64 = 2_000.0;
/// A line counts as several if it is longer, in bytes.
const LINE_LEN: usize = 200;
/// Interval of the warnings about a process that floods.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// A bucket of lines that fills with time.
pub struct LineBudget {
    lines: f64,
    filled: Duration,
    left_out: u64,
    reported: Duration,
}

impl LineBudget {
    /// A full bucket.
    pub fn new(now: Duration) -> Self {
        Self { lines: BURST, filled: now, left_out: 0, reported: now }
    }

    /// Returns whether one more line may pass; if not, counts it.
    pub fn spend_line(&mut self, now: Duration, len: usize) -> bool {
        let passed = now.saturating_sub(self.filled).as_secs_f64();
        self.filled = now;
        self.lines = (self.lines + passed * RATE_HZ).min(BURST);
        let cost = (1 + len / LINE_LEN) as f64;
        if self.lines < cost {
            self.left_out += 1;
            return false;
        }
        self.lines -= cost;
        true
    }

    /// How many lines were left out since this was last asked, if a report is due.
    pub fn take_left_out(&mut self, now: Duration, last: bool) -> Option<u64> {
        let due = last || now.saturating_sub(self.reported) >= REPORT_EVERY;
        if self.left_out == 0 || !due {
            return None;
        }
        self.reported = now;
        Some(std::mem::take(&mut self.left_out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_cut_to_the_rate_and_every_line_counted() {
        let mut budget = LineBudget::new(Duration::ZERO);
        let mut passed = 0;
        let mut left_out = 0;
        for millisecond in 0..10_000 {
            let now = Duration::from_millis(millisecond);
            passed += (0..100).filter(|_| budget.spend_line(now, 80)).count();
            left_out += budget.take_left_out(now, millisecond == 9_999).unwrap_or(0);
        }
        assert!((29_990..=30_010).contains(&passed), "{passed}");
        assert_eq!(passed as u64 + left_out, 1_000_000);
    }

    #[test]
    fn long_lines_cost_more() {
        let mut budget = LineBudget::new(Duration::ZERO);
        let passed = (0..10_000).filter(|_| budget.spend_line(Duration::ZERO, 8_000)).count();
        assert_eq!(passed, 10_000 / 41);
    }
}
