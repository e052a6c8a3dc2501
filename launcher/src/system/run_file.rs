//! One small file per running system of this user, so that `armor ps` finds it without being told.
//! The launcher holds a lock on its file: whose lock can be taken is dead, and its file is removed.

use std::fs::{self, DirBuilder, File};
use std::io::Write;
use std::net::SocketAddr;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

/// What is known of a running system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Name of the system.
    pub system: String,
    /// The launcher's process id.
    pub pid: u32,
    /// Where the registry listens.
    pub registry: SocketAddr,
    /// Seconds since the Unix epoch.
    pub started_s: f64,
    /// The file that is run.
    pub file: PathBuf,
    /// The folder for what the run produces.
    pub out: PathBuf,
}

/// The file of a running system; removed when this is dropped.
#[derive(Debug)]
pub struct RunFile {
    path: PathBuf,
    _lock: File,
}

/// The folder of the files: `$XDG_RUNTIME_DIR/armor`, or one in `/tmp` that is this user's alone.
///
/// # Errors
/// If it cannot be made, or somebody else's is there.
pub fn directory() -> Result<PathBuf> {
    let user = rustix::process::getuid().as_raw();
    let path = match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(directory) if !directory.is_empty() => Path::new(&directory).join("armor"),
        _ => std::env::temp_dir().join(format!("armor-{user}")),
    };
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(&path)
        .with_context(|| format!("the folder {} cannot be made", path.display()))?;
    let owner = fs::symlink_metadata(&path)?;
    if !owner.is_dir() || owner.uid() != user {
        bail!("{} is not this user's folder; remove it or set XDG_RUNTIME_DIR", path.display());
    }
    Ok(path)
}

impl RunFile {
    /// Makes the system known.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(directory: &Path, record: &Record) -> Result<Self> {
        let path = directory.join(format!("{}-{}.json", record.system, record.pid));
        let draft = path.with_extension("draft");
        let write = || -> Result<File> {
            let mut file = File::create(&draft)?;
            // Locked before it has its name: nobody sees it without the lock.
            file.try_lock()?;
            file.write_all(serde_json::to_string_pretty(record)?.as_bytes())?;
            fs::rename(&draft, &path)?;
            Ok(file)
        };
        let lock = write().with_context(|| format!("{} cannot be written", path.display()))?;
        Ok(Self { path, _lock: lock })
    }
}

impl Drop for RunFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// The systems that run now, oldest first. Files of dead ones are removed.
///
/// # Errors
/// If the folder cannot be read.
pub fn running(directory: &Path) -> Result<Vec<Record>> {
    let mut records = Vec::new();
    let entries = fs::read_dir(directory)
        .with_context(|| format!("{} cannot be read", directory.display()))?;
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        // Who disappears while we look has ended.
        let Ok(file) = File::open(&path) else { continue };
        if file.try_lock_shared().is_ok() {
            let _ = fs::remove_file(&path);
            continue;
        }
        if let Ok(record) = serde_json::from_reader(std::io::BufReader::new(file)) {
            records.push(record);
        }
    }
    records.sort_by(|a: &Record, b: &Record| a.started_s.total_cmp(&b.started_s));
    Ok(records)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::Scratch;

    fn record(system: &str, pid: u32) -> Record {
        Record {
            system: system.into(),
            pid,
            registry: ([127, 0, 0, 1], 7411).into(),
            started_s: f64::from(pid),
            file: "office.xml".into(),
            out: "out/office".into(),
        }
    }

    #[test]
    fn a_system_is_found_while_its_launcher_lives() {
        let scratch = Scratch::new("run-files");
        let first = RunFile::write(scratch.path(), &record("rover", 1)).expect("written");
        let second = RunFile::write(scratch.path(), &record("rover", 2)).expect("written");
        let list = || running(scratch.path()).expect("readable");
        assert_eq!(list(), [record("rover", 1), record("rover", 2)]);
        drop(first);
        assert_eq!(list(), [record("rover", 2)]);
        drop(second);
        assert_eq!(list(), []);
    }

    #[test]
    fn files_of_the_dead_are_removed() {
        let scratch = Scratch::new("stale-run-files");
        let path = scratch.path().join("rover-9.json");
        let text = serde_json::to_string(&record("rover", 9)).expect("serialises");
        fs::write(&path, text).expect("writable");
        assert_eq!(running(scratch.path()).expect("readable"), []);
        assert!(!path.exists());
    }
}
