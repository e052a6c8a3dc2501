//! Tests of the journal: its files, damages, and power failures.

mod damages;
mod files;
mod power;

pub(crate) use super::commit::SLOT_LEN;
use super::commit::{CommitState, new_state};
use super::line::{ChainEnd, JournalLine, encode_batch};
use super::verification::{JournalVerification, verify_bytes};
use super::{JournalFault, Life, Story};
use crate::ledger::Ledger;
use crate::ledger::snapshot::snapshot_of;
use crate::record::{JournalEntry, JournalRecord};
use crate::terms::{Cause, ComponentReport, GuardTurned, Tokens, ValueSet};
use crate::tests::simulation::dice::Dice;
use crate::tests::simulation::draft::random_plan;
use armor_plan::Version;
use std::sync::Arc;
use std::time::Duration;

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

/// The files of a journal as they are on the disk, written batch by batch.
#[derive(Clone, Debug)]
pub(crate) struct JournalOnDisk {
    pub(crate) journal: Vec<u8>,
    pub(crate) state_file: Vec<u8>,
    state: CommitState,
    end: ChainEnd,
}

impl JournalOnDisk {
    pub(crate) fn new() -> Self {
        let state_file = new_state(ChainEnd::default());
        let state = CommitState::decode(&state_file).unwrap();
        Self { journal: Vec::new(), state_file, state, end: ChainEnd::default() }
    }

    /// The bytes that the next batch appends, and the end after it.
    pub(crate) fn encode(&self, lines: &[String]) -> (Vec<u8>, ChainEnd) {
        let bodies: Vec<_> = lines.iter().map(|line| line.clone().into_bytes()).collect();
        encode_batch(self.end, &bodies)
    }

    /// Writes a batch to the journal, but not its number to the state file.
    pub(crate) fn append(&mut self, lines: &[String]) {
        let (bytes, end) = self.encode(lines);
        self.journal.extend_from_slice(&bytes);
        self.end = end;
    }

    /// Writes the first `len` bytes of the slot of the state file that commits the last batch.
    pub(crate) fn commit_up_to(&mut self, len: usize) {
        let mut state = self.state;
        let (slot, content) = state.commit(self.end);
        let at = slot * SLOT_LEN;
        self.state_file[at..at + len].copy_from_slice(&content[..len]);
        if len == SLOT_LEN {
            self.state = state;
        }
    }

    pub(crate) fn commit(&mut self) {
        self.commit_up_to(SLOT_LEN);
    }

    /// Replaces the journal by one batch, as a cut does.
    pub(crate) fn cut(&mut self, lines: &[String]) {
        self.journal.clear();
        self.append(lines);
    }

    pub(crate) fn verify(&self) -> JournalVerification {
        verify_bytes(Some(&self.journal), Some(&self.state_file)).expect("this version wrote it")
    }

    /// Opens the files as an executive does: a torn batch is removed, a whole one is committed.
    pub(crate) fn reopen(&mut self) -> Story {
        let verification = self.verify();
        assert_eq!(verification.fault, None, "a crash is no damage");
        self.journal.truncate(verification.whole_len as usize);
        (self.state, self.end) = (verification.state.unwrap(), verification.end);
        if self.state.newest.end != self.end {
            self.commit();
        }
        assert!(!self.verify().state.unwrap().is_half);
        verification.story
    }
}

fn life_line() -> String {
    let life = Life { boot: "b".to_owned(), zero_ns: -5, anchor: None };
    serde_json::to_string(&JournalLine::Life { life }).unwrap()
}

/// The line of a put firing, different for each number.
fn put_line(firing: u64) -> String {
    let at = Duration::from_millis(firing * 137);
    serde_json::to_string(&JournalRecord { at, entry: JournalEntry::Put { firing } }).unwrap()
}

/// The snapshot of a mission that has not begun.
fn snapshot() -> JournalRecord {
    snapshot_of(&Ledger::new(Arc::new(random_plan(&mut Dice::new(1), None))))
}
