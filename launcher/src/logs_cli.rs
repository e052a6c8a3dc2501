//! `armor logs`: the logs of a run, merged by time.

mod entry;
mod followed_file;
mod recorded;

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use armor_inspect::run_control::{self, RunRequest};
use armor_inspect::systems::{self, RunRecord};
use armor_inspect::{CONFIGURATION, ObservedSystem};
use armor_robotfile::advise_similar;
use clap::Args;

use crate::arguments::{OutputFormat, RunningSystem, parse_duration};
use crate::date::format_date;
use crate::exit::CommandEnding;
use crate::print::{end_printing, end_when_stdout_closes, print_notice, print_text};
use crate::system;
use crate::verb::Verb;
use entry::{LeastLevel, LogEntry};
use followed_file::{FollowedLog, list_logs};

/// Lines with which `-f` begins.
const FOLLOWED_LINES: usize = 20;
/// Time between two looks at the files.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Looks at the files between two looks at whether the run still exists.
const LOOKS_PER_CHECK: u32 = 4;

/// Print the logs of a run, merged by time; `-f` continues with what is written.
///
/// Reads the files in the folder `logs` of the run: of the running system, with --out of any run of
/// this host, or from a recording.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor logs -n 50                            the last 50 lines of all processes
  armor logs -f --component mapper            what the mapper writes
  armor logs --level warn --since 10min       warnings and errors of the last ten minutes
  armor logs --out out/office --level error   the errors of a run that has ended
  armor logs drive.mcap --component mapper    what the mapper wrote while it was recorded
  armor log mapper debug                      lets the mapper write more")]
pub struct LogsArguments {
    /// A recording, whose lines are printed. Default: the run's files.
    #[arg(value_name = "RECORDING", conflicts_with_all = ["out", "system", "registry", "follow"])]
    recording: Option<PathBuf>,
    /// Continue with the lines that are written, until the run ends.
    #[arg(long, short)]
    follow: bool,
    /// Only lines of this level or above. Lines without a level count as info.
    #[arg(long, value_enum, value_name = "LEVEL")]
    level: Option<LeastLevel>,
    /// Only lines of this process or about it; may be given several times.
    #[arg(long = "component", value_name = "NAME")]
    components: Vec<String>,
    /// Only lines since then: a time before now, such as 10min, or a date in UTC, such as
    /// 2026-11-21T14:30:05.
    #[arg(long, value_name = "TIME", value_parser = parse_since)]
    since: Option<String>,
    /// Only the last N lines; with -f, 20 unless it is given.
    #[arg(long = "lines", short = 'n', value_name = "N")]
    lines: Option<usize>,
    /// The folder of a run, which may have ended.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["system", "registry"])]
    out: Option<PathBuf>,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for LogsArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(print_logs(&self, format)?.into())
    }
}

/// Reads a date, or a time before now; returns it as the beginning of a line has it.
fn parse_since(text: &str) -> Result<String, String> {
    if text.contains('T') {
        let is_date = text.parse::<armor_robotfile::Date>().is_ok()
            || format!("{text}Z").parse::<armor_robotfile::Date>().is_ok();
        return match is_date {
            // Dates of lines are compared as text, up to the length that is given.
            true => Ok(text.trim_end_matches('Z').to_owned()),
            false => Err("write a date in UTC as 2026-11-21T14:30:05".into()),
        };
    }
    let before = parse_duration(text)?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok(format_date(now.saturating_sub(before).as_secs_f64()))
}

/// What of the logs is printed, and how.
struct LogPrinter<'a> {
    arguments: &'a LogsArguments,
    format: OutputFormat,
}

impl LogPrinter<'_> {
    fn is_wanted(&self, entry: &LogEntry) -> bool {
        let LogsArguments { level, components, since, .. } = self.arguments;
        level.is_none_or(|least| entry.is_at_least(least))
            && (components.is_empty() || components.contains(&entry.name))
            && since.as_ref().is_none_or(|since| entry.date.as_str() >= since.as_str())
    }

    fn print(&self, entry: &LogEntry) -> Result<()> {
        match self.format {
            OutputFormat::Json => print_text(format_args!("{}\n", entry.to_json())),
            _ => print_text(format_args!("{entry}\n")),
        }
    }
}

/// Prints the lines, and continues with `-f` until the run ends.
///
/// # Errors
/// If no run is found, or it has no logs, or none of a component that is named.
fn print_logs(arguments: &LogsArguments, format: OutputFormat) -> Result<CommandEnding> {
    end_when_stdout_closes();
    if let Some(recording) = &arguments.recording {
        return end_printing(recorded::print_recorded(recording, arguments, format));
    }
    let (folder, record) = find_folder(arguments)?;
    check_components(&folder, arguments, record.as_ref())?;
    let printer = LogPrinter { arguments, format };
    let mut logs = FollowedLog::open(&folder, &arguments.components);
    let most = match arguments.lines {
        Some(lines) => lines,
        None if arguments.follow => FOLLOWED_LINES,
        None => usize::MAX,
    };
    let mut print = || -> Result<()> {
        let mut last = VecDeque::new();
        logs.read_written(|entry| {
            if !printer.is_wanted(&entry) {
                return Ok(());
            }
            if most == usize::MAX {
                return printer.print(&entry);
            }
            last.push_back(entry);
            if last.len() > most {
                last.pop_front();
            }
            Ok(())
        })?;
        last.iter().try_for_each(|entry| printer.print(entry))?;
        if !arguments.follow {
            return Ok(());
        }
        let mut looks = 0_u32;
        loop {
            thread::sleep(LOOK_EVERY);
            // Asked before the files are read: what was written before the end is not missed.
            looks += 1;
            let has_ended = looks.is_multiple_of(LOOKS_PER_CHECK) && !is_running(record.as_ref());
            logs.read_new(|entry| match printer.is_wanted(&entry) {
                true => printer.print(&entry),
                false => Ok(()),
            })?;
            if has_ended {
                print_notice("the run has ended");
                return Ok(());
            }
        }
    };
    end_printing(print())
}

/// Returns the folder of the logs, and the record of the run if it runs.
fn find_folder(arguments: &LogsArguments) -> Result<(PathBuf, Option<RunRecord>)> {
    let (out, record) = match &arguments.out {
        Some(out) => (out.clone(), find_record_of(out)),
        None => {
            let record = system::find_record(&arguments.running).context(
                "`armor logs --out DIR` prints those of a run that has ended, on its host",
            );
            let record = record.map_err(|error| {
                // The reason first, then the remedy.
                anyhow::anyhow!("{}; {error}", error.root_cause())
            })?;
            (record.resolve(&record.out), Some(record))
        }
    };
    let folder = out.join("logs");
    if !folder.is_dir() {
        bail!("{} has no folder `logs`: it is not the folder of a run", out.display());
    }
    Ok((folder, record))
}

/// Returns the record of the run that writes into the folder now.
fn find_record_of(out: &Path) -> Option<RunRecord> {
    let records = systems::list_running(&systems::record_directory().ok()?).ok()?;
    let own = out.canonicalize().ok()?;
    let is_it = |record: &RunRecord| {
        record.resolve(&record.out).canonicalize().is_ok_and(|other| other == own)
    };
    records.into_iter().find(is_it)
}

/// Returns whether the run still exists; one that was never found does not.
fn is_running(record: Option<&RunRecord>) -> bool {
    let Some(record) = record else { return false };
    let records = systems::record_directory().and_then(|folder| systems::list_running(&folder));
    records.is_ok_and(|records| records.iter().any(|other| other.pid == record.pid))
}

/// Refuses a component that has no log; with `-f` only if it is not of the run, which may wait for its
/// first line.
fn check_components(
    folder: &Path,
    arguments: &LogsArguments,
    record: Option<&RunRecord>,
) -> Result<()> {
    let known = list_logs(folder);
    let missing = arguments.components.iter().filter(|component| !known.contains(*component));
    for component in missing {
        if record.is_some_and(|record| is_of_run(record, component)) {
            if !arguments.follow {
                bail!("{component} has written nothing yet; `-f` waits for it");
            }
            print_notice(format!("{component} has written nothing yet; its first line is awaited"));
            continue;
        }
        let mut names = known.clone();
        names.extend(record.map(list_components).unwrap_or_default());
        let advice = advise_similar(component, names.iter().map(String::as_str));
        let names: Vec<_> = names.into_iter().collect();
        bail!("there is no log of {component}{advice} (there are: {})", names.join(", "));
    }
    Ok(())
}

/// Returns whether a run has a component or a daemon of this name, as its launcher knows.
fn is_of_run(record: &RunRecord, name: &str) -> bool {
    let request = RunRequest::History { component: name.into() };
    run_control::request(record, &request).is_ok_and(|reply| reply.accepted)
}

/// Returns the components of a run, as far as the registry and the launcher list them.
fn list_components(record: &RunRecord) -> Vec<String> {
    let observed = ObservedSystem::at(&record.registry.to_string(), "logs");
    let registered = observed.list().map(|listing| listing.components).unwrap_or_default();
    let mut names: Vec<_> = registered
        .into_iter()
        .filter(|entry| entry.name != CONFIGURATION)
        .map(|entry| entry.name)
        .collect();
    let absent = run_control::request(record, &RunRequest::List).map(|reply| reply.absent);
    names.extend(absent.unwrap_or_default().into_iter().map(|absent| absent.component));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beginning_is_a_date_or_a_time_before_now() {
        assert_eq!(parse_since("2026-11-21T14:30:05"), Ok("2026-11-21T14:30:05".into()));
        assert_eq!(parse_since("2026-11-21T14:30:05Z"), Ok("2026-11-21T14:30:05".into()));
        assert!(parse_since("2026-13-45T14:30:05").is_err());
        let hour = parse_since("1h").expect("a time");
        let minute = parse_since("1min").expect("a time");
        assert!(hour < minute && minute.ends_with('Z'), "{hour} {minute}");
        assert!(parse_since("yesterday").is_err());
    }
}
