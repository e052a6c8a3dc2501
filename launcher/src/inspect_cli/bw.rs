//! `armor bw DATA`: the bytes per second that an output publishes, and the size of its messages.

use std::fmt;
use std::process::ExitCode;

use anyhow::Result;
use armor_inspect::words::format_bytes;
use armor_sdk::tap::TapData;
use clap::Args;
use serde::Serialize;

use super::measurement::{Measurement, MeasuringArguments, print_measurement};
use crate::arguments::OutputFormat;
use crate::verb::Verb;

/// Measure the bytes per second that an output publishes, and the size of its messages.
///
/// Bytes are those of the encoded messages, without the 32 bytes of header that each has on a link.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor bw camera.image              a line per second
  armor bw camera.image --count 5    the next five seconds
  armor bw camera.image --for 10s    one result over ten seconds")]
pub struct BwArguments {
    #[command(flatten)]
    measuring: MeasuringArguments,
}

impl Verb for BwArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let prepare = |_: &_| Ok(SizeWindow::default());
        Ok(print_measurement(&self.measuring, "bw", format, prepare)?.into())
    }
}

/// The sizes of the messages of one window.
#[derive(Debug, Default)]
struct SizeWindow {
    /// When the window began.
    begun_s: f64,
    bytes: u64,
    received: u64,
    smallest: Option<u64>,
    largest: Option<u64>,
    lost: u64,
}

/// The result of one window. Sizes are in bytes.
#[derive(Debug, PartialEq, Serialize)]
pub struct SizeSummary {
    bytes_per_s: f64,
    message_mean_bytes: Option<f64>,
    message_min_bytes: Option<u64>,
    message_max_bytes: Option<u64>,
    bytes: u64,
    received: u64,
    lost: u64,
}

impl Measurement for SizeWindow {
    type Summary = SizeSummary;

    fn add(&mut self, _: f64, item: &TapData) {
        self.add_message(item.payload.len() as u64, item.lost);
    }

    fn close(&mut self, now_s: f64) -> SizeSummary {
        let passed_s = now_s - self.begun_s;
        let Self { bytes, received, smallest, largest, lost, .. } =
            std::mem::replace(self, Self { begun_s: now_s, ..Self::default() });
        SizeSummary {
            bytes_per_s: if passed_s > 0.0 { bytes as f64 / passed_s } else { 0.0 },
            message_mean_bytes: (received > 0).then(|| bytes as f64 / received as f64),
            message_min_bytes: smallest,
            message_max_bytes: largest,
            bytes,
            received,
            lost,
        }
    }
}

impl SizeWindow {
    fn add_message(&mut self, len: u64, lost: u64) {
        self.bytes += len;
        self.received += 1;
        self.smallest = Some(self.smallest.map_or(len, |smallest| smallest.min(len)));
        self.largest = Some(self.largest.map_or(len, |largest| largest.max(len)));
        self.lost += lost;
    }
}

impl fmt::Display for SizeSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rate = format!("{}/s", format_bytes(self.bytes_per_s));
        let (Some(mean), Some(smallest), Some(largest)) =
            (self.message_mean_bytes, self.message_min_bytes, self.message_max_bytes)
        else {
            return write!(f, "{rate:>10}  nothing received");
        };
        let sizes = match smallest == largest {
            true => format!("messages of {}", format_bytes(mean)),
            false => format!(
                "messages of {}, {} to {}",
                format_bytes(mean),
                format_bytes(smallest as f64),
                format_bytes(largest as f64)
            ),
        };
        write!(f, "{rate:>10}  {sizes}  {} received, {} lost", self.received, self.lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_counted_over_the_time_that_has_passed() {
        let mut window = SizeWindow::default();
        for len in [100, 300] {
            window.add_message(len, 0);
        }
        let first = window.close(0.5);
        assert_eq!((first.bytes_per_s, first.received, first.bytes), (800.0, 2, 400));
        assert_eq!(
            (first.message_min_bytes, first.message_mean_bytes, first.message_max_bytes),
            (Some(100), Some(200.0), Some(300))
        );
        window.add_message(1000, 3);
        let second = window.close(2.5);
        assert_eq!((second.bytes_per_s, second.lost), (500.0, 3));
        assert_eq!(second.message_min_bytes, Some(1000), "each window begins empty");
        let empty = window.close(3.5);
        assert_eq!((empty.bytes_per_s, empty.message_mean_bytes), (0.0, None));
        assert_eq!(empty.to_string(), "     0 B/s  nothing received");
    }

    #[test]
    fn a_line_fits_a_terminal_of_eighty_columns() {
        let mut window = SizeWindow::default();
        for len in [812_345, 912_345_678] {
            window.add_message(len, 0);
        }
        (window.received, window.lost) = (1000, 12);
        let text = window.close(1.0).to_string();
        let expected = "  913 MB/s  messages of 913 kB, 812 kB to 912 MB  1000 received, 12 lost";
        assert_eq!(text, expected);
        window.add_message(96, 0);
        let text = window.close(2.0).to_string();
        assert_eq!(text, "    96 B/s  messages of 96 B  1 received, 0 lost");
    }
}
