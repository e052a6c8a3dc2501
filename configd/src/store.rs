//! The accepted versions on the disk, from which a restarted configd continues when the file is not
//! valid: a folder per version, with the bytes of its files and an index of their paths.
//!
//! A version is complete or absent: it is written into a temporary folder, synced, and renamed.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use armor_files::{create_private_folder, save_folder_atomically};
use armor_robotfile::read_bytes;
use tracing::warn;

use crate::history::{KeptVersion, MAX_VERSIONS};

/// The file of a version that lists the others: a line for each, its name, a tab, its path.
const INDEX: &str = "index";

/// The files of the versions of `file` that are kept in `folder`, each once; none if none is.
pub fn kept_files(folder: &Path, file: &Path) -> BTreeSet<PathBuf> {
    let versions = VersionStore::new(folder.to_path_buf()).load_versions(file);
    versions.into_iter().flat_map(|kept| kept.files).map(|(path, _)| path).collect()
}

/// The newest version of `file` that is kept in `folder`, if its number is above `known`. Costs
/// little while there is none.
pub fn newer_than(known: u64, folder: &Path, file: &Path) -> Option<KeptVersion> {
    let numbers = kept_numbers(folder).into_iter().filter(|number| *number > known);
    let store = VersionStore::new(folder.to_path_buf());
    let mut newer = numbers.rev().filter_map(|number| store.load_version(number).ok());
    newer.find(|kept| kept.files.first().is_some_and(|(path, _)| path == file))
}

/// The numbers of the versions that are kept in `folder`, in ascending order; none if none is.
pub fn kept_numbers(folder: &Path) -> Vec<u64> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut numbers: Vec<u64> = names.filter_map(|name| name.parse().ok()).collect();
    numbers.sort_unstable();
    numbers
}

/// The version of this number that is kept in `folder`.
///
/// # Errors
/// If it is not there, or is damaged.
pub fn kept_version(folder: &Path, number: u64) -> io::Result<KeptVersion> {
    VersionStore::new(folder.to_path_buf()).load_version(number)
}

/// A folder of versions.
#[derive(Clone, Debug)]
pub(crate) struct VersionStore {
    folder: PathBuf,
}

impl VersionStore {
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The versions of `file` that are kept, the oldest first. What cannot be read is passed over.
    pub(crate) fn load_versions(&self, file: &Path) -> Vec<KeptVersion> {
        let mut numbers = kept_numbers(&self.folder);
        let newest = numbers.split_off(numbers.len().saturating_sub(MAX_VERSIONS));
        let versions = newest.into_iter().filter_map(|number| {
            let version = self.load_version(number);
            version.inspect_err(|error| warn!(number, %error, "a kept version is not read")).ok()
        });
        versions.filter(|kept| kept.files.first().is_some_and(|(path, _)| path == file)).collect()
    }

    fn load_version(&self, number: u64) -> io::Result<KeptVersion> {
        let folder = self.folder.join(number.to_string());
        let text = |name: &str| -> io::Result<String> {
            String::from_utf8(read_bytes(&folder.join(name))?).map_err(io::Error::other)
        };
        let mut files = Vec::new();
        for line in text(INDEX)?.lines() {
            let (name, path) = line.split_once('\t').ok_or(io::ErrorKind::InvalidData)?;
            if name.contains('/') {
                return Err(io::ErrorKind::InvalidData.into());
            }
            files.push((PathBuf::from(path), text(name)?));
        }
        Ok(KeptVersion { number, files })
    }

    /// Whether a version is stored completely.
    pub(crate) fn is_stored(&self, kept: &KeptVersion) -> bool {
        self.load_version(kept.number).is_ok_and(|there| there == *kept)
    }

    /// Stores a version, and removes the oldest one beyond the limit.
    ///
    /// # Errors
    /// The error of the operating system; the versions stored before are untouched.
    pub(crate) fn store_version(&self, kept: &KeptVersion) -> io::Result<()> {
        create_private_folder(&self.folder)?;
        let mut index = String::new();
        let mut files = Vec::new();
        for (number, (path, text)) in kept.files.iter().enumerate() {
            let file_name = path.file_name().and_then(|name| name.to_str()).unwrap_or("file");
            // Two files of different folders may have one name.
            let name = format!("{}-{file_name}", number + 1);
            let path = path.to_str().filter(|path| !path.contains(['\n', '\t']));
            let path = path.ok_or_else(|| {
                io::Error::other(
                    "a path with a line break or tab, which the index cannot represent",
                )
            })?;
            index += &format!("{name}\t{path}\n");
            files.push((name, text.clone().into_bytes()));
        }
        files.push((INDEX.to_owned(), index.into_bytes()));
        save_folder_atomically(&self.folder.join(kept.number.to_string()), &files)
            .map_err(|error| error.reason)?;
        match kept.number.checked_sub(MAX_VERSIONS as u64) {
            Some(old) => remove_folder(&self.folder.join(old.to_string())),
            None => Ok(()),
        }
    }
}

fn remove_folder(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(number: u64, text: &str) -> KeptVersion {
        let files = ["m/a.xml", "m/parts/a.xml"].map(|path| (path.into(), text.to_owned()));
        KeptVersion { number, files: files.into() }
    }

    #[test]
    fn whole_versions_of_the_same_file_come_back() {
        let folder = std::env::temp_dir().join(format!("armor-store-{}", std::process::id()));
        remove_folder(&folder).expect("ours");
        let store = VersionStore::new(folder.clone());
        assert!(store.load_versions(Path::new("m/a.xml")).is_empty(), "nothing is there yet");
        for number in 1..=MAX_VERSIONS as u64 + 2 {
            store.store_version(&kept(number, &format!("text {number}"))).expect("writable");
        }
        store.store_version(&kept(9, "again")).expect("writable");
        assert!(store.is_stored(&kept(12, "text 12")) && !store.is_stored(&kept(12, "else")));
        // Cut off in the middle of keeping, and damaged.
        fs::create_dir(folder.join(".40.new")).expect("writable");
        fs::remove_file(folder.join("12/2-a.xml")).expect("it is there");
        let loaded = store.load_versions(Path::new("m/a.xml"));
        let numbers: Vec<_> = loaded.iter().map(|kept| kept.number).collect();
        let wanted: Vec<_> = (3..=MAX_VERSIONS as u64 + 2).filter(|number| *number != 12).collect();
        assert_eq!(numbers, wanted);
        assert!(!store.is_stored(&kept(12, "text 12")));
        assert_eq!(loaded[6], kept(9, "again"));
        assert!(store.load_versions(Path::new("m/b.xml")).is_empty(), "of another file");
        assert_eq!(kept_numbers(&folder).last(), Some(&(MAX_VERSIONS as u64 + 2)));
        assert_eq!(kept_version(&folder, 9).ok(), Some(kept(9, "again")));
        assert!(kept_version(&folder, 12).is_err(), "it is damaged");
        let newer = |known| newer_than(known, &folder, Path::new("m/a.xml"));
        let newest = MAX_VERSIONS as u64 + 2;
        assert_eq!(newer(newest - 1).map(|kept| kept.number), Some(newest));
        assert_eq!(newer(newest), None);
        fs::remove_file(folder.join(format!("{newest}/index"))).expect("it is there");
        assert_eq!(newer(newest - 2).map(|kept| kept.number), Some(newest - 1), "whole ones only");
        remove_folder(&folder).expect("ours");
    }
}
