//! Records a running system into files: `armor record` and the component `recorder` are this.
//!
//! [`Recorder::begin`] finds the outputs and creates the file, [`Recorder::record_until`] writes what
//! is published, [`Recorder::finish`] completes the file.

mod beginning;
mod fault;
mod file_sink;
mod followed_lines;
mod free_space;
mod parameter_trail;
mod repeated_values;
mod run_trail;
mod split;

use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use armor_inspect::ObservedSystem;
use armor_inspect::systems::{self, RunRecord};
use armor_sdk::directory::DirectoryChange;

use crate::summary::BEGIN_KEY;
use crate::taps::{OutputSelection, OutputTaps, OwnOutputs};
use crate::writer::Compression;
use beginning::{describe_recording, find_begin, find_clock};
pub use fault::RecorderError;
use free_space::count_free_bytes;
pub(crate) use repeated_values::is_repeated;
use run_trail::RunTrail;
use split::SplitWriter;
pub use split::{RecordingPath, SplitLimits};

/// Below this, a recording ends in order, in bytes.
pub const LEAST_FREE: u64 = 256 << 20;
/// Time between two writes to the disk. A crash loses no more.
const FLUSH_EVERY: Duration = Duration::from_millis(500);
/// Time between two searches for new outputs.
const LIST_EVERY: Duration = Duration::from_millis(500);
/// A registry that is silent for this time has ended with its system.
const ENDED_AFTER: Duration = Duration::from_secs(5);
const NEXT_WITHIN: Duration = Duration::from_millis(20);
/// Messages between two looks at the time, while one follows the other.
const MESSAGES_PER_LOOK: u32 = 64;
/// After a process has come or gone, outputs are searched for as often as this, for this time: a
/// component provides them soon after it has registered.
const SEARCH_EVERY: Duration = Duration::from_millis(20);
const SEARCH_FOR: Duration = Duration::from_secs(1);

/// What is recorded, and where.
#[derive(Clone, Debug)]
pub struct RecorderOptions {
    /// Which outputs.
    pub selection: OutputSelection,
    /// The file.
    pub path: RecordingPath,
    /// How it is compressed.
    pub compression: Compression,
    /// When the next file begins.
    pub limits: SplitLimits,
    /// Stop after this time.
    pub duration: Option<Duration>,
    /// So many bytes are left on the disk.
    pub least_free: u64,
}

/// Why a recording ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingEnd {
    /// It was to end, or its time is over.
    Asked,
    /// The system has ended.
    SystemEnded,
    /// The disk is full.
    DiskFull,
}

/// What was recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordingReport {
    /// The files, in their order.
    pub files: Vec<PathBuf>,
    /// Their length.
    pub bytes: u64,
    /// Messages in them.
    pub messages: u64,
    /// Messages that were lost.
    pub lost: u64,
    /// Messages that do not have the layout of their type.
    pub unreadable: u64,
    /// How long it has taken.
    pub seconds: f64,
}

/// A recording that runs.
pub struct Recorder {
    taps: OutputTaps,
    own: OwnOutputs,
    trail: Option<RunTrail>,
    changes: Receiver<DirectoryChange>,
    record: Option<RunRecord>,
    options: RecorderOptions,
    folder: PathBuf,
    writer: SplitWriter,
    outputs: Vec<String>,
    begun: Instant,
    lost: u64,
}

impl Recorder {
    /// Begins to record a system. `record` is that of its run, if it runs on this host: without, the
    /// recording has no file of the system, no logs and no journal.
    ///
    /// # Errors
    /// If the registry does not answer, the file cannot be created, or the disk is full.
    pub fn begin(
        observed: &ObservedSystem,
        record: Option<RunRecord>,
        options: RecorderOptions,
    ) -> Result<Self, RecorderError> {
        let record = record.map(RunRecord::resolved);
        let directory = observed.directory();
        let changes = directory.watch_changes();
        let clock = find_clock(observed, record.as_ref());
        let begin_s = find_begin(observed, clock.as_deref());
        let mut taps = OutputTaps::new(directory.clone(), options.selection.clone(), clock)
            .map_err(RecorderError::Thread)?;
        let listed = taps.follow_outputs()?;
        let path = options.path.as_path();
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let free = count_free_bytes(&folder)?;
        if free < options.least_free {
            let least = options.least_free;
            return Err(RecorderError::DiskFull { path: path.into(), free, least });
        }
        let mut contents = describe_recording(record.as_ref(), options.compression);
        contents.about.extend(begin_s.map(|begin_s| (BEGIN_KEY.into(), begin_s.to_string())));
        let writer = SplitWriter::begin(options.path.clone(), contents, options.limits)?;
        let own = taps.own_outputs();
        let trail = record.as_ref().map(|record| RunTrail::follow(&record.out, own.clone()));
        let trail = trail.transpose().map_err(RecorderError::Thread)?;
        parameter_trail::follow_parameters(directory.clone(), own.clone())
            .map_err(RecorderError::Thread)?;
        Ok(Self {
            taps,
            own,
            trail,
            changes,
            record,
            options,
            folder,
            writer,
            outputs: listed.into_iter().map(|entry| entry.data).collect(),
            begun: Instant::now(),
            lost: 0,
        })
    }

    /// The outputs that there were at the beginning.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// The file that is being written.
    pub fn path(&self) -> &Path {
        self.writer.path()
    }

    /// Records until it is to end. `look` is called several times per second with the number of
    /// messages lost so far; it may change how much is left on the disk, and returns whether to
    /// continue.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn record_until(
        &mut self,
        mut look: impl FnMut(u64, &mut u64) -> bool,
    ) -> Result<RecordingEnd, RecorderError> {
        let now = Instant::now();
        let (mut flushed, mut listed, mut answered, mut changed) = (now, now, now, now);
        loop {
            let is_over = |most| self.begun.elapsed() >= most;
            if !look(self.lost, &mut self.options.least_free)
                || self.options.duration.is_some_and(is_over)
            {
                return Ok(RecordingEnd::Asked);
            }
            let mut wait = NEXT_WITHIN;
            for _ in 0..MESSAGES_PER_LOOK {
                let Some(message) = self.taps.next_message(wait) else { break };
                self.lost = self.lost.saturating_add(message.head.lost);
                self.writer.write(&message)?;
                wait = Duration::ZERO;
            }
            if flushed.elapsed() >= FLUSH_EVERY {
                flushed = Instant::now();
                self.add_versions()?;
                self.writer.flush(self.own.timestamp())?;
                if count_free_bytes(&self.folder)? < self.options.least_free {
                    return Ok(RecordingEnd::DiskFull);
                }
            }
            if self.changes.try_iter().count() > 0 {
                changed = Instant::now();
            }
            let is_searching = changed.elapsed() < SEARCH_FOR;
            if listed.elapsed() >= if is_searching { SEARCH_EVERY } else { LIST_EVERY } {
                listed = Instant::now();
                // Another system may have the address of its registry by now.
                if self.record.as_ref().is_some_and(has_ended) {
                    return Ok(RecordingEnd::SystemEnded);
                }
                match self.taps.follow_outputs() {
                    Ok(_) => answered = Instant::now(),
                    Err(_) if answered.elapsed() > ENDED_AFTER => {
                        return Ok(RecordingEnd::SystemEnded);
                    }
                    Err(_) => {}
                }
            }
        }
    }

    /// Completes the file. What has arrived belongs to it, and nothing that comes meanwhile.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<RecordingReport, RecorderError> {
        if let Some(trail) = &mut self.trail {
            trail.finish();
        }
        self.taps.stop();
        while let Some(message) = self.taps.next_message(Duration::ZERO) {
            self.lost = self.lost.saturating_add(message.head.lost);
            self.writer.write(&message)?;
        }
        self.add_versions()?;
        let (messages, unreadable) = (self.writer.written, self.writer.unreadable);
        let (files, bytes) = self.writer.finish()?;
        let seconds = self.begun.elapsed().as_secs_f64();
        Ok(RecordingReport { files, bytes, messages, lost: self.lost, unreadable, seconds })
    }

    fn add_versions(&mut self) -> Result<(), RecorderError> {
        while let Some((number, files)) = self.trail.as_ref().and_then(RunTrail::take_version) {
            self.writer.add_version(self.own.timestamp(), number, files)?;
        }
        Ok(())
    }
}

/// Whether the launcher of a run on this host has ended.
fn has_ended(record: &RunRecord) -> bool {
    let is_it =
        |running: &RunRecord| running.pid == record.pid && running.started_s == record.started_s;
    let running = systems::record_directory().and_then(|folder| systems::list_running(&folder));
    running.is_ok_and(|running| !running.iter().any(is_it))
}
