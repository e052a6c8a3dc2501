//! `armor echo DATA`: data as it is published, as JSON whatever its type.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_wire::schema::to_json;
use clap::Args;
use serde_json::json;

use crate::arguments::{OutputFormat, RunningSystem, parse_data_name};
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line};
use crate::verb::Verb;

/// Longest wait for data before the link is checked; data arrive without delay.
const LOOK_EVERY: Duration = Duration::from_secs(3600);

/// Print data as it is published.
#[derive(Args, Debug)]
pub struct EchoArguments {
    /// Unique name of the data, COMPONENT.OUTPUT.
    #[arg(value_parser = parse_data_name)]
    pub data: String,
    /// Stop after N messages.
    #[arg(long, short = 'n', value_name = "N")]
    pub count: Option<u64>,
    #[command(flatten)]
    pub running: RunningSystem,
}

impl Verb for EchoArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        Ok(print_data(&self)?.into())
    }
}

/// Prints until enough was seen, or interrupted.
///
/// # Errors
/// If no component provides the data, or the system ends.
fn print_data(arguments: &EchoArguments) -> Result<CommandEnding> {
    let data = &arguments.data;
    let observed = super::select_system(&arguments.running, "echo")?;
    let mut following = super::follow_data(observed, data)?;
    let mut left = arguments.count.unwrap_or(u64::MAX);
    let mut print = || -> Result<()> {
        while left > 0 {
            let Some(item) = following.next(LOOK_EVERY)? else { continue };
            let value = to_json(following.schema(), &item.payload)
                .with_context(|| format!("{data} does not fit its own schema"))?;
            print_line(json!({
                "data": data,
                "sequence": item.header.sequence,
                "stamp_s": item.header.stamp_s,
                "lost": item.lost,
                "value": value,
            }))?;
            left -= 1;
        }
        Ok(())
    };
    end_printing(print())
}
