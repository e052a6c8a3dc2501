//! The journal on disk: one JSON object per line, synced before it is acted upon.
//!
//! A line that a crash cut off was never acted upon, and is dropped when the journal is opened
//! again. The first line of every life of the executive holds the state of its clock, so that
//! timeouts keep running through a restart of the process; after a restart of the machine, time
//! continues from the last record. A journal that has grown long is cut: one snapshot record
//! replaces those before it. An executive that is killed at any moment leaves the old journal or
//! the new one, whole.

use crate::record::{JournalEntry, JournalRecord};
use armor_files::{Durability, PendingFile, SaveError, open_own_file};
use armor_plan::Version;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest journal that is read back, far beyond what is cut.
const MAX_LEN: u64 = 1 << 30;
/// When a journal is cut, in bytes: some fifty thousand firings, read back in a second.
pub const CUT_AT: u64 = 16 << 20;

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The operating system reports an error.
    #[error("journal {path}: {error}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What.
        error: io::Error,
    },
    /// A line in its middle is not a record.
    #[error("journal {path}: line {line} is not a record: {error}")]
    Line {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What.
        error: serde_json::Error,
    },
    /// The journal is longer than 1 GiB, far beyond the length at which it is cut.
    #[error("journal {0} is longer than 1 GiB; move it away to begin the mission again")]
    TooLong(PathBuf),
}

/// The state of the clock in one life of the executive, from its start to its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Life {
    /// Names the machine's start; monotonic clocks of one start can be compared.
    pub boot: String,
    /// The machine's monotonic clock at mission time 0, in nanoseconds; below 0 if the mission is
    /// older than the machine's start.
    pub zero_ns: i64,
    /// The data that mission time follows; `None` if it follows this clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor: Option<Anchor>,
}

/// Ties mission time to the data that it follows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The process start that provides the data.
    pub instance: u64,
    /// The stamp of the data, in seconds.
    pub stamp_s: f64,
    /// The mission time at that stamp, in nanoseconds.
    pub at_ns: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum JournalLine {
    Life { life: Life },
    Record(JournalRecord),
}

/// A journal, open for writing.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    unsynced: bool,
    /// Its length, in bytes.
    len: u64,
    /// Its length after the last cut, or 0.
    cut_len: u64,
}

/// The content of a journal.
#[derive(Debug, Default)]
pub struct Story {
    /// Everything decided so far.
    pub records: Vec<JournalRecord>,
    /// The last life of the executive, if there was one.
    pub life: Option<Life>,
}

impl Story {
    /// Whether a mission has begun in it and is not over.
    pub fn is_unfinished(&self) -> bool {
        let last = self.records.last();
        last.is_some_and(|record| !matches!(record.entry, JournalEntry::Ended { .. }))
    }

    /// Whether it is empty: it does not even hold the line that [`rest`] writes.
    pub fn is_blank(&self) -> bool {
        self.records.is_empty() && self.life.is_none()
    }

    /// How many records were ever written, including those that a snapshot has replaced.
    pub fn count_records(&self) -> u64 {
        match self.records.first() {
            Some(JournalRecord { entry: JournalEntry::Snapshot(snapshot), .. }) => {
                snapshot.records + self.records.len() as u64 - 1
            }
            _ => self.records.len() as u64,
        }
    }
}

/// Reads a journal without changing it; an executive may be writing to it.
///
/// # Errors
/// If it cannot be read, or is not a journal.
pub fn read(path: &Path) -> Result<Story, JournalError> {
    let failed = |error| JournalError::Io { path: path.to_owned(), error };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(MAX_LEN + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_LEN {
        return Err(JournalError::TooLong(path.to_owned()));
    }
    parse(path, &bytes[..whole_len(&bytes)])
}

/// Notes that no executive runs until the next life begins; time then continues from the last
/// record. Creates the journal if it is missing, so that one missing later is known to be lost.
///
/// # Errors
/// If it cannot be read or written, or is not a journal.
pub fn rest(path: &Path) -> Result<(), JournalError> {
    let (mut journal, _) = Journal::open(path)?;
    // No start of the machine has an empty name, so the next life continues from the last record.
    journal.begin(Life { boot: String::new(), zero_ns: 0, anchor: None })?;
    journal.sync()
}

/// Returns the length up to the end of the last complete line.
fn whole_len(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1)
}

impl Journal {
    /// Opens or creates a journal and reads it.
    ///
    /// # Errors
    /// If it cannot be read or written, or is not a journal.
    pub fn open(path: &Path) -> Result<(Self, Story), JournalError> {
        let failed = |error| JournalError::Io { path: path.to_owned(), error };
        let mut file =
            open_own_file(path, OpenOptions::new().read(true).write(true)).map_err(failed)?;
        if file.metadata().map_err(failed)?.len() > MAX_LEN {
            return Err(JournalError::TooLong(path.to_owned()));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let whole = whole_len(&bytes);
        let story = parse(path, &bytes[..whole])?;
        // Remove an incomplete last line, so that the next record starts on a line of its own.
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::Start(whole as u64)).map_err(failed)?;
        file.sync_all().map_err(failed)?;
        sync_folder(path).map_err(failed)?;
        let (path, len) = (path.to_owned(), whole as u64);
        Ok((Self { file, path, unsynced: false, len, cut_len: 0 }, story))
    }

    /// Whether it is longer than `limit` bytes, and much longer than it has to be.
    pub fn is_longer_than(&self, limit: u64) -> bool {
        // Otherwise a snapshot longer than `limit` would be written again after every event.
        self.len > limit && self.len > 2 * self.cut_len
    }

    /// Replaces the content by `record`, a snapshot of all that was decided. It is on disk
    /// afterwards.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn cut(&mut self, life: Life, record: JournalRecord) -> Result<(), JournalError> {
        let mut text = Vec::new();
        for line in [JournalLine::Life { life }, JournalLine::Record(record)] {
            serde_json::to_writer(&mut text, &line).map_err(|e| self.failed(e.into()))?;
            text.push(b'\n');
        }
        let write = || {
            let mut pending = PendingFile::create_private(&self.path)?;
            pending.write(&text)?;
            pending.commit(Durability::Synced)
        };
        self.file = write().map_err(|error: SaveError| self.failed(error.reason))?;
        (self.len, self.cut_len, self.unsynced) = (text.len() as u64, text.len() as u64, false);
        Ok(())
    }

    /// Writes where the clock of this life stands.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(&mut self, life: Life) -> Result<(), JournalError> {
        self.line(&JournalLine::Life { life })
    }

    /// Adds a record; it is on disk after [`Self::sync`].
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, record: JournalRecord) -> Result<(), JournalError> {
        self.line(&JournalLine::Record(record))
    }

    /// Waits until all that was written is on disk.
    ///
    /// # Errors
    /// If it is not.
    pub fn sync(&mut self) -> Result<(), JournalError> {
        if std::mem::take(&mut self.unsynced) {
            self.file.sync_data().map_err(|error| self.failed(error))?;
        }
        Ok(())
    }

    fn line(&mut self, line: &JournalLine) -> Result<(), JournalError> {
        let mut text = serde_json::to_vec(line).map_err(|e| self.failed(io::Error::other(e)))?;
        text.push(b'\n');
        self.unsynced = true;
        self.len += text.len() as u64;
        self.file.write_all(&text).map_err(|error| self.failed(error))
    }

    fn failed(&self, error: io::Error) -> JournalError {
        JournalError::Io { path: self.path.clone(), error }
    }
}

/// Syncs the folder of a file: without that a crash may lose the name of a new file.
fn sync_folder(path: &Path) -> io::Result<()> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => File::open(folder)?.sync_all(),
        None => File::open(".")?.sync_all(),
    }
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Story, JournalError> {
    let mut story = Story::default();
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        if line.is_empty() {
            continue;
        }
        let wrong = |error| JournalError::Line { path: path.to_owned(), line: index + 1, error };
        match serde_json::from_slice(line).map_err(wrong)? {
            JournalLine::Life { life } => story.life = Some(life),
            JournalLine::Record(record) => story.records.push(record),
        }
    }
    Ok(story)
}

/// Returns the version of the file that a journal began with, if the journal holds it.
pub fn began_with(records: &[JournalRecord]) -> Option<&Version> {
    match &records.first()?.entry {
        JournalEntry::Began { version, .. } if !version.files.is_empty() => Some(version),
        JournalEntry::Snapshot(it) if !it.began.files.is_empty() => Some(&it.began),
        _ => None,
    }
}

/// Returns the life that begins now, and the mission time. `monotonic` is the machine's monotonic
/// clock, `boot` names the machine's start.
///
/// In the same start of the machine, the time since the last record counts. After another start the
/// clock readings cannot be compared, so mission time continues from the last record.
pub fn clock(story: &Story, boot: &str, monotonic: Duration) -> (Life, Duration) {
    let last = story.records.last().map_or(Duration::ZERO, |record| record.at);
    let zero_ns = match &story.life {
        Some(life) if life.boot == boot && life.anchor.is_none() => life.zero_ns,
        _ => signed(monotonic) - signed(last),
    };
    let now = Duration::from_nanos(u64::try_from(signed(monotonic) - zero_ns).unwrap_or(0));
    (Life { boot: boot.to_owned(), zero_ns, anchor: None }, now.max(last))
}

/// As [`clock`], where mission time follows data: it continues from the last record, or from the
/// anchor of the last life if the source of the data has not been restarted.
pub fn followed_clock(story: &Story, boot: &str, monotonic: Duration) -> (Life, Duration) {
    let last = story.records.last().map_or(Duration::ZERO, |record| record.at);
    let anchor = story.life.as_ref().and_then(|life| life.anchor);
    (Life { boot: boot.to_owned(), zero_ns: signed(monotonic), anchor }, last)
}

fn signed(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terms::{Cause, ComponentReport, GuardTurned, MissionOutcome, Tokens, ValueSet};

    fn records() -> Vec<JournalRecord> {
        let tokens = vec![Tokens { place: "p".to_owned(), tokens: 2 }];
        let entries = [
            JournalEntry::Began {
                mission: "m".to_owned(),
                fingerprint: "f".to_owned(),
                version: Version::default(),
            },
            JournalEntry::Took {
                firing: 1,
                cause: Cause::Transition("t".to_owned()),
                from: tokens.clone(),
                to: tokens,
                late_s: 0.5,
                sets: vec![ValueSet { variable: "n".to_owned(), value: -2 }],
                guards: vec![GuardTurned { transition: "u".to_owned(), holds: true }],
            },
            JournalEntry::Heard {
                component: "c".to_owned(),
                instance: u64::MAX,
                serial: 3,
                report: ComponentReport::Event { name: "seen".to_owned(), value: 2.0 },
            },
            JournalEntry::Put { firing: 1 },
        ];
        let at = |index: u64| Duration::from_nanos(index * 1_000_000_007);
        (0..).zip(entries).map(|(index, entry)| JournalRecord { at: at(index), entry }).collect()
    }

    #[test]
    fn what_was_written_is_read_and_a_torn_line_is_cut_off() {
        let folder = std::env::temp_dir().join(format!("armor-journal-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("torn.jsonl");
        let _ = std::fs::remove_file(&path);
        let (mut journal, story) = Journal::open(&path).unwrap();
        assert!(story.records.is_empty() && story.life.is_none());
        let life = Life {
            boot: "b".to_owned(),
            zero_ns: -5,
            anchor: Some(Anchor { instance: u64::MAX, stamp_s: 1.5, at_ns: 3 }),
        };
        journal.begin(life.clone()).unwrap();
        records().into_iter().for_each(|record| journal.write(record).unwrap());
        journal.sync().unwrap();
        let whole = std::fs::read(&path).unwrap();
        let mut torn = whole.clone();
        torn.extend(b"{\"at_ns\":12,\"entry\":\"pu");
        std::fs::write(&path, &torn).unwrap();
        assert_eq!(read(&path).unwrap().records, records());
        assert_eq!(std::fs::read(&path).unwrap(), torn, "reading changes nothing");
        let (_, story) = Journal::open(&path).unwrap();
        assert_eq!((story.records, story.life), (records(), Some(life)));
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        std::fs::write(&path, b"nonsense\n").unwrap();
        assert!(matches!(Journal::open(&path), Err(JournalError::Line { line: 1, .. })));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_journal_laid_to_rest_continues_from_its_last_record() {
        let folder = std::env::temp_dir().join(format!("armor-rest-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("rest.jsonl");
        let _ = std::fs::remove_file(&path);
        rest(&path).unwrap();
        let story = read(&path).unwrap();
        assert!(!story.is_blank() && !story.is_unfinished(), "nothing has begun");
        let second = Duration::from_secs(1);
        assert_eq!(clock(&story, "boot", 100 * second).1, Duration::ZERO);

        let (mut journal, story) = Journal::open(&path).unwrap();
        journal.begin(clock(&story, "boot", 100 * second).0).unwrap();
        records().into_iter().for_each(|record| journal.write(record).unwrap());
        journal.sync().unwrap();
        let story = read(&path).unwrap();
        assert!(story.is_unfinished());
        assert_eq!(clock(&story, "boot", 160 * second).1, 60 * second, "it was only killed");
        rest(&path).unwrap();
        let story = read(&path).unwrap();
        assert_eq!(story.records, records());
        let last = story.records.last().unwrap().at;
        assert_eq!(clock(&story, "boot", 160 * second).1, last);

        let over = JournalRecord {
            at: last,
            entry: JournalEntry::Ended { outcome: MissionOutcome::Goal },
        };
        let (mut journal, _) = Journal::open(&path).unwrap();
        journal.write(over).unwrap();
        journal.sync().unwrap();
        assert!(!read(&path).unwrap().is_unfinished());
        assert!(Story::default().is_blank());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_report_of_any_value_is_read_back() {
        for value in [0.1, -1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let report = ComponentReport::Event { name: "seen".to_owned(), value };
            let component = "c".to_owned();
            let entry = JournalEntry::Heard { component, instance: 1, serial: 1, report };
            let record = JournalRecord { at: Duration::ZERO, entry };
            let line = serde_json::to_string(&record).unwrap();
            let again: JournalRecord = serde_json::from_str(&line).unwrap();
            assert_eq!(format!("{again:?}"), format!("{record:?}"), "{line}");
        }
    }

    #[test]
    fn a_cut_journal_holds_one_record_and_continues() {
        let folder = std::env::temp_dir().join(format!("armor-cut-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("cut.jsonl");
        let _ = std::fs::remove_file(&path);
        let life = Life { boot: "b".to_owned(), zero_ns: -5, anchor: None };
        let [first, .., last] = &records()[..] else { panic!("some records") };
        let (mut journal, _) = Journal::open(&path).unwrap();
        journal.begin(life.clone()).unwrap();
        assert!(!journal.is_longer_than(1000));
        while !journal.is_longer_than(1000) {
            records().into_iter().for_each(|record| journal.write(record).unwrap());
        }
        // The unfinished file of a killed executive does not disturb the cut.
        std::fs::write(folder.join("left-over.new"), b"{\"at_ns\":12,\"ent").unwrap();
        journal.cut(life.clone(), first.clone()).unwrap();
        assert!(!journal.is_longer_than(0), "it is as short as it can be");
        journal.write(last.clone()).unwrap();
        journal.sync().unwrap();
        let (_, story) = Journal::open(&path).unwrap();
        assert_eq!((story.records, story.life), (vec![first.clone(), last.clone()], Some(life)));
        let files = std::fs::read_dir(&folder).unwrap().count();
        assert_eq!(files, 2, "the cut leaves no file but the journal");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn time_continues_through_a_restart_but_not_while_the_machine_is_off() {
        let second = Duration::from_secs(1);
        let (life, now) = clock(&Story::default(), "boot", 100 * second);
        assert_eq!(now, Duration::ZERO);
        let record = JournalRecord { at: 5 * second, entry: JournalEntry::Put { firing: 1 } };
        let story = Story { records: vec![record], life: Some(life) };
        assert_eq!(clock(&story, "boot", 130 * second).1, 30 * second);
        assert_eq!(clock(&story, "another", 2 * second).1, 5 * second);
    }
}
