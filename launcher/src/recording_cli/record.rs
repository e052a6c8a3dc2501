//! `armor record`: the data of a running system into a file.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, SystemTime};

use anyhow::Result;
use armor_inspect::systems::RunRecord;
use armor_recording::capture::{
    LEAST_FREE, Recorder, RecorderOptions, RecordingEnd, RecordingPath, SplitLimits,
};
use armor_recording::{Compression, OutputSelection};
use armor_robotfile::advise_similar;
use clap::{Args, ValueEnum};
use serde_json::json;

use super::format_len;
use crate::arguments::{OutputFormat, RunningSystem, parse_duration};
use crate::daemon::serving::watch_for_signals;
use crate::date::format_date;
use crate::exit::CommandEnding;
use crate::inspect_cli::select_system;
use crate::print::{print_line, print_notice};
use crate::system;
use crate::verb::Verb;

/// Shortest part of a recording that is a file of its own.
const LEAST_SPLIT: Duration = Duration::from_secs(1);
/// Time between two searches for a system that does not run yet.
const WAIT_EVERY: Duration = Duration::from_millis(20);

/// Record the data of a running system into an MCAP file.
///
/// All outputs are recorded, also those that appear later, with the file of the system. What the
/// recorder loses because it is slower than the data is counted in the file. It disturbs no
/// component.
#[derive(Args, Debug)]
#[command(after_help = "Ctrl-C, SIGTERM, --for and the end of the system complete the file, with \
exit code 0. After a crash at most a second is missing; armor bag recover completes the file.

Examples:
  armor record                                  everything, into SYSTEM-DATE.mcap
  armor record 'simulator.*' mapper.pose -o drive.mcap
  armor record --exclude camera.image --for 1min
  armor record --wait                           before armor run: from the beginning
  armor record --split-len 1000 --compress zstd")]
pub struct RecordArguments {
    /// What is recorded: COMPONENT.OUTPUT, or COMPONENT.* for all of a component. Default: all.
    #[arg(value_name = "DATA", value_parser = parse_selection)]
    pub data: Vec<String>,
    /// What is left out, written the same way; may be given several times.
    #[arg(long, value_name = "DATA", value_parser = parse_selection)]
    pub exclude: Vec<String>,
    /// Wait for a system that does not run yet, and record it from its beginning.
    #[arg(long)]
    pub wait: bool,
    /// File to write, which must not be there yet. Default: SYSTEM-DATE.mcap
    #[arg(long, short = 'o', value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// How the file is compressed.
    #[arg(long, value_enum, default_value_t, value_name = "HOW")]
    pub compress: RecordCompression,
    /// Stop after this time, such as 30s.
    #[arg(long = "for", value_parser = parse_duration, value_name = "TIME")]
    pub duration: Option<Duration>,
    /// Begin another file when the present one has so many megabytes.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..))]
    pub split_len: Option<u64>,
    /// Begin another file after this time, such as 10min.
    #[arg(long, value_parser = parse_split_time, value_name = "TIME")]
    pub split_time: Option<Duration>,
    #[command(flatten)]
    pub running: RunningSystem,
}

/// How a recording is compressed.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum RecordCompression {
    /// Not at all: the least work
    None,
    /// A little work
    #[default]
    Lz4,
    /// The smallest file
    Zstd,
}

impl From<RecordCompression> for Compression {
    fn from(compression: RecordCompression) -> Self {
        match compression {
            RecordCompression::None => Self::None,
            RecordCompression::Lz4 => Self::Lz4,
            RecordCompression::Zstd => Self::Zstd,
        }
    }
}

impl Verb for RecordArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(record_system(&self, format)?.into())
    }
}

fn record_system(arguments: &RecordArguments, format: OutputFormat) -> Result<CommandEnding> {
    let stopped = watch_for_signals()?;
    if arguments.wait {
        print_notice("waiting for a system; Ctrl-C ends it");
        while system::find_registry(&arguments.running).is_err() {
            if stopped.load(Ordering::Relaxed) {
                return Ok(CommandEnding::Interrupted);
            }
            std::thread::sleep(WAIT_EVERY);
        }
    }
    let observed = select_system(&arguments.running, "record")?;
    let record = system::find_record(&arguments.running).ok();
    let mut recorder = Recorder::begin(&observed, record.clone(), arguments.options(record))?;
    let known = || recorder.outputs().iter().map(String::as_str);
    for name in OutputSelection::find_missing(&arguments.data, known()) {
        let advice = advise_similar(name, known());
        print_notice(format!(
            "there is no {name} yet, and it is recorded when there is one{advice}"
        ));
    }
    for name in OutputSelection::find_missing(&arguments.exclude, known()) {
        let advice = advise_similar(name, known());
        print_notice(format!("there is no {name} to leave out{advice}"));
    }
    print_notice(format!("recording into {}; Ctrl-C ends it", recorder.path().display()));
    let end = recorder.record_until(|_, _| !stopped.load(Ordering::Relaxed))?;
    let report = recorder.finish()?;
    if format == OutputFormat::Json {
        let ending = match end {
            RecordingEnd::Asked => "asked",
            RecordingEnd::SystemEnded => "system-ended",
            RecordingEnd::DiskFull => "disk-full",
        };
        print_line(json!({
            "files": report.files, "messages": report.messages, "lost": report.lost,
            "unreadable": report.unreadable, "bytes": report.bytes, "seconds": report.seconds,
            "end": ending,
        }))?;
    } else {
        let names: Vec<_> = report.files.iter().map(|file| file.display().to_string()).collect();
        print_line(format!(
            "{}: {} messages in {:.1} s, {}, {} lost",
            names.join(", "),
            report.messages,
            report.seconds,
            format_len(report.bytes),
            report.lost
        ))?;
        if report.unreadable > 0 {
            let count = report.unreadable;
            print_notice(format!("{count} messages do not have the layout of their type"));
        }
    }
    Ok(match end {
        RecordingEnd::DiskFull => {
            let least = format_len(LEAST_FREE);
            print_notice(format!(
                "the recording has ended because the disk has less than {least} left: make room, or \
                 record to another disk"
            ));
            CommandEnding::Failed
        }
        RecordingEnd::SystemEnded => {
            print_notice("the system has ended");
            CommandEnding::Fine
        }
        RecordingEnd::Asked => CommandEnding::Fine,
    })
}

impl RecordArguments {
    fn options(&self, record: Option<RunRecord>) -> RecorderOptions {
        let path = self.output.clone().unwrap_or_else(|| choose_path(record.as_ref()));
        RecorderOptions {
            selection: OutputSelection {
                include: self.data.clone(),
                exclude: self.exclude.clone(),
            },
            path: RecordingPath::New(path),
            compression: self.compress.into(),
            limits: SplitLimits {
                len: self.split_len.map(|mb| mb.saturating_mul(1_000_000)),
                time: self.split_time,
            },
            duration: self.duration,
            least_free: LEAST_FREE,
        }
    }
}

/// Reads `COMPONENT.OUTPUT` or `COMPONENT.*`.
pub fn parse_selection(text: &str) -> Result<String, String> {
    OutputSelection::check_name(text).map(|()| text.into())
}

fn parse_split_time(text: &str) -> Result<Duration, String> {
    parse_duration(text).and_then(|time| {
        if time < LEAST_SPLIT { Err("a file has at least 1s".into()) } else { Ok(time) }
    })
}

fn choose_path(record: Option<&RunRecord>) -> PathBuf {
    let system = record.map_or("recording", |record| &record.system);
    let now_s = SystemTime::UNIX_EPOCH.elapsed().map_or(0.0, |passed| passed.as_secs_f64());
    let date = format_date(now_s);
    let digits: String = date.chars().take(19).filter(|c| *c != '-' && *c != ':').collect();
    format!("{system}-{digits}.mcap").into()
}
