//! A folder of files that is saved as a whole.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use crate::private::{create_private_folder, open_own_file};
use crate::{SaveError, folder_of, sync_folder};

/// Saves `files`, each a name and its bytes, as the folder at `path`, in place of the folder there.
/// Only this user can read it.
/// They are on the disk when this returns. Until then they are in `.NAME.new` alongside; what an
/// earlier attempt left there is removed.
///
/// A folder cannot be renamed over one that is not empty, so the old one is removed first: after a
/// power cut the old folder or the new one may be absent, but neither is incomplete.
///
/// # Errors
/// If the parent folder does not exist or is read-only, or the disk is full.
pub fn save_folder_atomically(path: &Path, files: &[(String, Vec<u8>)]) -> Result<(), SaveError> {
    let failed = |step| move |reason| SaveError { path: path.to_path_buf(), step, reason };
    let name = path.file_name().ok_or_else(|| io::Error::other("the path names no folder"));
    let name = name.map_err(failed("it cannot be written"))?.to_string_lossy();
    let parent = folder_of(path);
    let temporary = parent.join(format!(".{name}.new"));
    write_folder(&temporary, files).map_err(failed("the new version cannot be written"))?;
    remove_folder(path)
        .and_then(|()| fs::rename(&temporary, path))
        .map_err(failed("it cannot be replaced"))?;
    sync_folder(parent).map_err(failed("it is replaced, but its folder cannot be synced"))
}

fn write_folder(folder: &Path, files: &[(String, Vec<u8>)]) -> io::Result<()> {
    remove_folder(folder)?;
    create_private_folder(folder)?;
    for (name, bytes) in files {
        let mut file =
            open_own_file(&folder.join(name), OpenOptions::new().write(true).truncate(true))?;
        file.write_all(bytes)?;
        file.sync_all()?;
    }
    sync_folder(folder)
}

/// Removes a folder with all that is in it, if it exists.
fn remove_folder(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
