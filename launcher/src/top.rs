//! `armor top`: what the components of a running system use and do, once per second.
//!
//! [`collector`] observes the system and makes [`snapshot`]s; [`view`] is what the terminal shows and
//! what keys change; [`drawing`] draws it. The last two know no system and no terminal.

mod collector;
mod drawing;
mod known_rows;
mod launcher_link;
mod poller;
mod process_usage;
mod rates;
mod screen;
mod snapshot;
mod view;

use std::io::{self, IsTerminal};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;

use crate::arguments::{OutputFormat, RunningSystem, parse_duration};
use crate::exit::CommandEnding;
use crate::print::{end_printing, end_when_stdout_closes, print_line, terminal_width};
use crate::verb::Verb;
use collector::Collector;
use snapshot::SortKey;

/// Time within which every component should have answered twice.
const COMPLETE_WITHIN: Duration = Duration::from_secs(5);
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Show what the components of a running system use and do: processor, memory, rates, losses,
/// restarts, links, and the marking of the mission.
///
/// On a terminal it continues, and keys sort, filter, stop and restart components; without a terminal
/// it prints one table. It asks each component for its status once per second, in a system of more than
/// 40 less often, reads /proc for those on this host, and links to no data. A system that ends and is started again is followed.
#[derive(Args, Debug)]
#[command(
    after_help = "Keys: q quit, arrows select, s sort by the next column, d the other direction,
/ filter by name, l links or components, r restart and k stop the selected component (asks first)

Examples:
  armor top
  armor top --sort memory
  armor top --once                               one table
  armor top --format json | jq -c '.components'  one object per interval"
)]
pub struct TopArguments {
    /// Print one table and end, also on a terminal.
    #[arg(long)]
    once: bool,
    /// Time between two looks; at least 0.5s.
    #[arg(long, value_name = "TIME", value_parser = parse_interval, default_value = "1s")]
    interval: Duration,
    /// The column by which components are sorted.
    #[arg(long, value_enum, default_value_t, value_name = "COLUMN")]
    sort: SortKey,
    /// With --format json: stop after N lines.
    #[arg(long, short = 'n', value_name = "N")]
    count: Option<u64>,
    #[command(flatten)]
    running: RunningSystem,
}

fn parse_interval(text: &str) -> Result<Duration, String> {
    let interval = parse_duration(text)?;
    match interval >= Duration::from_millis(500) {
        true => Ok(interval),
        false => Err("at least 0.5s: components are asked once per second".into()),
    }
}

impl Verb for TopArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let collector = Collector::begin(&self.running)?;
        let ending = match format {
            OutputFormat::Json => print_lines(&self, collector),
            _ if self.once || !io::stdout().is_terminal() => print_once(&self, collector),
            _ => screen::show(collector, self.sort, self.interval),
        };
        Ok(ending?.into())
    }
}

/// Waits until the rates of all components are known, or long enough.
fn await_rates(collector: &mut Collector) {
    let start = Instant::now();
    while start.elapsed() < COMPLETE_WITHIN && !collector.look().has_all_rates() {
        thread::sleep(LOOK_EVERY);
    }
}

fn print_once(arguments: &TopArguments, mut collector: Collector) -> Result<CommandEnding> {
    await_rates(&mut collector);
    let mut snapshot = collector.look();
    snapshot.sort_by(arguments.sort, false);
    end_printing(print_line(snapshot.format(terminal_width()).trim_end()))
}

fn print_lines(arguments: &TopArguments, mut collector: Collector) -> Result<CommandEnding> {
    end_when_stdout_closes();
    await_rates(&mut collector);
    let count = if arguments.once { 1 } else { arguments.count.unwrap_or(u64::MAX) };
    let start = Instant::now();
    let mut print = || -> Result<()> {
        for number in 0..count {
            let due = arguments.interval * u32::try_from(number).unwrap_or(u32::MAX);
            thread::sleep(due.saturating_sub(start.elapsed()));
            let mut snapshot = collector.look();
            snapshot.sort_by(arguments.sort, false);
            print_line(serde_json::to_string(&snapshot)?)?;
        }
        Ok(())
    };
    end_printing(print())
}
