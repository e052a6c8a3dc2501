//! The journal on disk: one JSON object per line, synced before it is acted upon.
//!
//! A batch of records is written and synced, then its last number is written to the state file next
//! to the journal and synced; only then is it acted upon ([`Journal::sync`]). So the journal is at
//! most one batch ahead of its state file, and everything else is damage, which [`verify`] finds.
//! What a crash has left of a batch that was never committed is dropped when the journal is opened
//! again.
//!
//! Every life of the executive begins with a record of its clock, so that timeouts keep running
//! through a restart of the process; after a restart of the machine, time continues from the last
//! record. A journal that has grown long is cut: one snapshot record replaces those before it. An
//! executive that is killed at any moment leaves the old journal or the new one, whole.

mod commit;
mod fault;
mod life;
mod line;
mod reserve;
mod state_file;
mod story;
#[cfg(test)]
pub(crate) mod tests;
mod verification;
mod writing;

pub use fault::JournalFault;
pub use life::{Anchor, Life};
pub use line::{ChainEnd, FORMAT, LineDamage, begins_journal};
pub use state_file::state_path;
pub use story::{Story, began_with, clock, followed_clock, plan_of};
pub use verification::{ForeignFormat, JournalVerification, verify_bytes};
pub use writing::Journal;

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest journal that is read back, far beyond what is cut.
const MAX_LEN: u64 = 1 << 30;
/// When a journal is cut, in bytes: some fifty thousand firings, read back in a second.
pub const CUT_AT: u64 = 16 << 20;
/// How many times a journal is read that an executive is writing to, until both files agree.
const MAX_READINGS: usize = 100;
/// Time between two of these readings.
const READ_AGAIN_AFTER: Duration = Duration::from_millis(2);

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
    /// It is not as it was written.
    #[error(transparent)]
    Damaged(Box<JournalDamage>),
    /// Another version has written it.
    #[error("{}", describe_foreign(path, *format))]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: u32,
    },
    /// The journal is longer than 1 GiB, far beyond the length at which it is cut.
    #[error("journal {0} is longer than 1 GiB; move it away to begin the mission again")]
    TooLong(PathBuf),
}

/// A journal that is not as it was written.
#[derive(Debug, thiserror::Error)]
#[error("journal {path} is damaged: {fault}")]
pub struct JournalDamage {
    /// The journal.
    pub path: PathBuf,
    /// Its first fault.
    pub fault: JournalFault,
    /// What it holds up to the fault.
    pub story: Story,
}

fn describe_foreign(path: &Path, format: u32) -> String {
    let path = path.display();
    let (writer, remedy) = if format < FORMAT {
        ("an earlier version of Armor, whose journals have no checksums", "finish the mission")
    } else {
        ("a newer version of Armor", "continue the mission")
    };
    format!(
        "journal {path} was written by {writer} (format {format}; this version reads format \
         {FORMAT}): {remedy} with that version, or move the journal away to begin the mission again"
    )
}

/// Reads a journal without changing it; an executive may be writing to it.
///
/// # Errors
/// If it cannot be read, is damaged, or was written by another version.
pub fn read(path: &Path) -> Result<Story, JournalError> {
    Ok(check_readable(path, verify(path)?)?.story)
}

/// Verifies a journal without changing it; an executive may be writing to it. A damage is part of
/// the result.
///
/// # Errors
/// If there is neither a journal nor its state file, or it cannot be read, or was written by another
/// version.
pub fn verify(path: &Path) -> Result<JournalVerification, JournalError> {
    let missing = |it: &Path| matches!(it.try_exists(), Ok(false));
    if missing(path) && missing(&state_path(path)) {
        let error = io::Error::new(io::ErrorKind::NotFound, "there is no such file");
        return Err(JournalError::Io { path: path.to_owned(), error });
    }
    read_and_verify(path)
}

/// Notes that no executive runs until the next life begins; time then continues from the last
/// record. Creates the journal if it is missing, so that one missing later is known to be lost.
///
/// # Errors
/// If it cannot be read or written, is damaged, or was written by another version.
pub fn rest(path: &Path) -> Result<(), JournalError> {
    let (mut journal, _) = Journal::open(path)?;
    // No start of the machine has an empty name, so the next life continues from the last record.
    journal.begin(Life { boot: String::new(), zero_ns: 0, anchor: None })?;
    journal.sync()
}

fn read_and_verify(path: &Path) -> Result<JournalVerification, JournalError> {
    let foreign = |ForeignFormat(format)| JournalError::Foreign { path: path.to_owned(), format };
    let state_path = state_path(path);
    let mut state = read_file(&state_path)?;
    for _ in 0..MAX_READINGS {
        let journal = read_file(path)?;
        let after = read_file(&state_path)?;
        if after == state {
            return verify_bytes(journal.as_deref(), state.as_deref()).map_err(foreign);
        }
        // A batch was committed in between.
        state = after;
        std::thread::sleep(READ_AGAIN_AFTER);
    }
    let error = io::Error::other("it changes while it is read: try again");
    Err(JournalError::Io { path: path.to_owned(), error })
}

/// Returns the content of a file; `None` if it is missing.
fn read_file(path: &Path) -> Result<Option<Vec<u8>>, JournalError> {
    let failed = |error| JournalError::Io { path: path.to_owned(), error };
    let file = match armor_files::open_regular_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        other => other.map_err(failed)?,
    };
    let mut bytes = Vec::new();
    file.take(MAX_LEN + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_LEN {
        return Err(JournalError::TooLong(path.to_owned()));
    }
    Ok(Some(bytes))
}

/// Returns the verification of a journal that is as it was written.
fn check_readable(
    path: &Path,
    mut verification: JournalVerification,
) -> Result<JournalVerification, JournalError> {
    match verification.fault.take() {
        None => Ok(verification),
        Some(fault) => {
            let (path, story) = (path.to_owned(), verification.story);
            Err(JournalError::Damaged(Box::new(JournalDamage { path, fault, story })))
        }
    }
}
