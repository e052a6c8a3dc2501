//! Unsaved work, kept in a folder of the designer's own while there is some, so that a crash loses
//! the last seconds at most. The user's files are never touched. What a dead designer left is found
//! by its lock, which the kernel releases with the process, and offered.

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

/// Pause between two writings. The first change is kept immediately, so that with the time a write
/// takes no more than five seconds are ever lost.
pub const EVERY: Duration = Duration::from_secs(2);

/// Unsaved work: every open file that differs from the disk.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Kept {
    /// When it was kept, in seconds since 1970.
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
    /// What is kept now.
    pub fn now(files: Vec<KeptFile>) -> Self {
        let at = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        Self { at, files }
    }
}

/// The recovery file of this process. Dropped in order it is gone; in a panic it stays.
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
    /// Takes a name of its own in `folder`, which is made if need be. Nothing is written before
    /// there is something unsaved.
    ///
    /// # Errors
    /// If the folder cannot be made or written.
    pub fn begin(folder: &Path) -> io::Result<Self> {
        // What a robot's file states is no other's to read.
        fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
        let (lock_file, lock) = orphan::take_name(folder)?;
        let file = lock_file.with_extension(orphan::KEPT);
        Ok(Self { writer: Writer::of(&file), file, lock_file, _lock: lock, kept: None })
    }

    /// Keeps revision `revision` of the unsaved work if it is time to, and computes when to call again;
    /// none if nothing waits. `unsaved` gives the work, or none if all of it is saved.
    pub fn keep(
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
                self.writer.write(work);
                self.kept = Some((revision, now));
            }
            None => self.forget(),
        }
        None
    }

    /// Removes what was kept: all is saved, or the user does not want it.
    pub fn forget(&mut self) {
        if self.kept.take().is_some() {
            self.writer.remove();
        }
    }

    /// Why the unsaved work could not be kept the last time, if it could not.
    pub fn trouble(&self) -> Option<String> {
        self.writer.trouble()
    }

    /// Waits until what was asked for has been done.
    pub fn settle(&mut self) {
        self.writer.settle();
    }

    /// The file that holds the unsaved work while there is some.
    pub fn file(&self) -> &Path {
        &self.file
    }
}

impl Drop for Recovery {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        self.forget();
        self.writer.settle();
        let _ = fs::remove_file(&self.lock_file);
    }
}

#[cfg(test)]
mod tests;
