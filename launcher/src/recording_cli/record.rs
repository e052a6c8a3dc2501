//! `armor record`: the data of a running system into a file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Result, bail};
use armor_inspect::ObservedSystem;
use armor_inspect::systems::{self, RunRecord};
use armor_recording::{BEGIN_KEY, Compression, OutputSelection, OutputTaps};
use armor_robotfile::advise_similar;
use armor_sdk::control::OutputStatus;
use armor_sdk::messages::Clock;
use armor_wire::codec;
use clap::{Args, ValueEnum};
use serde_json::json;

use super::format_len;
use super::free_space::{LEAST_FREE, count_free_bytes};
use super::split::{FileContents, SplitLimits, SplitWriter};
use crate::arguments::{OutputFormat, RunningSystem, parse_data_name, parse_duration, parse_name};
use crate::daemon::serving::watch_for_signals;
use crate::date::format_date;
use crate::exit::CommandEnding;
use crate::inspect_cli::select_system;
use crate::print::{print_line, print_notice};
use crate::system;
use crate::verb::Verb;

/// Time between two writes to the disk. A crash loses no more.
const FLUSH_EVERY: Duration = Duration::from_millis(500);
/// Time between two searches for new outputs.
const LIST_EVERY: Duration = Duration::from_millis(500);
/// A registry that is silent for so long has ended with its system.
const ENDED_AFTER: Duration = Duration::from_secs(5);
/// The data that time follows are latched, so that they come within this time if there are any.
const CLOCK_WITHIN: Duration = Duration::from_millis(200);
/// Shortest part of a recording that is a file of its own.
const LEAST_SPLIT: Duration = Duration::from_secs(1);
const NEXT_WITHIN: Duration = Duration::from_millis(20);
/// After a process has come or gone, outputs are searched for as often as this, for this time: a
/// component provides them soon after it has registered.
const SEARCH_EVERY: Duration = Duration::from_millis(20);
const SEARCH_FOR: Duration = Duration::from_secs(1);
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

/// Why a recording ends.
enum RecordEnd {
    Asked,
    SystemEnded,
    DiskFull,
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
    let changes = observed.directory().watch_changes();
    let selection =
        OutputSelection { include: arguments.data.clone(), exclude: arguments.exclude.clone() };
    let record = system::find_record(&arguments.running).ok();
    let clock = find_clock(&observed, record.as_ref());
    let begin_s = find_begin(&observed, clock.as_deref());
    let mut taps = OutputTaps::new(observed.directory().clone(), selection, clock);
    let listed = taps.follow_outputs()?;
    let known = || listed.iter().map(|entry| entry.data.as_str());
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
    let path = arguments.output.clone().unwrap_or_else(|| choose_path(record.as_ref()));
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    if count_free_bytes(&folder)? < LEAST_FREE {
        bail!("the disk of {} has less than {} left", path.display(), format_len(LEAST_FREE));
    }
    let mut contents = describe_recording(record.as_ref(), arguments.compress.into());
    contents.about.extend(begin_s.map(|begin_s| (BEGIN_KEY.into(), begin_s.to_string())));
    let limits = SplitLimits {
        len: arguments.split_len.map(|mb| mb.saturating_mul(1_000_000)),
        time: arguments.split_time,
    };
    let mut writer = SplitWriter::begin(path.clone(), contents, limits)?;
    print_notice(format!("recording into {}; Ctrl-C ends it", path.display()));
    let begun = Instant::now();
    let (mut flushed, mut listed, mut answered) = (begun, begun, begun);
    let mut changed = begun;
    let mut lost = 0_u64;
    let end = loop {
        if stopped.load(Ordering::Relaxed)
            || arguments.duration.is_some_and(|most| begun.elapsed() >= most)
        {
            break RecordEnd::Asked;
        }
        if let Some(message) = taps.next_message(NEXT_WITHIN) {
            lost = lost.saturating_add(message.head.lost);
            writer.write(&message)?;
        }
        if flushed.elapsed() >= FLUSH_EVERY {
            writer.flush()?;
            flushed = Instant::now();
            if count_free_bytes(&folder)? < LEAST_FREE {
                break RecordEnd::DiskFull;
            }
        }
        if changes.try_iter().count() > 0 {
            changed = Instant::now();
        }
        let search_every = if changed.elapsed() < SEARCH_FOR { SEARCH_EVERY } else { LIST_EVERY };
        if listed.elapsed() >= search_every {
            listed = Instant::now();
            // Another system may have the address of its registry by now.
            if record.as_ref().is_some_and(has_ended) {
                break RecordEnd::SystemEnded;
            }
            match taps.follow_outputs() {
                Ok(_) => answered = Instant::now(),
                Err(_) if answered.elapsed() > ENDED_AFTER => break RecordEnd::SystemEnded,
                Err(_) => {}
            }
        }
    };
    // What has arrived before the end belongs to it, and nothing that comes meanwhile.
    taps.stop();
    while let Some(message) = taps.next_message(Duration::ZERO) {
        lost = lost.saturating_add(message.head.lost);
        writer.write(&message)?;
    }
    let ((messages, _), unreadable) = (writer.count_written(), writer.unreadable);
    let (files, len) = writer.finish()?;
    let seconds = begun.elapsed().as_secs_f64();
    if format == OutputFormat::Json {
        let ending = match end {
            RecordEnd::Asked => "asked",
            RecordEnd::SystemEnded => "system-ended",
            RecordEnd::DiskFull => "disk-full",
        };
        print_line(json!({
            "files": files, "messages": messages, "lost": lost, "unreadable": unreadable,
            "bytes": len, "seconds": seconds, "end": ending,
        }))?;
    } else {
        let names: Vec<_> = files.iter().map(|file| file.display().to_string()).collect();
        print_line(format!(
            "{}: {messages} messages in {seconds:.1} s, {}, {lost} lost",
            names.join(", "),
            format_len(len)
        ))?;
        if unreadable > 0 {
            print_notice(format!("{unreadable} messages do not have the layout of their type"));
        }
    }
    Ok(match end {
        RecordEnd::DiskFull => {
            let least = format_len(LEAST_FREE);
            print_notice(format!(
                "the recording has ended because the disk has less than {least} left: make room, or \
                 record to another disk"
            ));
            CommandEnding::Failed
        }
        RecordEnd::SystemEnded => {
            print_notice("the system has ended");
            CommandEnding::Fine
        }
        RecordEnd::Asked => CommandEnding::Fine,
    })
}

/// Reads `COMPONENT.OUTPUT` or `COMPONENT.*`.
pub fn parse_selection(text: &str) -> Result<String, String> {
    match text.split_once('.') {
        Some((component, "*")) => parse_name(component).map(|_| text.into()),
        _ => parse_data_name(text)
            .map_err(|_| "write COMPONENT.OUTPUT, or COMPONENT.* for all of a component".into()),
    }
}

fn parse_split_time(text: &str) -> Result<Duration, String> {
    parse_duration(text).and_then(|time| {
        if time < LEAST_SPLIT { Err("a file has at least 1s".into()) } else { Ok(time) }
    })
}

/// The data that the time of a system follows, by its file, or by who links to it.
fn find_clock(observed: &ObservedSystem, record: Option<&RunRecord>) -> Option<String> {
    if let Some(record) = record {
        let configuration = armor_robotfile::load(&record.file).configuration?;
        return configuration.system.clock.map(|clock| clock.source.data());
    }
    let sightings = observed.ask_statuses().ok()?;
    let statuses = sightings.into_iter().filter_map(|sighting| sighting.status.ok());
    let mut outputs = statuses.flat_map(|status| status.outputs);
    let brings_time = |output: &OutputStatus| {
        output.links.iter().any(|link| {
            let process = link.to.split(':').next().unwrap_or_default();
            link.to == armor_sdk::time_link(process)
        })
    };
    outputs.find(brings_time).map(|output| output.data)
}

/// System time now; none if it follows data that have not been published yet.
fn find_begin(observed: &ObservedSystem, clock: Option<&str>) -> Option<f64> {
    let Some(clock) = clock else { return Some(observed.timestamp()) };
    let mut tap = observed.tap_within(clock, CLOCK_WITHIN).ok()?;
    let message = tap.next(CLOCK_WITHIN).ok()??;
    codec::decode::<Clock>(&message.payload).ok().map(|reading| reading.clock)
}

/// Whether the launcher of a run on this host has ended.
fn has_ended(record: &RunRecord) -> bool {
    let is_it =
        |running: &RunRecord| running.pid == record.pid && running.started_s == record.started_s;
    let running = systems::record_directory().and_then(|folder| systems::list_running(&folder));
    running.is_ok_and(|running| !running.iter().any(is_it))
}

fn describe_recording(record: Option<&RunRecord>, compression: Compression) -> FileContents {
    let mut about = BTreeMap::from([
        ("armor".into(), env!("CARGO_PKG_VERSION").into()),
        ("begun".into(), format_date(seconds_since_1970())),
        ("host".into(), armor_socket::host_name()),
    ]);
    let mut files = Vec::new();
    if let Some(record) = record {
        about.insert("system".into(), record.system.clone());
        about.insert("file".into(), record.file.display().to_string());
        let folder = record.file.parent().unwrap_or(Path::new(""));
        // The file itself first, then what it includes; one that is elsewhere has its name alone.
        for path in armor_robotfile::load(&record.file).files {
            let name = path.strip_prefix(folder).ok().or(path.file_name().map(Path::new));
            if let (Some(name), Ok(bytes)) = (name, std::fs::read(&path)) {
                files.push((name.to_string_lossy().into_owned(), bytes));
            }
        }
    }
    FileContents { about, files, compression }
}

fn choose_path(record: Option<&RunRecord>) -> PathBuf {
    let system = record.map_or("recording", |record| &record.system);
    let date = format_date(seconds_since_1970());
    let digits: String = date.chars().take(19).filter(|c| *c != '-' && *c != ':').collect();
    format!("{system}-{digits}.mcap").into()
}

fn seconds_since_1970() -> f64 {
    SystemTime::UNIX_EPOCH.elapsed().map_or(0.0, |passed| passed.as_secs_f64())
}
