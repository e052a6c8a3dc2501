//! The executables that the launcher has sent: kept by kind and hash, so that what runs is the build
//! with which the file was checked, and no other.

use std::collections::BTreeSet;
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use anyhow::{Context, Result};
use armor_files::{Durability, PendingFile, create_own_folder, create_unlinked_folder};
use armor_wire::hello::{Refusal, RefusalCode};
use armor_wire::remote_process::{MAX_EXECUTABLE_LEN, RemoteStart};
use parking_lot::Mutex;
use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;

use crate::kinds::Origin;
use crate::kinds::build::{BuildHasher, find_build};

/// Its folder in that of the agent; no system can have this name.
const FOLDER: &str = ".executables";
/// Only this user may read and execute them.
const MODE: u32 = 0o700;
/// Builds of one kind that are kept: that of each system, and one before.
const MAX_BUILDS: usize = 3;
/// Length of a hash in hexadecimal digits.
const HASH_LEN: usize = 64;

/// The folder.
pub(super) struct ExecutableStore {
    folder: PathBuf,
    /// The names that are being received.
    arriving: Arc<Mutex<BTreeSet<String>>>,
}

/// An executable that is being received. If it is dropped before its end, nothing remains.
pub(super) struct ArrivingExecutable {
    file: PendingFile,
    hasher: BuildHasher,
    expected: String,
    path: PathBuf,
    _name: ArrivingName,
}

impl ExecutableStore {
    /// Makes the folder in that of the agent, `out`.
    ///
    /// # Errors
    /// If it cannot be made, or others could change what is in it.
    pub(super) fn open(out: &Path) -> Result<Self> {
        let folder = out.join(FOLDER);
        let why = || format!("the folder {} cannot be used", folder.display());
        create_own_folder(out).with_context(why)?;
        create_unlinked_folder(&folder).with_context(why)?;
        let folder = folder.canonicalize().with_context(why)?;
        Ok(Self { folder, arriving: Arc::default() })
    }

    /// Returns the executable of a kind with this hash. One whose bytes have changed is removed.
    pub(super) fn find(&self, kind: &str, hash: &str) -> Option<PathBuf> {
        let path = self.folder.join(name_file(kind, hash).ok()?);
        if !path.is_file() {
            return None;
        }
        if find_build(&Origin::Executable(path.clone())) == hash {
            return Some(path);
        }
        tracing::warn!("{} has changed since it was received; it is removed", path.display());
        let _ = fs::remove_file(path);
        None
    }

    /// Begins to receive the executable that `start` asks for.
    ///
    /// # Errors
    /// If it is too long, the disk has no room for it, or it arrives already.
    pub(super) fn begin(&self, start: &RemoteStart) -> Result<ArrivingExecutable, Refusal> {
        let refuse = |text: String| Refusal::new(RefusalCode::WrongPurpose, text);
        let RemoteStart { kind, build, executable_len, .. } = start;
        let name = name_file(kind, build).map_err(refuse)?;
        if *executable_len > MAX_EXECUTABLE_LEN {
            return Err(refuse(format!(
                "the executable of {kind} has {executable_len} bytes, and at most \
                 {MAX_EXECUTABLE_LEN} are accepted; copy it into a folder that `armor host \
                 --components FOLDER` names"
            )));
        }
        if !self.arriving.lock().insert(name.clone()) {
            let text = format!("the executable of {kind} is being copied for another component");
            return Err(Refusal::new(RefusalCode::Limit, text));
        }
        let path = self.folder.join(&name);
        let name = ArrivingName { name, all: Arc::clone(&self.arriving) };
        let begun = PendingFile::create_private(&path).map_err(|error| error.to_string());
        let begun = begun.and_then(|file| {
            reserve(&file, *executable_len).map(|()| file).map_err(|error| error.to_string())
        });
        match begun {
            Ok(file) => Ok(ArrivingExecutable {
                file,
                hasher: BuildHasher::default(),
                expected: build.clone(),
                path,
                _name: name,
            }),
            Err(error) => {
                let folder = self.folder.display();
                Err(refuse(format!("the executable of {kind} cannot be kept in {folder}: {error}")))
            }
        }
    }

    /// Removes the oldest builds of a kind. A process that runs one is not affected.
    pub(super) fn remove_old(&self, kind: &str) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let of_kind = |path: &PathBuf| {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            name.rsplit_once('-').is_some_and(|(own, hash)| own == kind && is_hash(hash))
        };
        let mut builds: Vec<(SystemTime, PathBuf)> = entries
            .flatten()
            .map(|entry| entry.path())
            .filter(of_kind)
            .filter_map(|path| Some((fs::metadata(&path).ok()?.modified().ok()?, path)))
            .collect();
        builds.sort();
        let surplus = builds.len().saturating_sub(MAX_BUILDS);
        for (_, path) in builds.drain(..surplus) {
            let _ = fs::remove_file(path);
        }
    }
}

impl ArrivingExecutable {
    /// Takes the next bytes.
    ///
    /// # Errors
    /// If the disk is full or broken.
    pub(super) fn take(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.hasher.update(bytes);
        self.file.write(bytes).map_err(std::io::Error::other)
    }

    /// Keeps it, if it is what was announced. Waits for the disk.
    ///
    /// # Errors
    /// If its hash is another one, or the disk is full or broken.
    pub(super) fn finish(mut self) -> Result<(), Refusal> {
        let refuse = |text: String| Err(Refusal::new(RefusalCode::WrongPurpose, text));
        let hash = std::mem::take(&mut self.hasher).finish();
        if hash != self.expected {
            return refuse(format!(
                "what has arrived has the hash {hash}, not {}: the executable was replaced since \
                 the file was checked; start the system again",
                self.expected
            ));
        }
        let Self { file, path, _name, .. } = self;
        let kept = file
            .file()
            .set_permissions(Permissions::from_mode(MODE))
            .map_err(|error| error.to_string())
            .and_then(|()| {
                file.commit(Durability::Synced).map(drop).map_err(|error| error.to_string())
            });
        match kept {
            Ok(()) => Ok(()),
            Err(error) => refuse(format!("{} cannot be kept: {error}", path.display())),
        }
    }
}

/// A name for which an executable arrives; free again when this is dropped.
struct ArrivingName {
    name: String,
    all: Arc<Mutex<BTreeSet<String>>>,
}

impl Drop for ArrivingName {
    fn drop(&mut self) {
        self.all.lock().remove(&self.name);
    }
}

fn reserve(file: &PendingFile, len: u64) -> std::io::Result<()> {
    match fallocate(file.file(), FallocateFlags::KEEP_SIZE, 0, len) {
        // A file system without reservations: a full disk is noticed later.
        Ok(()) | Err(Errno::OPNOTSUPP | Errno::NOSYS) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// The name of the file; the parts are of another host.
fn name_file(kind: &str, hash: &str) -> Result<String, String> {
    match is_hash(hash) {
        true => Ok(format!("{kind}-{hash}")),
        false => Err(format!("{hash:?} is no hash of an executable")),
    }
}

fn is_hash(text: &str) -> bool {
    text.len() == HASH_LEN && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::ScratchFolder;
    use armor_wire::remote_process::{CutOff, ProcessResources, Takeover};

    const BYTES: &[u8] = b"the bytes of a program";

    fn start(build: &str, len: u64) -> RemoteStart {
        RemoteStart {
            system: "rover".into(),
            run: 1,
            component: "arm".into(),
            kind: "grip-per".into(),
            components: Vec::new(),
            manifest: 0,
            build: build.into(),
            executable_len: len,
            variables: Vec::new(),
            settings: Vec::new(),
            resources: ProcessResources::default(),
            cut_off: CutOff::default(),
            is_commanded: false,
            hosts: Vec::new(),
            gate_port: 1,
            takeover: Takeover::Never,
        }
    }

    fn hash_of(bytes: &[u8]) -> String {
        let mut hasher = BuildHasher::default();
        hasher.update(bytes);
        hasher.finish()
    }

    fn receive(store: &ExecutableStore, bytes: &[u8]) -> String {
        let hash = hash_of(bytes);
        let mut arriving = store.begin(&start(&hash, bytes.len() as u64)).expect("there is room");
        arriving.take(bytes).expect("there is room");
        arriving.finish().expect("the right bytes");
        hash
    }

    fn count_files(store: &ExecutableStore) -> usize {
        fs::read_dir(&store.folder).expect("the folder").count()
    }

    #[test]
    fn what_has_arrived_is_found_until_it_changes() {
        let scratch = ScratchFolder::new("executables");
        let store = ExecutableStore::open(&scratch.path().join("out")).expect("a folder");
        let hash = receive(&store, BYTES);
        let path = store.find("grip-per", &hash).expect("it is kept");
        let mode = fs::metadata(&path).expect("a file").permissions().mode();
        assert_eq!((mode & 0o777, fs::read(&path).expect("a file")), (MODE, BYTES.to_vec()));
        assert_eq!(store.find("per", &hash), None);
        fs::write(&path, "other bytes").expect("it is ours");
        assert_eq!(store.find("grip-per", &hash), None);
        assert_eq!(count_files(&store), 0);
    }

    #[test]
    fn nothing_remains_of_a_copy_that_is_cut_or_has_another_hash() {
        let scratch = ScratchFolder::new("executables-cut");
        let store = ExecutableStore::open(scratch.path()).expect("a folder");
        let hash = hash_of(BYTES);
        let wanted = start(&hash, BYTES.len() as u64);
        let mut cut = store.begin(&wanted).expect("there is room");
        cut.take(&BYTES[..5]).expect("there is room");
        let twice = store.begin(&wanted).err().expect("it arrives already");
        assert_eq!(twice.code, RefusalCode::Limit);
        drop(cut);
        assert_eq!(count_files(&store), 0);
        let mut wrong = store.begin(&wanted).expect("there is room again");
        wrong.take(b"other bytes").expect("there is room");
        let refusal = wrong.finish().expect_err("another hash");
        assert!(refusal.text.contains("was replaced since the file was checked"), "{refusal}");
        assert_eq!((store.find("grip-per", &hash), count_files(&store)), (None, 0));
    }

    #[test]
    fn what_is_too_long_or_no_hash_is_refused_and_old_builds_go() {
        let scratch = ScratchFolder::new("executables-old");
        let store = ExecutableStore::open(scratch.path()).expect("a folder");
        let hash = hash_of(BYTES);
        for (build, len) in [
            (hash.as_str(), MAX_EXECUTABLE_LEN + 1),
            ("../../bin/sh", 1),
            ("", 1),
            (&hash.to_uppercase(), 1),
        ] {
            let refusal = store.begin(&start(build, len)).err().expect("it is refused");
            assert_eq!(refusal.code, RefusalCode::WrongPurpose, "{build} {len}");
        }
        let hashes: Vec<_> =
            (0..=MAX_BUILDS).map(|number| receive(&store, &[number as u8])).collect();
        let of_other_kind = store.folder.join(format!("grip-{hash}"));
        fs::write(&of_other_kind, "").expect("it is ours");
        for (age, hash) in hashes.iter().rev().enumerate() {
            let path = store.folder.join(format!("grip-per-{hash}"));
            let file = fs::File::options().write(true).open(path).expect("a file");
            let days = std::time::Duration::from_secs(86_400 * age as u64);
            file.set_modified(SystemTime::now() - days).expect("it is ours");
        }
        store.remove_old("grip-per");
        assert_eq!(store.find("grip-per", &hashes[0]), None, "the oldest");
        assert!(hashes[1..].iter().all(|hash| store.find("grip-per", hash).is_some()));
        assert!(of_other_kind.exists());
    }
}
