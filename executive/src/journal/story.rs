//! The content of a journal, and the mission time at which it continues.

use super::life::Life;
use crate::ledger::applying::replay_records;
use crate::record::{JournalEntry, JournalRecord};
use armor_plan::{Plan, Version};
use std::sync::Arc;
use std::time::Duration;

/// The content of a journal.
#[derive(Clone, Debug, Default, PartialEq)]
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

    /// Whether it is empty: it does not even hold the line that [`super::rest`] writes.
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

/// Returns the version of the file that a journal began with, if the journal holds it.
pub fn began_with(records: &[JournalRecord]) -> Option<&Version> {
    match &records.first()?.entry {
        JournalEntry::Began { version, .. } if !version.files.is_empty() => Some(version),
        JournalEntry::Snapshot(it) if !it.began.files.is_empty() => Some(&it.began),
        _ => None,
    }
}

/// Returns the plan that a journal ends with.
///
/// # Errors
/// If it does not contain the file it was played from, or its records do not fit.
pub fn plan_of(story: &Story) -> Result<Arc<Plan>, String> {
    let version = began_with(&story.records);
    let plan = version.ok_or("it does not contain the file it was played from")?.plan()?;
    let ledger = replay_records(Arc::new(plan), &story.records);
    ledger.map(|ledger| Arc::clone(ledger.plan())).map_err(|error| error.to_string())
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
