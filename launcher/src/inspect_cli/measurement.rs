//! What `armor hz`, `armor bw` and `armor delay` have in common: the data of one output are counted
//! as they arrive, and summed up in windows of one second. No message is decoded.

use std::fmt::Display;
use std::time::{Duration, Instant};

use anyhow::Result;
use armor_inspect::FollowingTap;
use armor_sdk::tap::TapData;
use clap::Args;
use serde::Serialize;

use super::silence::{NOTICE_AFTER, SilenceReporter};
use crate::arguments::{OutputFormat, RunningSystem, parse_data_name};
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
    #[command(flatten)]
    running: RunningSystem,
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

/// Prints one summary per window. `prepare` makes the measurement once the data are linked.
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
    let MeasuringArguments { data, count, running } = arguments;
    let mut following = super::follow_named(running, tool, data)?;
    let mut measurement = prepare(&following)?;
    let mut silence = SilenceReporter::new(running, tool, data);
    let start = Instant::now();
    let mut windows = 0;
    let mut has_data = false;
    let mut print = || -> Result<()> {
        while count.is_none_or(|count| windows < count) {
            let end = start + WINDOW * u32::try_from(windows + 1).unwrap_or(u32::MAX);
            let left = end.saturating_duration_since(Instant::now());
            if !left.is_zero() {
                if let Some(item) = following.next(left)? {
                    measurement.add(start.elapsed().as_secs_f64(), &item);
                    has_data = true;
                }
                continue;
            }
            let summary = measurement.close(start.elapsed().as_secs_f64());
            windows += 1;
            if !has_data && start.elapsed() >= NOTICE_AFTER {
                silence.report();
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
