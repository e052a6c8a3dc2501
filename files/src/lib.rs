//! Saving a file atomically: the bytes are written to a temporary file in the same folder, synced,
//! and renamed over the old file. A reader, or the next start after a power cut, finds the old
//! bytes or the new ones. A temporary file that a killed process has left is removed by the next
//! save in its folder.
//!
//! ```
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("robot.xml");
//! armor_files::save_atomically(&path, b"<armor version=\"1\"/>")?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod folder;
mod leftovers;
mod pending;
mod private;

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

pub use folder::save_folder_atomically;
pub use pending::{Durability, PendingFile};
pub use private::{
    create_own_folder, create_private_folder, create_unlinked_folder, open_own_file,
    open_regular_file,
};

/// Why a file was not saved. Unless the last step failed, the old file is unchanged.
#[derive(Debug, thiserror::Error)]
#[error("{path} was not saved: {step}: {reason}", path = path.display())]
pub struct SaveError {
    /// The file.
    pub path: PathBuf,
    /// The step that failed.
    pub step: &'static str,
    /// The reason, which is already part of the message.
    pub reason: io::Error,
}

/// Saves `bytes` as the file at `path`. They are on the disk when this returns. A new version keeps
/// the mode of the old one and, where the system allows it, the owner. A symbolic link stays one,
/// and the file it points to is replaced. A hard link to the old version keeps the old version.
///
/// # Errors
/// If the file is read-only or not a regular file, its folder does not exist or is read-only, or
/// the disk is full. No temporary file remains.
pub fn save_atomically(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    write_and_commit(PendingFile::create(path)?, bytes, Durability::Synced)
}

/// Replaces the file at `path` as [`save_atomically`] does, but without waiting for the disk: after
/// a power cut it may be empty. For what can be made again.
///
/// # Errors
/// As [`save_atomically`].
pub fn replace_atomically(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    write_and_commit(PendingFile::create(path)?, bytes, Durability::Unsynced)
}

/// Saves `bytes` as [`save_atomically`] does. If the file did not exist, only this user can read
/// it: what a run writes may be a map or pictures of a home. A symbolic link is not followed.
///
/// # Errors
/// If it is a symbolic link, and as [`save_atomically`].
pub fn save_private_file(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    write_and_commit(PendingFile::create_private(path)?, bytes, Durability::Synced)
}

/// Saves `bytes` as [`save_private_file`] does, for the owner of the folder: a file that root writes into
/// the folder of another user belongs to that user.
///
/// # Errors
/// As [`save_private_file`], and if root may not give the file away.
pub fn save_folder_owners_file(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    let mut pending = PendingFile::create_private(path)?;
    pending.give_to_owner_of_folder()?;
    write_and_commit(pending, bytes, Durability::Synced)
}

/// Replaces the file as [`replace_atomically`] does. If it did not exist, only this user can read
/// it. A symbolic link is not followed.
///
/// # Errors
/// As [`save_private_file`].
pub fn replace_private_file(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    write_and_commit(PendingFile::create_private(path)?, bytes, Durability::Unsynced)
}

fn write_and_commit(
    mut pending: PendingFile,
    bytes: &[u8],
    durability: Durability,
) -> Result<(), SaveError> {
    pending.write(bytes)?;
    pending.commit(durability).map(drop)
}

/// Returns the folder that holds `path`.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Waits until the names in `folder` are on the disk. Without this a power cut may undo a rename.
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}
