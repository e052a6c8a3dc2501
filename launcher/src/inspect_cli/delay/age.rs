//! The ages of the data of one window, and their summary.

use std::fmt;

use armor_inspect::words::format_short_time;
use serde::Serialize;

/// Most ages of one window that are kept; the summary of more is that of the first ones.
const MAX_AGES: usize = 1_000_000;

/// The ages of one window, in seconds.
#[derive(Debug, Default)]
pub struct AgeWindow {
    ages_s: Vec<f64>,
}

/// The ages of one window, summed up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AgeSummary {
    mean_s: f64,
    p50_s: f64,
    p99_s: f64,
    max_s: f64,
}

/// The result of one window.
#[derive(Debug, PartialEq, Serialize)]
pub struct DelaySummary {
    /// Since the data were published; none if nothing has arrived.
    pub published: Option<AgeSummary>,
    /// Since the messages' own stamps; none if they have none.
    pub stamp: Option<AgeSummary>,
    /// The error of the two clocks is at most this; none if it is not known.
    pub clock_error_s: Option<f64>,
    /// The data that the time follows; none if it is the registry's clock.
    pub clock: Option<String>,
    pub received: u64,
    pub lost: u64,
}

impl AgeWindow {
    /// Adds an age. One that is not finite, from a stamp that is none, is left out.
    pub fn add(&mut self, age_s: f64) {
        if age_s.is_finite() && self.ages_s.len() < MAX_AGES {
            self.ages_s.push(age_s);
        }
    }

    /// Sums up, and begins the next window.
    pub fn close(&mut self) -> Option<AgeSummary> {
        let mut ages_s = std::mem::take(&mut self.ages_s);
        ages_s.sort_by(f64::total_cmp);
        let max_s = *ages_s.last()?;
        // The smallest age that so many percent of the ages do not exceed.
        let rank = |percent: usize| ages_s[(ages_s.len() * percent).div_ceil(100).max(1) - 1];
        Some(AgeSummary {
            mean_s: ages_s.iter().sum::<f64>() / ages_s.len() as f64,
            p50_s: rank(50),
            p99_s: rank(99),
            max_s,
        })
    }
}

impl fmt::Display for AgeSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [mean, p50, p99, max] =
            [self.mean_s, self.p50_s, self.p99_s, self.max_s].map(format_short_time);
        write!(f, "mean {mean}  p50 {p50}  p99 {p99}  max {max}")
    }
}

impl fmt::Display for DelaySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.published, &self.clock) {
            (Some(published), _) => write!(f, "{published}")?,
            (None, Some(clock)) if self.received > 0 => write!(f, "{clock} has no time yet")?,
            (None, _) => f.write_str("nothing received")?,
        }
        match self.clock_error_s {
            Some(error_s) => write!(f, "  clock {}", format_short_time(error_s))?,
            None => f.write_str("  clock unknown")?,
        }
        write!(f, "  {} received", self.received)?;
        if self.lost > 0 {
            write!(f, ", {} lost", self.lost)?;
        }
        match &self.stamp {
            Some(stamp) => write!(f, "\n  since the stamp: {stamp}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(ages_s: impl IntoIterator<Item = f64>) -> Option<AgeSummary> {
        let mut window = AgeWindow::default();
        ages_s.into_iter().for_each(|age_s| window.add(age_s));
        window.close()
    }

    #[test]
    fn percentiles_are_ages_that_occurred() {
        let hundred = summary((1..=100).rev().map(f64::from)).expect("ages");
        assert_eq!((hundred.p50_s, hundred.p99_s, hundred.max_s), (50.0, 99.0, 100.0));
        assert!((hundred.mean_s - 50.5).abs() < 1e-9);
        let one = summary([f64::NAN, 0.25]).expect("one age");
        assert_eq!((one.mean_s, one.p50_s, one.p99_s, one.max_s), (0.25, 0.25, 0.25, 0.25));
        assert_eq!(summary([]), None);
    }

    #[test]
    fn a_line_fits_a_terminal_of_eighty_columns() {
        let mut shown = DelaySummary {
            published: summary([0.00021, 0.00045]),
            stamp: None,
            clock_error_s: Some(0.00003),
            clock: None,
            received: 1000,
            lost: 0,
        };
        let expected =
            "mean 330 us  p50 210 us  p99 450 us  max 450 us  clock 30 us  1000 received";
        assert_eq!(shown.to_string(), expected);
        assert!(expected.len() <= 80);
        (shown.stamp, shown.lost) = (summary([0.0123]), 4);
        let text = shown.to_string();
        let (first, second) = text.split_once('\n').expect("two lines");
        assert!(first.ends_with("1000 received, 4 lost"), "{first}");
        let expected = "  since the stamp: mean 12.3 ms  p50 12.3 ms  p99 12.3 ms  max 12.3 ms";
        assert_eq!(second, expected);
        shown = DelaySummary { published: None, stamp: None, clock_error_s: None, ..shown };
        assert!(shown.to_string().starts_with("nothing received  clock unknown"));
    }
}
