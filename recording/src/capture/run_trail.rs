//! What the run leaves in its folder while it is recorded: the lines of its logs, the journal of its
//! mission, and the versions of its file.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Duration;

use armor_inspect::log::LogLine;
use armor_sdk::messages::Log;

use super::followed_lines::FollowedLines;
use crate::taps::OwnOutputs;
use crate::trail::{JOURNAL, LOGS, RecordedDecision, make_log};

/// Time between two looks at the folder.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Bytes of the logs before the recording that are in it, as its context.
const LOG_TAIL_LEN: u64 = 64 << 10;
/// Most bytes of the logs that are recorded per look, 2.5 MB per second. Further lines are counted.
const MAX_LOG_LEN: usize = 256 << 10;
/// Most bytes of the journal per look, more than its length when it is cut.
const MAX_JOURNAL_LEN: usize = 64 << 20;
/// Longest file of a version that is recorded.
const MAX_FILE_LEN: u64 = 16 << 20;
/// The names in the folder of a run.
const LOG_FILE: &str = "logs/all.log";
const JOURNAL_FILE: &str = "executive.journal";
const VERSIONS: &str = "configd";
/// The file of a version that lists the others.
const INDEX: &str = "index";

/// The files of a version that came into force: its number, and names and bytes.
pub(crate) type VersionFiles = (u64, Vec<(String, Vec<u8>)>);

/// Follows the folder on a thread of its own.
pub(crate) struct RunTrail {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    versions: Receiver<VersionFiles>,
}

impl RunTrail {
    /// Begins with what is in the folder `out` of a run.
    ///
    /// # Errors
    /// If there is no thread.
    pub fn follow(out: &Path, outputs: OwnOutputs) -> std::io::Result<Self> {
        let is_over = Arc::new(AtomicBool::new(false));
        let (sender, versions) = mpsc::channel();
        let folder = TrailFolder::new(out, sender);
        let over = Arc::clone(&is_over);
        let run = move || folder.follow(&outputs, &over);
        let thread = std::thread::Builder::new().name("record-trail".into()).spawn(run)?;
        Ok(Self { is_over, thread: Some(thread), versions })
    }

    /// Returns a version that has come into force since the last call.
    pub fn take_version(&self) -> Option<VersionFiles> {
        self.versions.try_recv().ok()
    }

    /// Looks for the last time, and ends.
    pub fn finish(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic of it costs no more than its lines.
            let _ = thread.join();
        }
    }
}

struct TrailFolder {
    logs: FollowedLines,
    journal: FollowedLines,
    versions: PathBuf,
    known: BTreeSet<u64>,
    sender: Sender<VersionFiles>,
    sequences: [u64; 2],
}

impl TrailFolder {
    fn new(out: &Path, sender: Sender<VersionFiles>) -> Self {
        let versions = out.join(VERSIONS);
        Self {
            logs: FollowedLines::new(out.join(LOG_FILE), LOG_TAIL_LEN),
            journal: FollowedLines::new(out.join(JOURNAL_FILE), u64::MAX),
            known: list_versions(&versions),
            versions,
            sender,
            sequences: [0; 2],
        }
    }

    fn follow(mut self, outputs: &OwnOutputs, is_over: &AtomicBool) {
        loop {
            // What was written before the end belongs to the recording.
            let is_last = is_over.load(Ordering::Relaxed);
            self.look(outputs);
            if is_last {
                return;
            }
            std::thread::park_timeout(LOOK_EVERY);
        }
    }

    fn look(&mut self, outputs: &OwnOutputs) {
        let now_s = outputs.timestamp();
        let [log_sequence, journal_sequence] = &mut self.sequences;
        if outputs.is_recorded(LOGS) {
            let mut lines = Vec::new();
            let passed_over = self.logs.read_added(MAX_LOG_LEN, |line| {
                lines.push(LogLine::of_file(line));
            });
            let mut lost = passed_over;
            for LogLine { name, level, text, .. } in lines {
                let log = make_log(now_s, &name, &level, &text);
                outputs.push::<Log>(LOGS, &log, now_s, *log_sequence, 0);
                *log_sequence += 1;
            }
            if std::mem::take(&mut lost) > 0 {
                let text = format!("{passed_over} lines of the logs were too many to be recorded");
                let log = make_log(now_s, "recorder", "WARN", &text);
                *log_sequence += passed_over;
                outputs.push::<Log>(LOGS, &log, now_s, *log_sequence, passed_over);
                *log_sequence += 1;
            }
        }
        if outputs.is_recorded(JOURNAL) {
            self.journal.read_added(MAX_JOURNAL_LEN, |line| {
                let decision = RecordedDecision { stamp: now_s, line: line.into() };
                outputs.push(JOURNAL, &decision, now_s, *journal_sequence, 0);
                *journal_sequence += 1;
            });
        }
        let versions = list_versions(&self.versions);
        if self.known.is_empty() {
            // The first one is kept a moment after it is in force, and is in the file already.
            self.known = versions;
            return;
        }
        for number in versions {
            if self.known.insert(number) {
                let files = read_version(&self.versions.join(number.to_string()));
                // The recorder has ended otherwise.
                let _ = self.sender.send((number, files));
            }
        }
    }
}

fn list_versions(folder: &Path) -> BTreeSet<u64> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect()
}

/// The files of a version under the names that they have in the system's folder.
fn read_version(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let index = std::fs::read_to_string(folder.join(INDEX)).unwrap_or_default();
    let listed: Vec<_> = index.lines().filter_map(|line| line.split_once('\t')).collect();
    let base = listed.first().and_then(|(_, path)| Path::new(path).parent());
    let base = base.unwrap_or(Path::new(""));
    let mut files = Vec::new();
    for (name, path) in &listed {
        let path = Path::new(path);
        let shown = path.strip_prefix(base).ok().or(path.file_name().map(Path::new));
        let file = folder.join(name);
        let is_short = file.metadata().is_ok_and(|about| about.len() <= MAX_FILE_LEN);
        if let (Some(shown), true, Ok(bytes)) = (shown, is_short, std::fs::read(&file)) {
            files.push((shown.to_string_lossy().into_owned(), bytes));
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_version_has_the_names_of_its_files_in_the_folder_of_the_system() {
        let folder = tempfile::tempdir().unwrap();
        let version = folder.path().join("3");
        fs::create_dir(&version).unwrap();
        fs::write(version.join("index"), "1-a.xml\tm/a.xml\n2-b.xml\tm/parts/b.xml\n3-c\tz/c\n")
            .unwrap();
        for name in ["1-a.xml", "2-b.xml", "3-c"] {
            fs::write(version.join(name), name).unwrap();
        }
        let files = read_version(&version);
        let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["a.xml", "parts/b.xml", "c"]);
        assert_eq!(files[1].1, b"2-b.xml");
        assert_eq!(list_versions(folder.path()), BTreeSet::from([3]));
    }
}
