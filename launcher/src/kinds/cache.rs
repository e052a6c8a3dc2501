//! The descriptions of executables, so that each is asked once and not at every `armor check`:
//! a file of the user's cache folder. It may be lost, full of garbage or read-only; then everything
//! is asked again.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_files::replace_atomically;
use armor_wire::manifest::Manifest;
use serde::{Deserialize, Serialize};
use tracing::debug;

use super::modules::ModulesIdentity;
use super::probe::ProbeProblem;
use super::script::find_interpreter;

/// Set to anything, nothing is remembered.
const OFF: &str = "ARMOR_NO_CACHE";
/// Form of the file.
const VERSION: u32 = 1;
/// Most executables remembered: some hundred components of some systems.
const MAX_ENTRIES: usize = 2000;
/// Longest file read, in bytes.
const MAX_LEN: u64 = 64 << 20;
/// Coarsest step of a file's times: within it a file can change without showing it.
const TICK: Duration = Duration::from_millis(10);

/// Distinguishes one build of an executable from the next.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    len: u64,
    device: u64,
    inode: u64,
    /// Nanoseconds since 1970; `changed` is set by the kernel alone, also where a copy keeps the
    /// time of modification.
    modified_ns: i128,
    changed_ns: i128,
    /// Of a script, what runs it now: another Python may lack what it imports.
    #[serde(default)]
    interpreter: Option<String>,
    /// Of a script of Python, the modules next to it, which it may import.
    #[serde(default)]
    modules: Option<ModulesIdentity>,
}

impl Identity {
    /// That of the file at `path`.
    pub fn of(path: &Path) -> io::Result<Self> {
        let metadata = fs::metadata(path)?;
        let ns = |s: i64, ns: i64| i128::from(s) * 1_000_000_000 + i128::from(ns);
        let interpreter = find_interpreter(path);
        let is_python = interpreter.as_ref().is_some_and(|it| it.contains("python"));
        Ok(Self {
            len: metadata.len(),
            device: metadata.dev(),
            inode: metadata.ino(),
            modified_ns: ns(metadata.mtime(), metadata.mtime_nsec()),
            changed_ns: ns(metadata.ctime(), metadata.ctime_nsec()),
            modules: is_python.then(|| ModulesIdentity::of_script(path)),
            interpreter,
        })
    }

    /// Waits until a further change of the file would show in its times.
    pub fn wait_until_settled(&self) {
        let now_ns = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |now| now.as_nanos());
        let changed_ns = self.modules.as_ref().map_or(0, |it| it.changed_ns).max(self.changed_ns);
        let age_ns = i128::try_from(now_ns).unwrap_or(i128::MAX).saturating_sub(changed_ns);
        // A time in the future is another clock's, and nothing to wait for.
        if let Ok(age_ns) = u64::try_from(age_ns)
            && let Some(left) = TICK.checked_sub(Duration::from_nanos(age_ns))
        {
            thread::sleep(left);
        }
    }
}

/// The file, if anything is remembered at all.
#[derive(Clone, Debug)]
pub struct Cache {
    file: Option<PathBuf>,
}

/// The content of the cache file.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct CachedFiles {
    version: u32,
    executables: BTreeMap<PathBuf, CachedManifest>,
}

#[derive(Debug, Serialize, Deserialize)]
struct CachedManifest {
    identity: Identity,
    /// None if it hangs.
    manifest: Option<Manifest>,
}

impl CachedFiles {
    /// Returns the description of the executable at `path`, or that it hangs, if the file is
    /// unchanged.
    pub fn find_manifest(
        &self,
        path: &Path,
        identity: &Identity,
    ) -> Option<Result<Manifest, ProbeProblem>> {
        let entry = self.executables.get(path).filter(|entry| entry.identity == *identity)?;
        let Some(manifest) = &entry.manifest else { return Some(Err(ProbeProblem::hangs())) };
        // An earlier Armor may have remembered what this one refuses.
        manifest.validate().ok()?;
        Some(Ok(manifest.clone()))
    }
}

impl Cache {
    /// `armor/manifests.json` in the user's cache folder, unless the environment disables it.
    pub fn of_user() -> Self {
        let off = std::env::var_os(OFF).is_some_and(|value| !value.is_empty());
        let absolute = |name| std::env::var_os(name).map(PathBuf::from).filter(|p| p.is_absolute());
        let folder = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")));
        Self { file: folder.filter(|_| !off).map(|folder| folder.join("armor/manifests.json")) }
    }

    /// This file.
    #[cfg(test)]
    pub fn at(file: PathBuf) -> Self {
        Self { file: Some(file) }
    }

    /// What is remembered; nothing if the file cannot be read or is damaged.
    pub fn load_entries(&self) -> CachedFiles {
        let Some(file) = &self.file else { return CachedFiles::default() };
        match read(file) {
            Ok(known) if known.version == VERSION => known,
            Ok(_) => CachedFiles::default(),
            Err(error) => {
                debug!(file = %file.display(), %error, "no manifests remembered");
                CachedFiles::default()
            }
        }
    }

    /// Remembers more. What another `armor` remembers at the same moment may be forgotten, never
    /// mixed up: the file is replaced whole.
    pub fn store_entries(&self, fresh: Vec<(PathBuf, Identity, Option<Manifest>)>) {
        let Some(file) = self.file.as_ref().filter(|_| !fresh.is_empty()) else { return };
        // JSON has no other paths.
        let fresh = fresh.into_iter().filter(|(path, ..)| path.to_str().is_some());
        let mut known = self.load_entries();
        let others = std::mem::take(&mut known.executables);
        known.version = VERSION;
        let fresh =
            fresh.map(|(path, identity, manifest)| (path, CachedManifest { identity, manifest }));
        known.executables.extend(fresh.take(MAX_ENTRIES));
        for (path, entry) in others {
            if known.executables.len() >= MAX_ENTRIES {
                break;
            }
            if path.exists() {
                known.executables.entry(path).or_insert(entry);
            }
        }
        if let Err(error) = replace(file, &known) {
            debug!(file = %file.display(), %error, "manifests are not remembered");
        }
    }
}

fn read(file: &Path) -> io::Result<CachedFiles> {
    if !fs::metadata(file)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut text = String::new();
    File::open(file)?.take(MAX_LEN).read_to_string(&mut text)?;
    Ok(serde_json::from_str(&text)?)
}

fn replace(file: &Path, known: &CachedFiles) -> io::Result<()> {
    let folder = file.parent().ok_or_else(|| io::Error::other("it has no folder"))?;
    fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    let text = serde_json::to_vec(known)?;
    // Not synced: the executables can be asked again.
    replace_atomically(file, &text).map_err(|error| error.reason)
}
