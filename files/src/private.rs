//! Files and folders that no other user can redirect, and that no other user can read if this
//! process creates them.

use std::fs::{self, DirBuilder, File, FileType, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::OFlags;
use rustix::process::geteuid;

/// Every user may write.
const WORLD_WRITABLE: u32 = 0o002;

/// Why a symbolic link is refused, and what to do.
pub(crate) const LINK_NOT_FOLLOWED: &str =
    "it is a symbolic link, which is not followed: remove the link, or choose another place";

/// The mode of a file that only its user can read and write.
pub(crate) const PRIVATE_FILE_MODE: u32 = 0o600;
/// The mode of a folder that only its user can list, enter and change.
const PRIVATE_FOLDER_MODE: u32 = 0o700;

/// Creates the folder `path` with those above it, as far as they do not exist, for this user only.
/// The mode of a folder that exists is unchanged.
///
/// # Errors
/// If one of them cannot be created, or is not a folder.
pub fn create_private_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(PRIVATE_FOLDER_MODE).create(path)
}

/// Creates the folder `path` with those above it, if they do not exist, and checks that it is this
/// user's alone to change: another user who could place a link in it would choose what this process
/// overwrites.
///
/// # Errors
/// If it cannot be created, belongs to another user, or can be written by all users.
pub fn create_own_folder(path: &Path) -> io::Result<()> {
    create_private_folder(path)?;
    let metadata = fs::metadata(path)?;
    let own = geteuid().as_raw();
    if metadata.uid() != own {
        return Err(io::Error::other(format!(
            "it belongs to user {}, and this process to user {own}: choose another folder",
            metadata.uid()
        )));
    }
    if metadata.mode() & WORLD_WRITABLE != 0 {
        return Err(io::Error::other(format!(
            "all users may write to it: chmod o-w {}",
            path.display()
        )));
    }
    Ok(())
}

/// Does the same as [`create_own_folder`] for a folder that only this program creates: a symbolic
/// link there is an error, because it could lead anywhere.
///
/// # Errors
/// If it is a symbolic link, or as [`create_own_folder`].
pub fn create_unlinked_folder(path: &Path) -> io::Result<()> {
    if path.is_symlink() {
        return Err(io::Error::other(LINK_NOT_FOLLOWED));
    }
    create_own_folder(path)
}

/// Opens the file at `path` with `options`, which allow writing, and creates it if it does not
/// exist, for this user only. A symbolic link there is an error: it could lead anywhere. So is what
/// is no regular file: a pipe would wait for its other end.
///
/// # Errors
/// If it is a symbolic link or no regular file, or the system refuses.
pub fn open_own_file(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed();
    let options = options.create(true).mode(PRIVATE_FILE_MODE).custom_flags(flags);
    let opened = options.open(path).map_err(|error| {
        if path.is_symlink() {
            io::Error::new(error.kind(), LINK_NOT_FOLLOWED)
        } else {
            explain_irregular(path, error)
        }
    })?;
    refuse_irregular(opened)
}

/// Opens a file to read it. What is no regular file is an error: a pipe would wait for its other
/// end.
///
/// # Errors
/// If it is no regular file, or the system refuses.
pub fn open_regular_file(path: &Path) -> io::Result<File> {
    let flags = OFlags::NONBLOCK.bits().cast_signed();
    let opened = OpenOptions::new().read(true).custom_flags(flags).open(path);
    refuse_irregular(opened.map_err(|error| explain_irregular(path, error))?)
}

fn refuse_irregular(file: File) -> io::Result<File> {
    let kind = file.metadata()?.file_type();
    if kind.is_file() { Ok(file) } else { Err(irregular(kind)) }
}

/// States what it is that cannot be opened, if it is no regular file.
fn explain_irregular(path: &Path, error: io::Error) -> io::Error {
    match fs::metadata(path).map(|metadata| metadata.file_type()) {
        Ok(kind) if !kind.is_file() => irregular(kind),
        _ => error,
    }
}

fn irregular(kind: FileType) -> io::Error {
    let what = if kind.is_dir() { "a folder" } else { "a pipe or a device" };
    io::Error::new(io::ErrorKind::InvalidInput, format!("it is {what}, not a regular file"))
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    #[test]
    fn a_symbolic_link_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (precious, log) = (folder.path().join("precious"), folder.path().join("log"));
        fs::write(&precious, "kept").unwrap();
        symlink(&precious, &log).unwrap();
        for options in
            [OpenOptions::new().write(true).truncate(true), OpenOptions::new().append(true)]
        {
            let error = open_own_file(&log, options).unwrap_err();
            assert!(error.to_string().contains("symbolic link"), "{error}");
        }
        assert_eq!(fs::read_to_string(&precious).unwrap(), "kept");
        fs::remove_file(&log).unwrap();
        open_own_file(&log, OpenOptions::new().append(true)).unwrap().write_all(b"new").unwrap();
        assert_eq!(fs::read_to_string(&log).unwrap(), "new");
    }

    #[test]
    fn a_pipe_or_a_folder_is_refused_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for (path, what) in [(pipe.as_path(), "pipe"), (folder.path(), "folder")] {
            let both = [
                open_regular_file(path),
                open_own_file(path, OpenOptions::new().read(true).write(true)),
                open_own_file(path, OpenOptions::new().append(true)),
            ];
            for opened in both {
                let error = opened.unwrap_err().to_string();
                assert!(error.contains(what) && error.contains("not a regular file"), "{error}");
            }
        }
    }

    #[test]
    fn a_folder_behind_a_symbolic_link_is_used_only_where_links_are_meant() {
        let folder = tempfile::tempdir().unwrap();
        let (there, link) = (folder.path().join("there"), folder.path().join("link"));
        for target in ["there", "nothing"] {
            create_unlinked_folder(&there).unwrap();
            symlink(folder.path().join(target), &link).unwrap();
            let error = create_unlinked_folder(&link).unwrap_err().to_string();
            assert!(error.contains("symbolic link") && error.contains("remove"), "{error}");
            assert_eq!(create_own_folder(&link).is_ok(), target == "there");
            fs::remove_file(&link).unwrap();
        }
        assert!(!folder.path().join("nothing").exists());
    }

    #[test]
    fn what_is_created_is_for_this_user_only_and_what_exists_keeps_its_mode() {
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().mode() & 0o777;
        let (outer, inner) = (folder.path().join("out"), folder.path().join("out/maps"));
        create_own_folder(&inner).unwrap();
        assert_eq!((mode(&outer), mode(&inner)), (0o700, 0o700));
        let (log, map, picture) = (inner.join("log"), inner.join("map"), inner.join("picture"));
        drop(open_own_file(&log, OpenOptions::new().append(true)).unwrap());
        crate::save_private_file(&map, b"map").unwrap();
        crate::replace_private_file(&picture, b"picture").unwrap();
        crate::save_folder_atomically(&inner.join("1"), &[("a".into(), b"a".to_vec())]).unwrap();
        for path in [&log, &map, &picture, &inner.join("1/a")] {
            assert_eq!(mode(path), 0o600, "{}", path.display());
        }
        assert_eq!(mode(&inner.join("1")), 0o700);
        for path in [&log, &map] {
            fs::set_permissions(path, fs::Permissions::from_mode(0o640)).unwrap();
        }
        drop(open_own_file(&log, OpenOptions::new().append(true)).unwrap());
        crate::save_private_file(&map, b"another").unwrap();
        assert_eq!((mode(&log), mode(&map)), (0o640, 0o640), "an operator has opened them");
    }

    #[test]
    fn a_folder_that_all_users_may_write_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b");
        create_own_folder(&path).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o777)).unwrap();
        let error = create_own_folder(&path).unwrap_err().to_string();
        assert!(error.contains("chmod o-w"), "{error}");
    }
}
