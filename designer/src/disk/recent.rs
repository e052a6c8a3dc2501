//! The files that were open last, newest first: one path a line in a file of the designer's own,
//! read again before each change, since another window may have written it.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// Most paths in the list: as many as can be read at a glance.
const MAX_RECENT: usize = 12;
/// Longest list that is read; a path has at most 4 KiB.
const MAX_BYTES: usize = MAX_RECENT * 4096;

/// The list on the disk.
#[derive(Clone, Debug)]
pub struct Recent {
    file: PathBuf,
}

impl Recent {
    /// The list in `folder`, which need not exist yet.
    pub fn in_folder(folder: &Path) -> Self {
        Self { file: folder.join("recent") }
    }

    /// The paths, newest first. A list that cannot be read is empty.
    pub fn paths(&self) -> Vec<PathBuf> {
        let bytes = fs::read(&self.file).unwrap_or_default();
        let bytes = &bytes[..bytes.len().min(MAX_BYTES)];
        let lines = bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        lines.take(MAX_RECENT).map(|line| PathBuf::from(OsStr::from_bytes(line))).collect()
    }

    /// Puts a path first.
    ///
    /// # Errors
    /// If the list cannot be written, or there is no current folder to make the path absolute.
    pub fn add(&self, path: &Path) -> io::Result<()> {
        let path = std::path::absolute(path)?;
        if path.as_os_str().as_bytes().contains(&b'\n') {
            return Ok(());
        }
        let mut paths = self.paths();
        paths.retain(|known| *known != path);
        paths.insert(0, path);
        self.write(&paths)
    }

    /// Forgets a path, such as one that no longer exists.
    ///
    /// # Errors
    /// If the list cannot be written.
    pub fn forget(&self, path: &Path) -> io::Result<()> {
        let mut paths = self.paths();
        paths.retain(|known| known != path);
        self.write(&paths)
    }

    fn write(&self, paths: &[PathBuf]) -> io::Result<()> {
        let mut bytes = Vec::new();
        for path in paths.iter().take(MAX_RECENT) {
            bytes.extend_from_slice(path.as_os_str().as_bytes());
            bytes.push(b'\n');
        }
        if let Some(folder) = self.file.parent() {
            fs::create_dir_all(folder)?;
        }
        armor_files::save_atomically(&self.file, &bytes).map_err(io::Error::other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::scratch::Scratch;

    #[test]
    fn the_newest_is_first_and_each_is_there_once() {
        let folder = Scratch::new();
        let recent = Recent::in_folder(&folder.path().join("not/there/yet"));
        for path in ["/a.xml", "/b.xml", "/a.xml"] {
            recent.add(path.as_ref()).expect("written");
        }
        assert_eq!(recent.paths(), [PathBuf::from("/a.xml"), PathBuf::from("/b.xml")]);
        recent.forget("/a.xml".as_ref()).expect("written");
        assert_eq!(recent.paths(), [PathBuf::from("/b.xml")]);
    }

    #[test]
    fn a_dozen_are_remembered() {
        let folder = Scratch::new();
        let recent = Recent::in_folder(folder.path());
        for n in 0..20 {
            recent.add(format!("/{n}.xml").as_ref()).expect("written");
        }
        assert_eq!(recent.paths().len(), MAX_RECENT);
        assert_eq!(recent.paths()[0], PathBuf::from("/19.xml"));
    }

    #[test]
    fn a_list_that_is_not_there_is_empty() {
        assert!(Recent::in_folder("/nowhere/at/all".as_ref()).paths().is_empty());
    }
}
