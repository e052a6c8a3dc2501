//! How a rehearsed mission went, by its journal.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_executive::{Cause, JournalEntry, JournalRecord, MissionOutcome};
use armor_robotfile::Mission;
use armor_robotfile::timing::{JournalFiring, Rehearsal, Timetable};

use crate::inspect_cli::mission::journal::{self, PastJournal};

/// See the module.
#[derive(Debug)]
pub struct RehearsalOutcome {
    /// Its steps, compared with their times.
    pub rehearsal: Rehearsal,
    /// How it ended; none if it was not over.
    pub end: Option<MissionOutcome>,
    /// When it ended, or the last thing happened.
    pub took: Duration,
}

impl RehearsalOutcome {
    /// Reads the journal in the folder of a run.
    ///
    /// # Errors
    /// If there is none, or it is damaged: no mission has begun.
    pub fn read(out: &Path, mission: &Mission, table: &Timetable) -> Result<Self> {
        let PastJournal { story, damage } =
            journal::read(out).context("the journal of the rehearsal cannot be read")?;
        journal::fail_if_damaged(damage)?;
        Ok(Self::of_records(&story.records, mission, table))
    }

    fn of_records(records: &[JournalRecord], mission: &Mission, table: &Timetable) -> Self {
        let firings: Vec<_> = records.iter().filter_map(read_firing).collect();
        let last = records.last();
        let end = last.and_then(|record| match record.entry {
            JournalEntry::Ended { outcome } => Some(outcome),
            _ => None,
        });
        let took = last.map(|record| record.at).unwrap_or_default();
        Self { rehearsal: Rehearsal::compare(mission, table, &firings), end, took }
    }
}

fn read_firing(record: &JournalRecord) -> Option<JournalFiring> {
    let JournalEntry::Took { cause, from, .. } = &record.entry else { return None };
    let transition = match cause {
        Cause::Transition(name) => Some(name.clone()),
        Cause::Start | Cause::Failure { .. } | Cause::Retreat => None,
    };
    let from = from.iter().map(|tokens| tokens.place.clone()).collect();
    Some(JournalFiring { at: record.at, transition, from })
}
