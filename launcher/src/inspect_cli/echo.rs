//! `armor echo DATA`: data as it is published, as JSON whatever its type.

mod byte_lists;
pub mod csv;
mod fields;
mod pretty;

use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use armor_inspect::FollowingTap;
use armor_sdk::tap::TapData;
use armor_wire::schema::to_json;
use clap::Args;
use serde_json::{Value, json};

use super::silence::{NOTICE_AFTER, SilenceReporter};
use crate::arguments::{OutputFormat, RunningSystem, parse_data_name};
use crate::exit::CommandEnding;
use crate::print::{end_printing, end_when_stdout_closes, print_line, terminal_width};
use crate::verb::Verb;
use byte_lists::expand_byte_lists;
use csv::CsvTable;
use fields::select_fields;
use pretty::{MAX_ITEMS, format_pretty};

/// Print data as it is published.
///
/// A terminal shows it indented, and with long arrays and pictures shortened; a pipe or
/// `--format json` gets one complete JSON object per line.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor echo simulator.odometry                       as it comes
  armor echo mapper.map --once                        one message, its arrays shortened
  armor echo simulator.odometry --field pose.x --field pose.y
  armor echo simulator.odometry --csv > odometry.csv  one row per message
  armor echo simulator.scan --once --full             every element of its arrays")]
pub struct EchoArguments {
    /// Unique name of the data, COMPONENT.OUTPUT.
    #[arg(value_parser = parse_data_name)]
    pub data: String,
    /// Stop after N messages.
    #[arg(long, short = 'n', value_name = "N")]
    pub count: Option<u64>,
    /// Stop after one message.
    #[arg(long, conflicts_with = "count")]
    pub once: bool,
    /// Print this field alone, such as pose.x or ranges.0; may be given several times.
    #[arg(long = "field", value_name = "PATH")]
    pub fields: Vec<String>,
    /// Print comma-separated values: time, sequence, and the fields; by default all numbers and
    /// texts outside arrays.
    #[arg(long)]
    pub csv: bool,
    /// Print arrays with all elements on a terminal too.
    #[arg(long)]
    pub full: bool,
    #[command(flatten)]
    pub running: RunningSystem,
}

impl Verb for EchoArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_data(&self, format)?.into())
    }
}

/// Prints until enough was seen, or interrupted.
///
/// # Errors
/// If no component provides the data, or the system ends.
fn print_data(arguments: &EchoArguments, format: OutputFormat) -> Result<CommandEnding> {
    if arguments.csv && format == OutputFormat::Json {
        bail!("--csv and --format json exclude each other: choose one");
    }
    end_when_stdout_closes();
    let data = &arguments.data;
    let mut following = super::follow_named(&arguments.running, "echo", data)?;
    let mut silence = SilenceReporter::new(&arguments.running, "echo", data);
    let mut left = if arguments.once { 1 } else { arguments.count.unwrap_or(u64::MAX) };
    let mut printer = DataPrinter { arguments, format, csv: None };
    let mut print = || -> Result<()> {
        while left > 0 {
            let Some(item) = following.next(NOTICE_AFTER)? else {
                silence.report();
                continue;
            };
            printer.print(&following, &item)?;
            left -= 1;
        }
        Ok(())
    };
    end_printing(print())
}

struct DataPrinter<'a> {
    arguments: &'a EchoArguments,
    format: OutputFormat,
    /// Its columns are those of the first message.
    csv: Option<CsvTable>,
}

impl DataPrinter<'_> {
    fn print(&mut self, following: &FollowingTap, item: &TapData) -> Result<()> {
        let EchoArguments { data, fields, csv, full, .. } = self.arguments;
        let mut value = to_json(following.schema(), &item.payload)
            .with_context(|| format!("{data} does not fit its own schema"))?;
        if *csv {
            return self.print_row(item, &value);
        }
        let width = terminal_width().filter(|_| self.format != OutputFormat::Json);
        if width.is_some() && !*full {
            expand_byte_lists(following.schema(), &mut value, MAX_ITEMS);
        }
        let value = if fields.is_empty() { value } else { select_fields(&value, fields)? };
        let shown = json!({
            "data": data,
            "sequence": item.header.sequence,
            "stamp_s": item.header.stamp_s,
            "lost": item.lost,
            "value": value,
        });
        match width {
            Some(width) => print_line(format_pretty(&shown, width, *full)),
            None => print_line(shown),
        }
    }

    fn print_row(&mut self, item: &TapData, value: &Value) -> Result<()> {
        if self.csv.is_none() {
            let table = CsvTable::new(value, &self.arguments.fields)?;
            print_line(table.heading())?;
            self.csv = Some(table);
        }
        match &self.csv {
            Some(table) => print_line(table.row(item.header.stamp_s, item.header.sequence, value)),
            None => Ok(()),
        }
    }
}
