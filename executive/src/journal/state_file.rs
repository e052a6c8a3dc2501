//! The state file on disk.

use super::commit::{CommitState, SLOT_LEN, new_state};
use super::line::ChainEnd;
use armor_files::{open_own_file, save_private_file};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// No journal ends with this record: a state file that holds it belongs to none.
const NO_RECORD: ChainEnd = ChainEnd { number: 1, hash: u64::MAX };

/// Returns the path of the state file of a journal: the journal's name with `.state` after it.
pub fn state_path(journal: &Path) -> PathBuf {
    let mut path = journal.as_os_str().to_owned();
    path.push(".state");
    path.into()
}

/// The state file of a journal that is open for writing.
#[derive(Debug)]
pub(super) struct StateFile {
    file: File,
    state: CommitState,
}

impl StateFile {
    /// Opens the state file of `journal`, whose content is `state`; creates it for a new journal.
    pub(super) fn open(journal: &Path, state: Option<CommitState>) -> io::Result<Self> {
        match state {
            Some(state) => Self::open_with(journal, state),
            None => Self::create(journal, ChainEnd::default()),
        }
    }

    /// Replaces the state file by one that belongs to no journal. Until the next commit, a journal
    /// that is opened with it counts as damaged.
    pub(super) fn replace(journal: &Path) -> io::Result<Self> {
        Self::create(journal, NO_RECORD)
    }

    fn create(journal: &Path, end: ChainEnd) -> io::Result<Self> {
        let bytes = new_state(end);
        save_private_file(&state_path(journal), &bytes).map_err(|error| error.reason)?;
        let state = CommitState::decode(&bytes).ok_or(io::ErrorKind::InvalidData)?;
        Self::open_with(journal, state)
    }

    fn open_with(journal: &Path, state: CommitState) -> io::Result<Self> {
        let mut options = OpenOptions::new();
        let file = open_own_file(&state_path(journal), options.read(true).write(true))?;
        Ok(Self { file, state })
    }

    /// The last committed record.
    pub(super) fn committed(&self) -> ChainEnd {
        self.state.newest.end
    }

    /// Writes that all records up to `end` are on the disk, and waits until this is, too.
    pub(super) fn commit(&mut self, end: ChainEnd) -> io::Result<()> {
        let (slot, content) = self.state.commit(end);
        self.file.write_all_at(&content, (slot * SLOT_LEN) as u64)?;
        self.file.sync_data()
    }
}
