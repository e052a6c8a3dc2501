//! Puts a file on the disk whole or not at all: written beside the old one, synced, renamed over
//! it. Whoever reads meanwhile, or after a power cut, finds the old bytes or the new ones.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Links from one name to the next that are followed, as many as Linux follows itself.
const MAX_SYMLINKS: usize = 40;
/// Names tried for the temporary file. Each is new to this process; one that is taken was left by
/// a dead process of the same number.
const MAX_NAMES: usize = 100;

/// Why a file was not saved. Unless the last step failed, the old one is as it was.
#[derive(Debug, thiserror::Error)]
#[error("{path} was not saved: {step}: {reason}", path = path.display())]
pub struct SaveError {
    /// The file.
    pub path: PathBuf,
    /// What could not be done.
    pub step: &'static str,
    /// Why not; part of the message already.
    pub reason: io::Error,
}

/// Saves `bytes` as the file at `path`, at once and for good. A new version has the old one's mode
/// and, where the system allows it, owner; a symbolic link stays one, and the file it leads to is
/// replaced. A hard link to the old version keeps the old version.
///
/// # Errors
/// If the file is read-only or no regular file, its folder is missing or may not be written, or the
/// disk is full. Nothing is left behind then.
pub fn save(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    let failed = |step| move |reason| SaveError { path: path.to_path_buf(), step, reason };
    let target = target(path).map_err(failed("its link cannot be followed"))?;
    let old = writable(&target).map_err(failed("it cannot be written"))?;
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (temporary, file) = temporary(folder, &target, old.as_ref())
        .map_err(failed("no file can be made in its folder"))?;
    let written = fill(file, bytes, old.as_ref())
        .map_err(failed("the new version cannot be written"))
        .and_then(|()| fs::rename(&temporary, &target).map_err(failed("it cannot be replaced")));
    if written.is_err() {
        // The reason is told; that a left-over remains, too, would not help.
        let _ = fs::remove_file(&temporary);
    }
    written?;
    let synced = File::open(folder).and_then(|folder| folder.sync_all());
    synced.map_err(failed("it is replaced, but its folder cannot be synced"))
}

/// Where the symbolic links at `path` lead, if it is one; the last may lead to no file yet.
fn target(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_path_buf();
    for _ in 0..MAX_SYMLINKS {
        match fs::symlink_metadata(&target) {
            Ok(metadata) if metadata.is_symlink() => {
                let next = fs::read_link(&target)?;
                target = target.parent().unwrap_or(Path::new("")).join(next);
            }
            Ok(_) => return Ok(target),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(target),
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("symbolic links lead in a circle"))
}

/// What is known of the old version, if there is one. Renaming would replace a read-only file
/// without asking, so it is opened for writing first.
fn writable(target: &Path) -> io::Result<Option<Metadata>> {
    let metadata = match fs::metadata(target) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    if !metadata.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    OpenOptions::new().write(true).open(target)?;
    Ok(Some(metadata))
}

/// A new file in the folder. It is nobody else's to read before it has the old one's mode.
fn temporary(folder: &Path, target: &Path, old: Option<&Metadata>) -> io::Result<(PathBuf, File)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    if target.file_name().is_none() {
        return Err(io::Error::other("the path names no file"));
    }
    let mode = if old.is_some() { 0o600 } else { 0o666 };
    for _ in 0..MAX_NAMES {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        // Not made of the file's own name, which may be as long as a name can be.
        let path = folder.join(format!(".armor-{}-{count}.new", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).mode(mode).open(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("all names for it are taken"))
}

fn fill(mut file: File, bytes: &[u8], old: Option<&Metadata>) -> io::Result<()> {
    file.write_all(bytes)?;
    if let Some(old) = old {
        // Only root may give a file away; for others it becomes theirs, as with any editor.
        let _ = fchown(&file, Some(old.uid()), Some(old.gid()));
        // Set-id bits are no business of a configuration file.
        let mode = old.mode() & 0o777;
        file.set_permissions(Permissions::from_mode(mode))?;
    }
    file.sync_all()
}
