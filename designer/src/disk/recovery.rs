//! Backs up unsaved work in a folder of the designer's own, so that a crash loses a few seconds at
//! most. The user's files are never written. The work of a designer that died is found by its lock,
//! which the kernel releases when the process ends, and offered to the user.

mod orphan;
mod writer;

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

pub use orphan::{Orphan, orphans};
use writer::Writer;

/// Pause between two backups. The first change is backed up immediately. With the duration of a
/// write, at most five seconds of work are lost.
pub const EVERY: Duration = Duration::from_secs(2);

/// Unsaved work: every open file that differs from the disk.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Kept {
    /// When it was backed up, in seconds since 1970.
    pub at: u64,
    /// The file that was opened, the first of all, and its mission or system next to it. Those
    /// without changes are named too, so that the same project opens again.
    pub files: Vec<KeptFile>,
}

/// One file of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptFile {
    /// Where it is saved; none if it never was.
    pub path: Option<OsString>,
    /// The text on the disk that the changes began with.
    pub saved: String,
    /// The text with the changes; none if there were none.
    pub text: Option<String>,
}

impl Kept {
    /// Returns these files as the work of this moment.
    pub fn now(files: Vec<KeptFile>) -> Self {
        let at = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        Self { at, files }
    }
}

/// The recovery file of this process. It is removed when this is dropped, except in a panic.
pub struct Recovery {
    file: PathBuf,
    lock_file: PathBuf,
    /// Held as long as the process lives.
    _lock: File,
    writer: Writer,
    /// The revision on the disk, and when it was written; none if there is no file.
    kept: Option<(u64, Instant)>,
}

impl Recovery {
    /// Takes a name of its own in `folder`, which is created if necessary. No backup is written
    /// before there is unsaved work.
    ///
    /// # Errors
    /// If the folder cannot be created or written.
    pub fn begin(folder: &Path) -> io::Result<Self> {
        // Other users of the host must not read the robot's file.
        fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
        let (lock_file, lock) = orphan::take_name(folder)?;
        let file = lock_file.with_extension(orphan::KEPT);
        Ok(Self { writer: Writer::of(&file), file, lock_file, _lock: lock, kept: None })
    }

    /// Keeps revision `revision` of the unsaved work if it is time to, and computes when to call
    /// again; none if nothing waits. `unsaved` gives the work, or none if all of it is saved.
    pub fn back_up(
        &mut self,
        now: Instant,
        revision: u64,
        unsaved: impl FnOnce() -> Option<Kept>,
    ) -> Option<Duration> {
        let wait = match self.kept {
            Some((known, _)) if known == revision => return None,
            Some((_, at)) => EVERY.saturating_sub(now.duration_since(at)),
            None => Duration::ZERO,
        };
        if !wait.is_zero() {
            return Some(wait);
        }
        match unsaved() {
            Some(work) => {
                self.writer.request_write(work);
                self.kept = Some((revision, now));
            }
            None => self.remove_backup(),
        }
        None
    }

    /// Removes the backup: all work is saved, or the user discarded it.
    pub fn remove_backup(&mut self) {
        if self.kept.take().is_some() {
            self.writer.request_removal();
        }
    }

    /// Returns why the last backup failed, if it did.
    pub fn trouble(&self) -> Option<String> {
        self.writer.trouble()
    }

    /// Waits until all requested writes are complete.
    pub fn wait_until_written(&mut self) {
        self.writer.wait_until_idle();
    }

    /// Returns the path of the backup, which exists while there is unsaved work.
    pub fn file(&self) -> &Path {
        &self.file
    }
}

impl Drop for Recovery {
    fn drop(&mut self) {
        // After a panic the unsaved work is lost unless its backup stays; the kernel releases the
        // lock.
        if std::thread::panicking() {
            return;
        }
        self.remove_backup();
        // The lock file last: without it, another designer would take the backup for an orphan's.
        self.writer.wait_until_idle();
        let _ = fs::remove_file(&self.lock_file);
    }
}

#[cfg(test)]
mod tests;
