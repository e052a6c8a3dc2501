//! One small file per running system of this user, by which tools find it. The launcher holds a
//! lock on its file: if another process can take the lock, the launcher has ended and the file is
//! removed.

use std::fs::{self, DirBuilder, File};
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use armor_files::{Durability, PendingFile, SaveError};
use armor_sdk::directory::{self, HostPlace};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The record of a running system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Name of the system.
    pub system: String,
    /// The names that the system and the mission have in the file.
    #[serde(default)]
    pub file_names: Vec<String>,
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
    /// The place of this host, if components run on others, too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<RecordedPlace>,
}

/// This host in a system of several, for the tools that connect to it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecordedPlace {
    /// Its name in the system.
    pub host: String,
    /// Where its router to the other hosts listens.
    pub router: SocketAddr,
}

impl From<HostPlace> for RecordedPlace {
    fn from(HostPlace { host, router }: HostPlace) -> Self {
        Self { host, router }
    }
}

/// Gives this process the way to the other hosts of the system whose registry is at `registry`, if that
/// has any: its later connections to components there go through the router of this host.
pub fn adopt_place(registry: SocketAddr) {
    let records = record_directory().and_then(|directory| list_running(&directory));
    let record = records.unwrap_or_default().into_iter().find(|it| it.registry == registry);
    let place = record.and_then(|record| record.place);
    directory::adopt_place(place.map(|RecordedPlace { host, router }| HostPlace { host, router }));
}

impl RunRecord {
    /// Resolves a path of the run, which is relative to the launcher's working directory.
    pub fn resolve(&self, path: &Path) -> PathBuf {
        let folder = fs::read_link(format!("/proc/{}/cwd", self.pid));
        folder.map_or_else(|_| path.into(), |folder| folder.join(path))
    }

    /// Returns the record with absolute paths, which stay valid after the launcher has ended.
    pub fn resolved(mut self) -> Self {
        (self.file, self.out) = (self.resolve(&self.file), self.resolve(&self.out));
        self
    }

    /// Returns whether `name` names its file, with or without folder and ending, or is the name of
    /// the system or of the mission in the file.
    pub fn is_also_called(&self, name: &str) -> bool {
        let is_file = |part: Option<&std::ffi::OsStr>| part.is_some_and(|part| part == name);
        self.file_names.iter().any(|other| other == name)
            || [self.file.file_name(), self.file.file_stem(), Some(self.file.as_os_str())]
                .into_iter()
                .any(is_file)
    }

    /// Returns whether it runs this file.
    pub fn runs(&self, file: &Path) -> bool {
        let whole = |path: &Path| path.canonicalize().ok();
        whole(&self.resolve(&self.file)).is_some_and(|path| Some(path) == whole(file))
    }
}

/// Why the files of running systems cannot be used.
#[derive(Debug, Error)]
pub enum SystemsError {
    /// Their folder cannot be made.
    #[error("the folder {} cannot be made: {error}", path.display())]
    Folder {
        /// The path.
        path: PathBuf,
        /// The cause.
        error: io::Error,
    },
    /// Their folder belongs to another user.
    #[error("{} is not this user's folder; remove it or set XDG_RUNTIME_DIR", .0.display())]
    NotOurs(PathBuf),
    /// Their folder cannot be read.
    #[error("{} cannot be read: {error}", path.display())]
    Read {
        /// The path.
        path: PathBuf,
        /// The cause.
        error: io::Error,
    },
    /// One cannot be written.
    #[error("{} cannot be written: {error}", path.display())]
    Write {
        /// The path.
        path: PathBuf,
        /// The cause.
        error: io::Error,
    },
}

/// The file of a running system; removed when this is dropped.
#[derive(Debug)]
pub struct RunFile {
    path: PathBuf,
    _lock: File,
}

/// Returns the folder of the files: `$XDG_RUNTIME_DIR/armor`, or a private one in the temporary
/// folder. Creates it if needed.
///
/// # Errors
/// If it cannot be created, or belongs to another user.
pub fn record_directory() -> Result<PathBuf, SystemsError> {
    let user = rustix::process::getuid().as_raw();
    let path = match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(directory) if !directory.is_empty() => Path::new(&directory).join("armor"),
        _ => std::env::temp_dir().join(format!("armor-{user}")),
    };
    let made = DirBuilder::new().recursive(true).mode(0o700).create(&path);
    let owner = made.and_then(|()| fs::symlink_metadata(&path));
    let owner = owner.map_err(|error| SystemsError::Folder { path: path.clone(), error })?;
    if !owner.is_dir() || owner.uid() != user {
        return Err(SystemsError::NotOurs(path));
    }
    Ok(path)
}

impl RunFile {
    /// Writes the file, by which tools find the system.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(directory: &Path, record: &RunRecord) -> Result<Self, SystemsError> {
        let path = directory.join(format!("{}-{}.json", record.system, record.pid));
        let write = || -> io::Result<File> {
            let failed = |error: SaveError| error.reason;
            let mut pending = PendingFile::create_private(&path).map_err(failed)?;
            // Locked before it gets its final name: no tool sees it unlocked.
            pending.file().try_lock()?;
            let text = serde_json::to_string_pretty(record)?;
            pending.write(text.as_bytes()).map_err(failed)?;
            // Not synced: the record ends with the process.
            pending.commit(Durability::Unsynced).map_err(failed)
        };
        match write() {
            Ok(lock) => Ok(Self { path, _lock: lock }),
            Err(error) => Err(SystemsError::Write { path, error }),
        }
    }
}

impl Drop for RunFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Returns the running systems, oldest first; removes the files of those that have ended.
///
/// # Errors
/// If the folder cannot be read.
pub fn list_running(directory: &Path) -> Result<Vec<RunRecord>, SystemsError> {
    let mut records = Vec::new();
    let entries = fs::read_dir(directory)
        .map_err(|error| SystemsError::Read { path: directory.into(), error })?;
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        // A file that disappears meanwhile belongs to a system that has ended.
        let Ok(file) = File::open(&path) else { continue };
        if file.try_lock_shared().is_ok() {
            let _ = fs::remove_file(&path);
            // The launcher's socket for requests, which a killed launcher leaves behind.
            let _ = fs::remove_file(path.with_extension("sock"));
            continue;
        }
        if let Ok(record) = serde_json::from_reader(io::BufReader::new(file)) {
            records.push(record);
        }
    }
    records.sort_by(|a: &RunRecord, b: &RunRecord| a.started_s.total_cmp(&b.started_s));
    Ok(records)
}
