//! The file and those that it names, on the disk: read again only when their bytes are others.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use armor_missions::{Reading, read, read_bytes};

/// What was last seen of the files.
pub(crate) struct Files {
    file: PathBuf,
    /// Each file with its bytes; none if it could not be read.
    seen: Vec<(PathBuf, Option<Vec<u8>>)>,
}

impl Files {
    /// Nothing is read yet. A relative path starts from the current folder.
    pub(crate) fn new(file: PathBuf) -> Self {
        Self { file, seen: Vec::new() }
    }

    /// Reads the files; nothing if they are what they were.
    pub(crate) fn reread(&mut self) -> Option<Reading> {
        let mut seen = Vec::new();
        let reading = read(&self.file, &mut |path| {
            let bytes = read_bytes(path);
            seen.push((path.to_path_buf(), bytes.as_ref().ok().cloned()));
            bytes
        });
        if seen == self.seen {
            return None;
        }
        self.seen = seen;
        Some(reading)
    }

    /// The folders in which a change of the files shows: theirs, and where links lead.
    pub(crate) fn folders(&self) -> BTreeSet<PathBuf> {
        let folder = |path: &Path| {
            let parent = path.parent().unwrap_or(Path::new(""));
            if parent.as_os_str().is_empty() { PathBuf::from(".") } else { parent.to_path_buf() }
        };
        let files = self.seen.iter().map(|(path, _)| path);
        files
            .flat_map(|path| {
                let target = fs::canonicalize(path).ok().map(|target| folder(&target));
                std::iter::once(folder(path)).chain(target)
            })
            .collect()
    }
}
