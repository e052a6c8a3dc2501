//! The file and those that it includes, on the disk: parsed again only when their bytes have
//! changed, and written only if they still have the expected bytes.

use std::path::{Path, PathBuf};

use armor_files::save_atomically;
use armor_robotfile::{Findings, NeededPath, Reading, read, read_bytes};

use crate::versions::Write;

/// Each file with its bytes; none if it could not be read.
pub(crate) type FileSnapshot = Vec<(PathBuf, Option<Vec<u8>>)>;

/// The status of the files.
#[derive(Clone)]
pub(crate) struct WatchedFiles {
    file: PathBuf,
    known: FileSnapshot,
}

impl WatchedFiles {
    /// Nothing is read yet. A relative path starts from the current folder.
    pub(crate) fn new(file: PathBuf) -> Self {
        Self { file, known: FileSnapshot::new() }
    }

    /// Reads the files; `None` if their bytes are the known ones.
    pub(crate) fn read_if_changed(&self) -> Option<(FileSnapshot, Reading)> {
        // The bytes decide which files are named: the same bytes are the same files.
        let same = |(path, bytes): &(PathBuf, Option<Vec<u8>>)| read_bytes(path).ok() == *bytes;
        if !self.known.is_empty() && self.known.iter().all(same) {
            return None;
        }
        let mut snapshot = FileSnapshot::new();
        let reading = read(&self.file, &mut |path| {
            let bytes = read_bytes(path);
            snapshot.push((path.to_path_buf(), bytes.as_ref().ok().cloned()));
            bytes
        });
        (snapshot != self.known).then_some((snapshot, reading))
    }

    /// Sets the known bytes.
    pub(crate) fn set_known(&mut self, snapshot: FileSnapshot) {
        self.known = snapshot;
    }

    /// Every file that is known to be named.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &Path> {
        self.known.iter().map(|(path, _)| path.as_path())
    }

    /// Writes a file if all of them are still as expected.
    ///
    /// # Errors
    /// As [`write`].
    pub(crate) fn write_file(&mut self, wanted: &Write) -> Result<Findings, String> {
        let findings = write(wanted)?;
        let known = wanted.expected.iter().map(|(path, expected)| {
            let text = if *path == wanted.file { &wanted.text } else { expected };
            (path.clone(), Some(text.clone().into_bytes()))
        });
        self.known = known.collect();
        Ok(findings)
    }
}

/// Writes a file, whole or not at all, if all of them are still as expected. Returns which of the
/// files that it needs are missing.
///
/// # Errors
/// In words, with what to do; nothing is written then.
pub fn write(wanted: &Write) -> Result<Findings, String> {
    let Write { expected, file, text, needs } = wanted;
    for (path, expected) in expected {
        if read_bytes(path).ok().as_deref() != Some(expected.as_bytes()) {
            return Err(format!(
                "{} was changed by another program in the meantime; look at it and set the value again",
                path.display()
            ));
        }
    }
    save_atomically(file, text.as_bytes()).map_err(|error| error.to_string())?;
    let mut findings = Findings::default();
    findings.extend(needs.iter().filter_map(NeededPath::find_fault));
    Ok(findings)
}

/// Whether every file exists and is not empty. A missing or empty file may be between two steps of
/// a save.
pub(crate) fn is_whole(snapshot: &FileSnapshot) -> bool {
    snapshot.iter().all(|(_, bytes)| bytes.as_ref().is_some_and(|bytes| !bytes.is_empty()))
}
