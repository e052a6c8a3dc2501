//! A version of the file that a mission is played from, with all that it names: what the journal
//! holds of it, so that the plan can be made again whatever has become of the disk.

use armor_robotfile::{Colours, Configuration, Findings, check, read};
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};

/// The text of the file and of those that it names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// As configd counts them, from 1; 0 for one that it has not numbered.
    pub number: u64,
    /// The files, the mission's first.
    pub files: Vec<FileText>,
}

/// One file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileText {
    /// As it is named.
    pub path: PathBuf,
    /// What it held.
    pub text: String,
}

impl Version {
    /// What a configuration was read from.
    pub fn of(configuration: &Configuration, number: u64) -> Self {
        let file = |source: &std::sync::Arc<armor_robotfile::Source>| FileText {
            path: source.path().to_path_buf(),
            text: source.text().to_owned(),
        };
        Self { number, files: configuration.sources.iter().map(file).collect() }
    }

    /// Reads the configuration. Values that override the file are not in it: no plan depends on
    /// them.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn configuration(&self) -> Result<Configuration, Findings> {
        let first = self.files.first().map_or(Path::new(""), |file| &file.path);
        let reading = read(first, &mut |path| {
            let found = self.files.iter().find(|file| file.path == path);
            Ok(found.ok_or(io::ErrorKind::NotFound)?.text.clone().into_bytes())
        });
        let reading = check(reading, &[], None);
        match reading.configuration {
            Some(configuration) if !reading.findings.has_errors() => Ok(configuration),
            _ => Err(reading.findings),
        }
    }

    /// Whether the files are the same, whatever the numbers.
    pub fn is_same(&self, other: &Self) -> bool {
        self.files == other.files
    }
}

/// Findings as one text.
pub fn in_words(findings: Findings) -> String {
    findings.render(Colours::No).trim_end().to_owned()
}
