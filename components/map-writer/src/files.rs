//! Files that are complete or absent: written next to their place, then renamed into it.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use armor_files::{create_private_folder, open_own_file, save_private_file};

/// A file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct WriteError {
    /// The file or folder in question.
    pub path: PathBuf,
    /// The system's error.
    pub source: std::io::Error,
}

/// Replaces a file atomically: readers see the old content or the new one, never a part.
pub(crate) fn replace_file(path: &Path, content: &[u8]) -> Result<(), WriteError> {
    save_private_file(path, content)
        .map_err(|error| WriteError { path: path.to_owned(), source: error.reason })
}

/// Adds to the end of a file, which is made if it does not exist; all of it or nothing.
pub(crate) fn append_to_file(path: &Path, content: &[u8]) -> Result<(), WriteError> {
    let opened = open_own_file(path, OpenOptions::new().append(true));
    let written = opened.and_then(|mut file| {
        let length = file.metadata()?.len();
        // On a full disk half a line may get in; it would stand twice after the next try.
        file.write_all(content).inspect_err(|_| file.set_len(length).unwrap_or(()))
    });
    written.map_err(|source| WriteError { path: path.to_owned(), source })
}

/// Makes a folder and those above it.
pub(crate) fn make_folder(path: &Path) -> Result<(), WriteError> {
    create_private_folder(path).map_err(|source| WriteError { path: path.to_owned(), source })
}

#[cfg(test)]
pub(crate) mod tests {
    use std::fs;

    use super::*;

    /// A folder of its own for one test, removed at its end.
    pub(crate) struct Scratch(pub(crate) PathBuf);

    impl Scratch {
        pub(crate) fn new(name: &str) -> Self {
            let path = std::env::temp_dir()
                .join(format!("armor-map-writer-{}-{name}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_file_is_replaced_and_no_other_file_remains() {
        let scratch = Scratch::new("replace");
        let path = scratch.0.join("map.txt");
        replace_file(&path, b"first").unwrap();
        replace_file(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(&scratch.0).unwrap().count(), 1);
    }

    #[test]
    fn a_failure_names_the_file() {
        let scratch = Scratch::new("failure");
        let path = scratch.0.join("missing").join("map.png");
        let error = replace_file(&path, b"lost").unwrap_err().to_string();
        assert!(error.contains("missing/map.png"), "{error}");
    }
}
