//! `armor hz DATA`: the rate at which data is published, in windows of one second.

use std::process::ExitCode;

use anyhow::Result;
use armor_sdk::tap::TapData;
use clap::Args;
use serde::Serialize;

use super::measurement::{Measurement, MeasuringArguments, print_measurement};
use crate::arguments::OutputFormat;
use crate::verb::Verb;

/// Periods between the arrivals of one window.
#[derive(Debug, Default)]
struct RateWindow {
    arrivals_s: Vec<f64>,
    /// The last arrival of the window before, from which the first period counts.
    before_s: Option<f64>,
    /// The last period of all windows.
    last_period_s: Option<f64>,
    lost: u64,
}

/// The result of one window.
#[derive(Debug, PartialEq, Serialize)]
pub struct RateSummary {
    rate_hz: f64,
    period_min_s: Option<f64>,
    period_max_s: Option<f64>,
    period_std_s: Option<f64>,
    received: usize,
    lost: u64,
    /// The last period, also of an earlier window: a rate below 1 Hz has windows without a period.
    last_period_s: Option<f64>,
    /// Time since the last arrival at the end of the window.
    silent_s: Option<f64>,
}

/// Measure the rate at which data arrives, by this host's clock, also where the system's time runs
/// faster. Below 1 Hz the last interval is shown.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor hz simulator.scan              a line per second
  armor hz simulator.scan --count 5    the next five seconds
  armor hz simulator.scan --for 10s    one result over ten seconds")]
pub struct HzArguments {
    #[command(flatten)]
    measuring: MeasuringArguments,
}

impl Verb for HzArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let prepare = |_: &_| Ok(RateWindow::default());
        Ok(print_measurement(&self.measuring, "hz", format, prepare)?.into())
    }
}

impl Measurement for RateWindow {
    type Summary = RateSummary;

    fn add(&mut self, arrived_s: f64, item: &TapData) {
        self.add_arrival(arrived_s, item.lost);
    }

    fn close(&mut self, now_s: f64) -> RateSummary {
        self.close_window(now_s)
    }
}

impl RateWindow {
    fn add_arrival(&mut self, arrived_s: f64, lost: u64) {
        self.arrivals_s.push(arrived_s);
        self.lost += lost;
    }

    /// Sums up, and begins the next window.
    fn close_window(&mut self, now_s: f64) -> RateSummary {
        let arrivals_s = std::mem::take(&mut self.arrivals_s);
        let times: Vec<f64> = self.before_s.iter().chain(&arrivals_s).copied().collect();
        let periods: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        self.before_s = times.last().copied();
        self.last_period_s = periods.last().copied().or(self.last_period_s);
        let count = periods.len() as f64;
        let sum: f64 = periods.iter().sum();
        let mean = sum / count;
        let variance = periods.iter().map(|period| (period - mean).powi(2)).sum::<f64>() / count;
        let some = |value: f64| (!periods.is_empty()).then_some(value);
        RateSummary {
            // Over the periods, not the window: a window of 1 s cuts a rate of 0.7 Hz to 0 or 1.
            rate_hz: if sum > 0.0 { count / sum } else { 0.0 },
            period_min_s: some(periods.iter().copied().fold(f64::INFINITY, f64::min)),
            period_max_s: some(periods.iter().copied().fold(0.0, f64::max)),
            period_std_s: some(variance.sqrt()),
            received: arrivals_s.len(),
            lost: std::mem::take(&mut self.lost),
            last_period_s: self.last_period_s,
            silent_s: self.before_s.map(|before_s| now_s - before_s),
        }
    }
}

impl std::fmt::Display for RateSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ms = |seconds: Option<f64>| {
            seconds.map_or("      -".into(), |seconds| format!("{:7.2}", seconds * 1e3))
        };
        if self.period_min_s.is_none() {
            return match (self.last_period_s, self.silent_s) {
                (Some(period_s), Some(silent_s)) => write!(
                    f,
                    "{:8.2} Hz  last interval {period_s:.2} s, {silent_s:.1} s since the last data  \
                     {} received, {} lost",
                    // A longer silence already disproves the last interval.
                    1.0 / period_s.max(silent_s),
                    self.received,
                    self.lost
                ),
                (None, Some(silent_s)) => write!(
                    f,
                    "       - Hz  only one so far, {silent_s:.1} s ago  {} received, {} lost",
                    self.received, self.lost
                ),
                _ => f.write_str("       - Hz  nothing so far"),
            };
        }
        write!(
            f,
            "{:8.2} Hz  period {} to {} ms, std {} ms  {} received, {} lost",
            self.rate_hz,
            ms(self.period_min_s),
            ms(self.period_max_s),
            ms(self.period_std_s).trim_start(),
            self.received,
            self.lost
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_comes_from_periods_also_across_windows() {
        let mut window = RateWindow::default();
        window.add_arrival(0.5, 0);
        let first = window.close_window(1.0);
        assert_eq!((first.rate_hz, first.period_min_s, first.received), (0.0, None, 1));
        window.add_arrival(1.0, 2);
        window.add_arrival(1.5, 0);
        let second = window.close_window(2.0);
        assert_eq!((second.rate_hz, second.received, second.lost), (2.0, 2, 2));
        assert_eq!((second.period_min_s, second.period_std_s), (Some(0.5), Some(0.0)));
        assert_eq!(window.close_window(3.0).received, 0, "each window begins empty");
    }

    #[test]
    fn a_line_fits_a_terminal_of_eighty_columns() {
        let mut window = RateWindow::default();
        for number in 1..=1000 {
            window.add_arrival(f64::from(number) * 0.001, 0);
        }
        window.lost = 12;
        let text = window.close_window(1.0).to_string();
        assert!(text.contains("1000 received, 12 lost") && text.len() <= 80, "{text}");
        let mut window = RateWindow::default();
        for arrived_s in [0.1, 0.7, 0.9] {
            window.add_arrival(arrived_s, 0);
        }
        let text = window.close_window(1.0).to_string();
        let expected =
            "    2.50 Hz  period  200.00 to  600.00 ms, std 200.00 ms  3 received, 0 lost";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_rate_below_one_hertz_shows_its_last_interval() {
        let mut window = RateWindow::default();
        assert!(window.close_window(1.0).to_string().contains("nothing so far"));
        window.add_arrival(1.5, 0);
        let text = window.close_window(2.0).to_string();
        assert!(text.contains("only one so far, 0.5 s ago"), "{text}");
        window.add_arrival(5.5, 0);
        window.close_window(6.0);
        let text = window.close_window(7.0).to_string();
        assert!(text.contains("0.25 Hz  last interval 4.00 s, 1.5 s since"), "{text}");
        assert!(text.len() <= 80, "{text}");
        let text = window.close_window(15.5).to_string();
        assert!(text.contains("0.10 Hz  last interval 4.00 s, 10.0 s since"), "{text}");
    }
}
