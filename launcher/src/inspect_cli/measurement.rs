//! What `armor hz`, `armor bw` and `armor delay` have in common: the data of one output are counted
//! as they arrive, and summed up in windows of one second, or over a given time. No message is decoded.

use std::fmt::Display;
use std::time::{Duration, Instant};

use anyhow::Result;
use armor_inspect::FollowingTap;
use armor_sdk::tap::TapData;
use clap::Args;
use serde::Serialize;

use super::silence::{NOTICE_AFTER, SilenceReporter};
use crate::arguments::{OutputFormat, RunningSystem, parse_data_name, parse_duration};
use crate::exit::CommandEnding;
use crate::print::{end_printing, end_when_stdout_closes, print_line, print_wrapped};

const WINDOW: Duration = Duration::from_secs(1);

/// The arguments of a command that measures an output.
#[derive(Args, Debug)]
pub struct MeasuringArguments {
    /// Unique name of the data, COMPONENT.OUTPUT.
    #[arg(value_parser = parse_data_name)]
    data: String,
    /// Stop after N windows of one second; the exit code is 1 if nothing has arrived.
    #[arg(long, short = 'n', value_name = "N")]
    count: Option<u64>,
    /// Measure for this time, such as 10s, and print one result over all of it; the exit code is 1 if
    /// nothing has arrived.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_span, conflicts_with = "count")]
    duration: Option<Duration>,
    #[command(flatten)]
    running: RunningSystem,
}

/// Reads a time in which something can arrive.
fn parse_span(text: &str) -> Result<Duration, String> {
    parse_duration(text).and_then(|span| match span {
        Duration::ZERO => Err("nothing arrives in no time: write 10s, for example".into()),
        span => Ok(span),
    })
}

/// What is measured. Times are in seconds since the beginning.
pub trait Measurement {
    /// The result of one window.
    type Summary: Display + Serialize;

    /// Adds data that have arrived now.
    fn add(&mut self, arrived_s: f64, item: &TapData);

    /// Sums up the window that ends now, and begins the next.
    fn close(&mut self, now_s: f64) -> Self::Summary;
}

/// Prints one summary per window, or one over the given time. `prepare` makes the measurement once the data are linked.
///
/// # Errors
/// If no component provides the data, the system ends, or `prepare` fails.
pub fn print_measurement<M: Measurement>(
    arguments: &MeasuringArguments,
    tool: &str,
    format: OutputFormat,
    prepare: impl FnOnce(&FollowingTap) -> Result<M>,
) -> Result<CommandEnding> {
    end_when_stdout_closes();
    let MeasuringArguments { data, count, duration, running } = arguments;
    let (window, count) = match duration {
        Some(whole) => (*whole, Some(1)),
        None => (WINDOW, *count),
    };
    let mut following = super::follow_named(running, tool, data)?;
    let mut measurement = prepare(&following)?;
    let mut silence = SilenceReporter::new(running, tool, data);
    let start = Instant::now();
    let mut windows = 0;
    let mut has_data = false;
    let mut print = || -> Result<()> {
        while count.is_none_or(|count| windows < count) {
            let end = window.saturating_mul(u32::try_from(windows + 1).unwrap_or(u32::MAX));
            let left = end.saturating_sub(start.elapsed());
            if !left.is_zero() {
                // A long window is interrupted while nothing has arrived, to report the reason.
                if let Some(item) = following.next(left.min(NOTICE_AFTER))? {
                    measurement.add(start.elapsed().as_secs_f64(), &item);
                    has_data = true;
                } else if !has_data && start.elapsed() < end {
                    report_silence(&mut silence, start);
                }
                continue;
            }
            let summary = measurement.close(start.elapsed().as_secs_f64());
            windows += 1;
            if !has_data && count.is_none_or(|count| windows < count) {
                report_silence(&mut silence, start);
            }
            match format {
                OutputFormat::Json => print_line(serde_json::to_string(&summary)?)?,
                _ => print_wrapped(&summary)?,
            }
        }
        Ok(())
    };
    let printed = end_printing(print())?;
    if has_data {
        return Ok(printed);
    }
    silence.report_end();
    Ok(CommandEnding::Failed)
}

fn report_silence(silence: &mut SilenceReporter<'_>, start: Instant) {
    if start.elapsed() >= NOTICE_AFTER {
        silence.report();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measured_time_is_not_empty() {
        assert_eq!(parse_span("2s"), Ok(Duration::from_secs(2)));
        assert!(parse_span("0s").is_err_and(|text| text.contains("write 10s")));
        assert!(parse_span("2").is_err_and(|text| text.contains("a unit is missing")));
    }
}
