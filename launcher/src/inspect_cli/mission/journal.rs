//! `armor mission journal`: what was decided, and when; of a run, or of a recording.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use armor_executive::journal::{self, JournalDamage, JournalFault, Story};
use armor_executive::order::MissionOrder;
use armor_executive::{Cause, JournalEntry, JournalRecord};
use armor_recording::Recording;
use armor_recording::trail::{JOURNAL as JOURNAL_DATA, RecordedDecision};
use serde_json::json;

use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line, print_notice, print_wrapped};
use crate::system;

/// Prints a journal; without `path` that of the running system.
///
/// # Errors
/// If there is none, or it is not one.
pub fn print(
    path: Option<&Path>,
    running: &RunningSystem,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let path = match path {
        Some(path) => path.to_owned(),
        None => of_the_running(running)?,
    };
    let PastJournal { story, damage } = read(&path)?;
    let mut printer = RecordPrinter::default();
    let mut print =
        || story.records.iter().try_for_each(|record| printer.print_record(record, format));
    end_printing(print().and_then(|()| fail_if_damaged(damage)))
}

/// A journal with at least one record, from its beginning to its first fault.
pub struct PastJournal {
    /// What it holds.
    pub story: Story,
    /// The fault that ends it.
    pub damage: Option<JournalDamage>,
}

/// Reads a journal, damaged or not.
///
/// # Errors
/// If it is none, or holds no record; what it is instead.
pub fn read(path: &Path) -> Result<PastJournal> {
    let inner = path.join(JOURNAL);
    let path = if path.is_dir() { &inner } else { path };
    let at = path.display();
    if path == inner && !path.exists() {
        bail!("{at} does not exist: name a journal, or the folder of a run that has one");
    }
    let verification = match read_recorded(path)? {
        Some(lines) => journal::verify_bytes(Some(&lines), None)
            .map_err(|_| anyhow!("{at}: another version of Armor has written its journal"))?,
        None => journal::verify(path)?,
    };
    let story = verification.story;
    let fault = match verification.fault {
        Some(JournalFault::Line { line: 1, .. }) if is_xml(path) => bail!(
            "{at} is a mission file and no journal: `armor mission replay {at} --fire \"T …\"` \
             plays firings over it, and {JOURNAL} in the folder of a run is its journal"
        ),
        // A copy of a journal is often read without its state file.
        Some(JournalFault::StateMissing) if is_recording(path) => None,
        Some(JournalFault::StateMissing) => {
            print_notice(format!("{at}: {}", JournalFault::StateMissing));
            None
        }
        fault => fault,
    };
    let path = path.to_owned();
    let damage = fault.map(|fault| JournalDamage { path, fault, story: Story::default() });
    match story.records.first().map(|record| &record.entry) {
        None => match damage {
            Some(damage) => Err(damage.into()),
            None => bail!("{at} has no record: no mission has begun in it"),
        },
        Some(JournalEntry::Began { .. } | JournalEntry::Snapshot(_)) => {
            Ok(PastJournal { story, damage })
        }
        Some(first) => Err(anyhow!(
            "the beginning of {at} is missing (it begins with \"{first}\"): its content cannot \
             be understood without"
        )),
    }
}

/// Reports that the records that were printed are not all.
///
/// # Errors
/// If there is a damage.
pub fn fail_if_damaged(damage: Option<JournalDamage>) -> Result<()> {
    match damage {
        None => Ok(()),
        Some(damage) => bail!("{damage}; the records before are printed above"),
    }
}

fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "mcap")
}

/// Returns the lines of the journal in a recording; `None` if it is none.
fn read_recorded(path: &Path) -> Result<Option<Vec<u8>>> {
    if !is_recording(path) {
        return Ok(None);
    }
    let at = path.display();
    let unreadable = || format!("{at} cannot be read as a recording");
    let mut recording = Recording::open(path).with_context(unreadable)?;
    recording.select(|data| data == JOURNAL_DATA);
    let mut lines = Vec::new();
    while let Some(message) = recording.next_message()? {
        let RecordedDecision { line, .. } = message.decode_as().map_err(|reason| {
            anyhow!(
                "{at}: {reason}. `armor bag convert {at} FILE.csv --data {JOURNAL_DATA}` shows it"
            )
        })?;
        // A journal that was cut, or that of another run in the same folder, begins again.
        if journal::begins_journal(&line) {
            lines.clear();
        }
        lines.extend_from_slice(line.as_bytes());
        lines.push(b'\n');
    }
    if lines.is_empty() {
        bail!("{at} has no journal: no mission was played, or it was recorded on another host");
    }
    Ok(Some(lines))
}

fn is_xml(path: &Path) -> bool {
    std::fs::read(path).is_ok_and(|bytes| bytes.trim_ascii_start().starts_with(b"<"))
}

/// The journal that `armor run` lets the executive keep.
fn of_the_running(running: &RunningSystem) -> Result<PathBuf> {
    let record = system::find_record(running)
        .context("name a journal or the folder of a run, or a running system")?;
    let journal = record.out.join(JOURNAL);
    if !journal.exists() {
        bail!("no mission runs in {}: there is no {}", record.system, journal.display());
    }
    Ok(journal)
}

/// Its name in the folder of a run.
pub const JOURNAL: &str = "executive.journal";

/// Prints records one after the other.
#[derive(Default)]
pub struct RecordPrinter {
    /// The last number of a firing, and whether the firing that leads to the safe place has a later
    /// one.
    last_firing: u64,
    retreat: Option<u64>,
}

impl RecordPrinter {
    /// Prints one record.
    pub fn print_record(&mut self, record: &JournalRecord, format: OutputFormat) -> Result<()> {
        match format {
            OutputFormat::Json => {
                print_line(json!({ "at_s": record.at.as_secs_f64(), "record": record }))
            }
            _ => print_wrapped(format!("{}  {}", time(record), self.words(&record.entry))),
        }
    }

    /// The text of a record. The retreat to the safe place is a firing that no record of its own
    /// begins; it has the number after the last firing.
    fn words(&mut self, entry: &JournalEntry) -> String {
        let retreats = match entry {
            JournalEntry::Retreated { .. } => true,
            JournalEntry::Ordered(judged) => judged.accepted && judged.order == MissionOrder::Safe,
            JournalEntry::Took { firing, cause, .. } => {
                self.last_firing = self.last_firing.max(*firing);
                *cause == Cause::Retreat
            }
            _ => false,
        };
        match entry {
            JournalEntry::Put { firing } if self.retreat == Some(*firing) => {
                format!("{entry}: the mission is in its safe place")
            }
            _ if retreats && self.retreat.is_none() => {
                let firing = self.last_firing + 1;
                self.retreat = Some(firing);
                format!("{entry} (firing {firing})")
            }
            _ => entry.to_string(),
        }
    }
}

/// Mission time, as on a watch.
pub fn time(record: &JournalRecord) -> String {
    let (s, ms) = (record.at.as_secs(), record.at.subsec_millis());
    format!("{}:{:02}:{:02}.{ms:03}", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_executive::JournalEntry;
    use std::time::Duration;

    #[test]
    fn mission_time_reads_like_a_watch() {
        let at = Duration::from_millis(3_723_004);
        assert_eq!(
            time(&JournalRecord { at, entry: JournalEntry::Put { firing: 1 } }),
            "1:02:03.004"
        );
    }
}
