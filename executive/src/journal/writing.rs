//! A journal that is open for writing.

use super::life::Life;
use super::line::{ChainEnd, JournalLine, encode_batch};
use super::reserve::{ReservedSpace, is_full};
use super::state_file::{StateFile, state_path};
use super::story::Story;
use super::{JournalDamage, JournalError, check_readable, read_and_verify};
use crate::record::JournalRecord;
use armor_files::{Durability, PendingFile, SaveError, open_own_file};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Most damaged journals that are kept in one folder.
const MAX_KEPT: u32 = 10_000;

/// A journal, open for writing.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    state: StateFile,
    /// The last record that is in the file.
    end: ChainEnd,
    /// What the next batch will hold.
    batch: Vec<Vec<u8>>,
    /// Its length, in bytes.
    len: u64,
    /// Its length after the last cut, or 0.
    cut_len: u64,
    space: ReservedSpace,
}

impl Journal {
    /// Opens or creates a journal and reads it. What a crash has left of a batch that was never
    /// committed is removed.
    ///
    /// # Errors
    /// If it cannot be read or written, is damaged, or was written by another version.
    pub fn open(path: &Path) -> Result<(Self, Story), JournalError> {
        let verification = check_readable(path, read_and_verify(path)?)?;
        let mut journal = Self::open_at(path, verification.end, verification.whole_len, |state| {
            StateFile::open(state, verification.state)
        })?;
        if verification.torn_len > 0 {
            // The next record starts on a line of its own.
            journal.file.set_len(journal.len).map_err(|error| journal.failed(error))?;
        }
        journal.file.sync_all().map_err(|error| journal.failed(error))?;
        sync_folder(path).map_err(|error| journal.failed(error))?;
        if journal.state.committed() != journal.end {
            // A crash has prevented this.
            journal.state.commit(journal.end).map_err(|error| journal.failed(error))?;
        }
        journal.space.fill_up(&journal.file, journal.len);
        Ok((journal, verification.story))
    }

    /// Moves a damaged journal away, with a copy of its state file, and creates a new one. Until
    /// the first batch of the new one is on the disk, it counts as damaged, too.
    ///
    /// Returns where the old one is; none if it was missing.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn replace_damaged(
        damage: &JournalDamage,
    ) -> Result<(Self, Option<PathBuf>), JournalError> {
        let path = &damage.path;
        let failed = |error| JournalError::Io { path: path.clone(), error };
        let kept = if path.exists() { Some(keep_damaged(path).map_err(failed)?) } else { None };
        let mut journal = Self::open_at(path, ChainEnd::default(), 0, StateFile::replace)?;
        journal.file.set_len(0).map_err(failed)?;
        sync_folder(path).map_err(failed)?;
        journal.space.fill_up(&journal.file, 0);
        Ok((journal, kept))
    }

    fn open_at(
        path: &Path,
        end: ChainEnd,
        len: u64,
        open_state: impl FnOnce(&Path) -> io::Result<StateFile>,
    ) -> Result<Self, JournalError> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            |error| JournalError::Io { path, error }
        };
        // Before the journal: a journal without a state file counts as damaged.
        let state = open_state(path).map_err(failed(&state_path(path)))?;
        let open = || {
            let mut file = open_own_file(path, OpenOptions::new().read(true).write(true))?;
            file.seek(SeekFrom::Start(len)).map(|_| file)
        };
        let file = open().map_err(failed(path))?;
        Ok(Self {
            file,
            path: path.to_owned(),
            state,
            end,
            batch: Vec::new(),
            len,
            cut_len: 0,
            space: ReservedSpace::default(),
        })
    }

    /// Whether it is longer than `limit` bytes, and much longer than it has to be.
    pub fn is_longer_than(&self, limit: u64) -> bool {
        // Otherwise a snapshot longer than `limit` would be written again after every event.
        self.len > limit && self.len > 2 * self.cut_len
    }

    /// Replaces the content by `record`, a snapshot of all that was decided. It is on disk
    /// afterwards. If the disk is full, the content stays as it is, and [`Self::shortage`] reports
    /// it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn cut(&mut self, life: Life, record: JournalRecord) -> Result<(), JournalError> {
        self.sync()?;
        let bodies =
            [self.body(&JournalLine::Life { life })?, self.body(&JournalLine::Record(record))?];
        let (lines, end) = encode_batch(self.end, &bodies);
        let write = || {
            let mut pending = PendingFile::create_private(&self.path)?;
            pending.write(&lines)?;
            pending.commit(Durability::Synced)
        };
        self.file = match write() {
            Ok(file) => file,
            Err(SaveError { reason, .. }) if is_full(&reason) => {
                self.space.note_shortage(&reason);
                return Ok(());
            }
            Err(SaveError { reason, .. }) => return Err(self.failed(reason)),
        };
        (self.len, self.cut_len, self.end) = (lines.len() as u64, lines.len() as u64, end);
        self.space = ReservedSpace::default();
        self.commit()
    }

    /// Adds where the clock of this life stands; it is on disk after [`Self::sync`].
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(&mut self, life: Life) -> Result<(), JournalError> {
        let body = self.body(&JournalLine::Life { life })?;
        self.batch.push(body);
        Ok(())
    }

    /// Adds a record; it is on disk after [`Self::sync`].
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, record: JournalRecord) -> Result<(), JournalError> {
        let body = self.body(&JournalLine::Record(record))?;
        self.batch.push(body);
        Ok(())
    }

    /// Writes all that was added as one batch, which is read back as a whole or not at all, and
    /// waits until it is on disk: first the batch, then its number in the state file.
    ///
    /// # Errors
    /// If it is not.
    pub fn sync(&mut self) -> Result<(), JournalError> {
        if self.batch.is_empty() {
            return Ok(());
        }
        let (lines, end) = encode_batch(self.end, &std::mem::take(&mut self.batch));
        let written = self.file.write_all(&lines).and_then(|()| self.file.sync_data());
        written.map_err(|error| self.failed(error))?;
        self.len += lines.len() as u64;
        self.end = end;
        self.commit()
    }

    /// Why the disk is full, if no more space could be reserved. What is reserved still takes some
    /// hundred records.
    pub fn shortage(&self) -> Option<&str> {
        self.space.shortage()
    }

    /// Gives the reserved space back.
    pub fn release_reserve(&mut self) {
        // A failure leaves a file that occupies more of the disk than its length.
        let _ = self.file.set_len(self.len);
    }

    fn commit(&mut self) -> Result<(), JournalError> {
        let end = self.end;
        self.state
            .commit(end)
            .map_err(|error| JournalError::Io { path: state_path(&self.path), error })?;
        self.space.fill_up(&self.file, self.len);
        Ok(())
    }

    fn body(&self, line: &JournalLine) -> Result<Vec<u8>, JournalError> {
        serde_json::to_vec(line).map_err(|error| self.failed(error.into()))
    }

    fn failed(&self, error: io::Error) -> JournalError {
        JournalError::Io { path: self.path.clone(), error }
    }
}

/// Moves a damaged journal to the next free name, and copies its state file.
fn keep_damaged(path: &Path) -> io::Result<PathBuf> {
    let name = |number: u32| {
        let mut name = path.as_os_str().to_owned();
        name.push(format!(".damaged-{number}"));
        PathBuf::from(name)
    };
    let free = (1..=MAX_KEPT).map(name).find(|kept| !kept.exists());
    let kept = free.ok_or_else(|| {
        io::Error::other(format!("{MAX_KEPT} damaged journals are kept; remove some"))
    })?;
    fs::rename(path, &kept)?;
    let state = state_path(path);
    if state.exists() {
        fs::copy(&state, state_path(&kept))?;
    }
    Ok(kept)
}

/// Syncs the folder of a file: without that a crash may lose the name of a new file.
fn sync_folder(path: &Path) -> io::Result<()> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        Some(folder) => File::open(folder)?.sync_all(),
        None => File::open(".")?.sync_all(),
    }
}
