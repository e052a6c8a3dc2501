//! A file that does not have its name yet.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::leftovers::{remove_leftovers, temporary_name};
use crate::private::{LINK_NOT_FOLLOWED, PRIVATE_FILE_MODE};
use crate::{SaveError, folder_of, sync_folder};

/// The number of symbolic links that are followed from one to the next, as in Linux itself.
const MAX_SYMLINKS: usize = 40;
/// The permission bits that a new version takes from the old one: not the set-id bits, which a file
/// of data does not need.
const PERMISSION_BITS: u32 = 0o777;

/// The mode of a new file that is not private; the process's umask removes bits of it.
const SHARED_MODE: u32 = 0o666;

/// What a saved file survives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Durability {
    /// A power cut: file and folder are synced.
    Synced,
    /// The end of the process. After a power cut the file may be empty.
    Unsynced,
}

/// A new version of a file, under a temporary name in its folder until [`PendingFile::commit`]. If
/// it is dropped before, it is removed.
#[derive(Debug)]
pub struct PendingFile {
    /// The path given by the caller, for the error message.
    path: PathBuf,
    /// The path that is replaced: `path`, with its symbolic links followed unless it is private.
    target: PathBuf,
    old: Option<Metadata>,
    /// Who is to own the new version, if not the owner of the old one.
    owner: Option<(u32, u32)>,
    temporary: NamedTempFile,
}

impl PendingFile {
    /// Creates the new version of the file at `path`, empty.
    ///
    /// # Errors
    /// If the file is read-only or not a regular file, or its folder does not exist or is
    /// read-only.
    pub fn create(path: &Path) -> Result<Self, SaveError> {
        let target = follow_symlinks(path)
            .map_err(|reason| not_saved(path, "its symbolic link cannot be followed", reason))?;
        Self::create_at(path, target, SHARED_MODE)
    }

    /// Does the same as [`PendingFile::create`], except that a file that did not exist can be read
    /// only by this user, and that a symbolic link is not followed: it could lead anywhere.
    ///
    /// # Errors
    /// If it is a symbolic link, and as [`PendingFile::create`].
    pub fn create_private(path: &Path) -> Result<Self, SaveError> {
        if path.is_symlink() {
            let reason = io::Error::other(LINK_NOT_FOLLOWED);
            return Err(not_saved(path, "it cannot be written", reason));
        }
        Self::create_at(path, path.to_path_buf(), PRIVATE_FILE_MODE)
    }

    /// `target`: what is replaced; `new_mode`: its mode if it does not exist yet.
    fn create_at(path: &Path, target: PathBuf, new_mode: u32) -> Result<Self, SaveError> {
        let failed = |step| move |reason| not_saved(path, step, reason);
        let old = writable_metadata(&target).map_err(failed("it cannot be written"))?;
        remove_leftovers(folder_of(&target));
        let temporary = create_temporary(&target, old.as_ref(), new_mode)
            .map_err(failed("no file can be made in its folder"))?;
        // The lock shows a writer in another container or on another host that this one is alive.
        // On a file system without locks only the process number in the name does.
        let _ = temporary.as_file().try_lock();
        Ok(Self { path: path.to_path_buf(), target, old, owner: None, temporary })
    }

    /// Gives the new version the owner and the group of its folder. What root writes into a folder of
    /// another user could not be read by that user otherwise.
    ///
    /// # Errors
    /// If this user may not give a file away.
    pub fn give_to_owner_of_folder(&mut self) -> Result<(), SaveError> {
        let step = "it cannot be given to the owner of its folder; run this as that user";
        let failed = |reason| not_saved(&self.path, step, reason);
        let folder = fs::metadata(folder_of(&self.target)).map_err(failed)?;
        let own = self.temporary.as_file().metadata().map_err(failed)?;
        if own.uid() != folder.uid() {
            let (user, group) = (folder.uid(), folder.gid());
            fchown(self.temporary.as_file(), Some(user), Some(group)).map_err(failed)?;
        }
        self.owner = Some((folder.uid(), folder.gid()));
        Ok(())
    }

    /// Appends bytes.
    ///
    /// # Errors
    /// If the disk is full or broken.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), SaveError> {
        let written = self.temporary.as_file_mut().write_all(bytes);
        written.map_err(|reason| self.new_version_failed(reason))
    }

    /// Returns the open file, to keep it locked after it has its name. It is locked already, unless
    /// the file system has no locks.
    pub fn file(&self) -> &File {
        self.temporary.as_file()
    }

    /// Gives the new version its name, and returns the open file.
    ///
    /// # Errors
    /// If the disk is full or broken. The old version is unchanged, unless the folder cannot be
    /// synced.
    pub fn commit(self, durability: Durability) -> Result<File, SaveError> {
        if let Some(old) = &self.old {
            let file = self.temporary.as_file();
            if self.owner.is_none() {
                // Only root may give a file away. For others it becomes their own, as in any editor.
                let _ = fchown(file, Some(old.uid()), Some(old.gid()));
            }
            let mode = Permissions::from_mode(old.mode() & PERMISSION_BITS);
            file.set_permissions(mode).map_err(|reason| self.new_version_failed(reason))?;
        }
        if durability == Durability::Synced {
            // Before the rename: else the name may reach the disk before the bytes.
            let synced = self.temporary.as_file().sync_all();
            synced.map_err(|reason| self.new_version_failed(reason))?;
        }
        let Self { path, target, temporary, .. } = self;
        let failed = |step| move |reason| SaveError { path, step, reason };
        let file = match temporary.persist(&target) {
            Ok(file) => file,
            Err(error) => return Err(failed("it cannot be replaced")(error.error)),
        };
        if durability == Durability::Synced {
            sync_folder(folder_of(&target))
                .map_err(failed("it is replaced, but its folder cannot be synced"))?;
        }
        Ok(file)
    }

    fn new_version_failed(&self, reason: io::Error) -> SaveError {
        let step = "the new version cannot be written";
        SaveError { path: self.path.clone(), step, reason }
    }
}

fn not_saved(path: &Path, step: &'static str, reason: io::Error) -> SaveError {
    SaveError { path: path.to_path_buf(), step, reason }
}

/// Returns where the symbolic links at `path` lead. The last one may point to no file yet.
fn follow_symlinks(path: &Path) -> io::Result<PathBuf> {
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

/// Returns the metadata of the old version, if there is one. A rename would replace a read-only
/// file too, so the file is first opened for writing.
fn writable_metadata(target: &Path) -> io::Result<Option<Metadata>> {
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

/// Creates the temporary file. If there is an old version, other users cannot read the new one
/// before it has the old one's mode.
fn create_temporary(
    target: &Path,
    old: Option<&Metadata>,
    new_mode: u32,
) -> io::Result<NamedTempFile> {
    if target.file_name().is_none() {
        return Err(io::Error::other("the path names no file"));
    }
    let mode = if old.is_some() { PRIVATE_FILE_MODE } else { new_mode };
    let (prefix, suffix) = temporary_name();
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(suffix);
    // Opened here, not by `tempfile`: its error would name the temporary file.
    let open = |path: &Path| {
        OpenOptions::new().read(true).write(true).create_new(true).mode(mode).open(path)
    };
    builder.make_in(folder_of(target), open)
}
