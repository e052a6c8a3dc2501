//! Lines into files: one per process, and `all.log`.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};

use super::render::Plain;
use super::{LogLevel, RunLog};

/// The files that are open.
pub struct LogFiles {
    directory: PathBuf,
    all: Target,
    of: HashMap<Arc<str>, Target>,
}

/// A file, or the one that could not be opened.
struct Target {
    path: PathBuf,
    file: Option<BufWriter<File>>,
    /// Its failure was reported; it is reported once.
    reported: bool,
}

impl LogFiles {
    /// Makes the folder and `all.log`.
    ///
    /// # Errors
    /// If either cannot be made.
    pub fn create(directory: &Path) -> Result<Self> {
        fs::create_dir_all(directory)
            .with_context(|| format!("the folder {} cannot be made", directory.display()))?;
        let all = directory.join("all.log");
        let file = File::create(&all)
            .with_context(|| format!("the file {} cannot be written", all.display()))?;
        let all = Target { path: all, file: Some(BufWriter::new(file)), reported: false };
        Ok(Self { directory: directory.into(), all, of: HashMap::new() })
    }

    /// Writes what comes until the end; what waits is on disk before waiting for more.
    pub fn write_all(mut self, log: &RunLog) {
        while let Some((lines, left_out)) = log.files.take_lines() {
            for line in &lines {
                let text = Plain(line, 0).to_string();
                self.all.write(&text);
                let directory = &self.directory;
                self.of
                    .entry(line.name.clone())
                    .or_insert_with(|| Target::open(directory.join(format!("{}.log", line.name))))
                    .write(&text);
            }
            if left_out > 0 {
                self.all.write(&format!("{left_out} lines were left out: the disk is too slow"));
            }
            for target in self.of.values_mut().chain([&mut self.all]) {
                target.flush(log);
            }
        }
    }
}

impl Target {
    fn open(path: PathBuf) -> Self {
        let file = File::create(&path).ok().map(BufWriter::new);
        Self { path, file, reported: false }
    }

    fn write(&mut self, line: &str) {
        // An error stays in the file's state and shows at the flush.
        if let Some(file) = &mut self.file {
            let _ = writeln!(file, "{line}");
        }
    }

    fn flush(&mut self, log: &RunLog) {
        let failure = match &mut self.file {
            Some(file) => file.flush().err().map(|error| error.to_string()),
            None => Some("it could not be opened".into()),
        };
        if let Some(failure) = failure
            && !std::mem::replace(&mut self.reported, true)
        {
            let text = format!("lines are lost: {}: {failure}", self.path.display());
            log.report("launcher", LogLevel::Error, text);
        }
    }
}
