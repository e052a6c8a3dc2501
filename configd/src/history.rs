//! The last accepted versions, with the bytes of all their files.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use armor_robotfile::{Configuration, Source, read};

/// Accepted versions that are kept: enough to see the changes of a day of tuning.
pub const MAX_VERSIONS: usize = 32;
/// Bytes of their files that are kept in total; beyond it the oldest versions are dropped.
const MAX_KEPT_LEN: usize = 32 << 20;

/// An accepted version: the bytes of its files, the one that was asked for first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptVersion {
    /// Its number.
    pub number: u64,
    /// The path and text of each file.
    pub files: Vec<(PathBuf, String)>,
}

impl KeptVersion {
    /// Reads these files again. They were valid once, so the list is not empty.
    pub(crate) fn read_files(&self) -> armor_robotfile::Reading {
        let first = self.files.first().map_or(Path::new(""), |(path, _)| path);
        read(first, &mut |path| {
            let found = self.files.iter().find(|(known, _)| known == path);
            let (_, text) = found.ok_or(io::ErrorKind::NotFound)?;
            Ok(text.clone().into_bytes())
        })
    }
}

/// Versions in a row, the newest last.
#[derive(Debug, Default)]
pub(crate) struct VersionHistory {
    versions: VecDeque<(u64, Vec<Arc<Source>>)>,
}

impl VersionHistory {
    /// Adds the newest version, and drops the oldest ones beyond the limits.
    pub(crate) fn add_version(&mut self, number: u64, sources: Vec<Arc<Source>>) {
        self.versions.push_back((number, sources));
        let len = |sources: &[Arc<Source>]| -> usize {
            sources.iter().map(|source| source.text().len()).sum()
        };
        let mut len_in_total: usize = self.versions.iter().map(|(_, sources)| len(sources)).sum();
        while self.versions.len() > MAX_VERSIONS
            || (len_in_total > MAX_KEPT_LEN && self.versions.len() > 2)
        {
            len_in_total -= self.versions.pop_front().map_or(0, |(_, sources)| len(&sources));
        }
    }

    /// Returns the number of the oldest version that is kept.
    pub(crate) fn oldest_number(&self) -> u64 {
        self.versions.front().map_or(0, |(number, _)| *number)
    }

    /// The bytes of a version.
    pub(crate) fn kept_version(&self, number: u64) -> Option<KeptVersion> {
        let (number, sources) = self.versions.iter().find(|(known, _)| *known == number)?;
        let files = sources.iter();
        let files = files.map(|source| (source.path().to_path_buf(), source.text().to_owned()));
        Some(KeptVersion { number: *number, files: files.collect() })
    }

    /// Returns the configuration of a version, without overrides.
    pub(crate) fn configuration(&self, number: u64) -> Option<Configuration> {
        self.kept_version(number)?.read_files().configuration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_bounded_in_number_and_in_bytes() {
        let mut history = VersionHistory::default();
        for number in 1..=40 {
            history.add_version(number, vec![Source::new("a.xml", "<armor/>")]);
        }
        assert_eq!((history.oldest_number(), history.versions.len()), (9, MAX_VERSIONS));
        for number in 41..=60 {
            history.add_version(number, vec![Source::new("a.xml", "x".repeat(4 << 20))]);
        }
        assert_eq!(history.versions.len(), 8);
        assert!(history.kept_version(52).is_none() && history.kept_version(53).is_some());
    }
}
