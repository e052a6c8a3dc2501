//! The unsaved work of designers that have died. A lock distinguishes it from the work of running
//! ones.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use super::Kept;

/// The ending of the unsaved work.
pub(super) const KEPT: &str = "json";
/// The ending of the lock next to it.
const LOCK: &str = "lock";
/// Longest recovery file that is read: a few files of 1 MiB in both versions, escaped as JSON.
const MAX_BYTES: u64 = 64 << 20;
/// Most that are offered: a user would not answer more questions.
const MAX_ORPHANS: usize = 16;
/// Names tried.
const MAX_NAMES: usize = 1000;

/// Unsaved work of a designer that no longer exists. As long as this value lives, no other designer
/// offers the same work.
pub struct Orphan {
    /// The work.
    pub kept: Kept,
    file: PathBuf,
    lock_file: PathBuf,
    _lock: File,
}

impl Orphan {
    /// Removes it: it was restored, or the user discarded it.
    pub fn discard(self) {
        let _ = fs::remove_file(&self.file);
        let _ = fs::remove_file(&self.lock_file);
    }
}

/// Returns the work that dead designers left in `folder`, newest first. Unreadable files stay.
pub fn orphans(folder: &Path) -> Vec<Orphan> {
    let ending_in = |wanted: &'static str| {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path());
        paths.filter(move |path| path.extension().is_some_and(|ending| ending == wanted))
    };
    ending_in(LOCK).for_each(|lock| forget_if_empty(&lock));
    let files = ending_in(KEPT);
    let mut found: Vec<_> = files.filter_map(adopt).take(MAX_ORPHANS).collect();
    found.sort_by_key(|orphan| std::cmp::Reverse(orphan.kept.at));
    found
}

/// Removes the lock of a designer that was killed with nothing unsaved.
fn forget_if_empty(lock_file: &Path) {
    let is_free = || open(lock_file, false).is_ok_and(|lock| lock.try_lock().is_ok());
    if !lock_file.with_extension(KEPT).exists() && is_free() {
        let _ = fs::remove_file(lock_file);
    }
}

fn adopt(file: PathBuf) -> Option<Orphan> {
    let lock_file = file.with_extension(LOCK);
    let lock = open(&lock_file, false).ok()?;
    // The lock of a running designer is held, and so is that of an orphan that another designer is
    // offering. After a crash the kernel has released it.
    lock.try_lock().ok()?;
    if fs::metadata(&file).ok()?.len() > MAX_BYTES {
        return None;
    }
    let kept = serde_json::from_slice(&fs::read(&file).ok()?).ok()?;
    Some(Orphan { kept, file, lock_file, _lock: lock })
}

/// A name that no running designer uses, as the file of its lock, which is held.
pub(super) fn take_name(folder: &Path) -> io::Result<(PathBuf, File)> {
    for n in 0..MAX_NAMES {
        let path = folder.join(format!("{}-{n}.{LOCK}", std::process::id()));
        // A process of the same number may have left its work, with or without its lock.
        if path.with_extension(KEPT).exists() {
            continue;
        }
        match open(&path, true) {
            Ok(lock) => {
                lock.try_lock().map_err(io::Error::from)?;
                return Ok((path, lock));
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("all names for the recovery file are taken"))
}

fn open(path: &Path, is_new: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).mode(0o600).create(!is_new).create_new(is_new).truncate(false);
    options.open(path)
}
