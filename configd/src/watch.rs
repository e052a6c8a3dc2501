//! Notices when the files change: immediately by watching every folder on the path to them
//! (watching a file alone loses it at the first atomic save), and every [`POLL`] by reading them,
//! for file systems that report no changes. It also writes them, so that no write coincides with a
//! read.
//!
//! A change is accepted when the files have been quiet for [`QUIET`], and what is missing or empty
//! only at the end of [`MAX_WAIT`]: so neither a file caught half-written nor the moment between
//! two steps of an editor's save is taken for what was saved.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use armor_robotfile::{Findings, Manifests, Reading};
use notify::event::{AccessKind, AccessMode, EventKind};
use notify::{RecommendedWatcher, RecursiveMode, Watcher};
use parking_lot::Mutex;
use tokio::sync::{Notify, mpsc};
use tokio::time::{self, Instant, MissedTickBehavior};
use tracing::warn;

use crate::files::{WatchedFiles, is_whole};
use crate::kinds::KindSource;
use crate::versions::Write;
use crate::watched_paths::WatchedPaths;

/// Period with which the files are read without a notice of the kernel.
const POLL: Duration = Duration::from_secs(2);
/// A save is over when nothing happens for this long: longer than the pauses within one, and short
/// enough that a fault is reported within half a second.
const QUIET: Duration = Duration::from_millis(100);
/// Files that are never quiet, or stay missing, are taken as they are after this time.
const MAX_WAIT: Duration = Duration::from_millis(350);

/// What the watching task reports, in the order in which it happened on the disk.
pub(crate) enum FileEvent {
    /// The files are other than before.
    Read(Box<Reading>),
    /// There are other kinds of components than before.
    Kinds(Manifests),
    /// A write was done, or why not.
    Written(Result<Findings, String>),
}

/// The two ends of the watching task.
pub(crate) struct FileWatch {
    pub(crate) seen: mpsc::Receiver<FileEvent>,
    /// Takes one write at a time.
    pub(crate) writes: mpsc::Sender<Write>,
}

/// Starts to watch, in a task of its own on the current runtime; it ends with the receiver.
pub(crate) fn watch(files: WatchedFiles, kinds: Option<KindSource>) -> FileWatch {
    let (events, seen) = mpsc::channel(1);
    let (writes, written) = mpsc::channel(1);
    tokio::spawn(async move {
        tokio::select! {
            () = watch_files(files, kinds, &events, written) => {}
            () = events.closed() => {}
        }
    });
    FileWatch { seen, writes }
}

async fn watch_files(
    mut files: WatchedFiles,
    kinds: Option<KindSource>,
    events: &mpsc::Sender<FileEvent>,
    mut writes: mpsc::Receiver<Write>,
) {
    let changed = Arc::new(Notify::new());
    let mut folders = Folders::new(&changed);
    let mut poll = time::interval(POLL);
    poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        folders.watch_paths_of(&files);
        let (news, is_write) = tokio::select! {
            () = changed.notified() => (wait_settled(&mut files, &changed, true).await, false),
            _ = poll.tick() => (wait_settled(&mut files, &changed, false).await, false),
            Some(write) = writes.recv() => (perform_write(&mut files, write).await, true),
        };
        // A version is checked by the kinds that exist when it is saved, so they come first.
        let kinds = if is_write { None } else { look_for_kinds(kinds.as_ref(), &files).await };
        for news in kinds.into_iter().chain(news) {
            if events.send(news).await.is_err() {
                return;
            }
        }
    }
}

/// Waits until the files are quiet, and returns them if they differ from the known ones. Without a
/// notice they are read twice, because then no notices show whether they are quiet.
async fn wait_settled(
    files: &mut WatchedFiles,
    changed: &Notify,
    is_noticed: bool,
) -> Option<FileEvent> {
    let deadline = Instant::now() + MAX_WAIT;
    let mut before = None;
    if !is_noticed {
        before = Some(read_files(files).await?.0);
    }
    loop {
        let quiet = || QUIET.min(deadline.saturating_duration_since(Instant::now()));
        while time::timeout(quiet(), changed.notified()).await.is_ok() {}
        let (snapshot, reading) = read_files(files).await?;
        let is_quiet = before.as_ref().is_none_or(|before| *before == snapshot);
        if is_quiet && is_whole(&snapshot) || Instant::now() >= deadline {
            files.set_known(snapshot);
            return Some(FileEvent::Read(Box::new(reading)));
        }
        before = Some(snapshot);
    }
}

async fn read_files(files: &WatchedFiles) -> Option<(crate::files::FileSnapshot, Reading)> {
    let files = files.clone();
    // It fails only when the runtime ends.
    tokio::task::spawn_blocking(move || files.read_if_changed()).await.ok().flatten()
}

async fn look_for_kinds(kinds: Option<&KindSource>, files: &WatchedFiles) -> Option<FileEvent> {
    let (kinds, files) = (kinds?.clone(), files.paths().map(Into::into).collect::<Vec<_>>());
    let looked = tokio::task::spawn_blocking(move || kinds.look_again(&files)).await;
    looked.ok().flatten().map(FileEvent::Kinds)
}

async fn perform_write(files: &mut WatchedFiles, write: Write) -> Option<FileEvent> {
    let mut writing = files.clone();
    let done = tokio::task::spawn_blocking(move || {
        let result = writing.write_file(&write);
        (writing, result)
    });
    let (back, result) = done.await.ok()?;
    *files = back;
    Some(FileEvent::Written(result))
}

/// The folders, and the files themselves, that the kernel watches for us.
struct Folders {
    watcher: Option<RecommendedWatcher>,
    changed: Arc<Notify>,
    /// By path, with device and inode: a folder that was replaced must be watched again.
    watched: BTreeMap<PathBuf, (u64, u64)>,
    /// The paths whose events count; a busy folder elsewhere wakes no task.
    entries: Arc<Mutex<BTreeSet<PathBuf>>>,
}

impl Folders {
    fn new(changed: &Arc<Notify>) -> Self {
        let entries = Arc::<Mutex<BTreeSet<PathBuf>>>::default();
        let watcher = start_watcher(Arc::clone(changed), Arc::clone(&entries))
            .inspect_err(|error| warn!(%error, "cannot watch folders; looking every 2 s"))
            .ok();
        Self { watcher, changed: Arc::clone(changed), watched: BTreeMap::new(), entries }
    }

    /// Watches the files and the folders on the path to them as they are now, and no others.
    fn watch_paths_of(&mut self, files: &WatchedFiles) {
        let Some(watcher) = &mut self.watcher else { return };
        let paths = WatchedPaths::leading_to(files.paths());
        let wanted = paths.folders.keys().chain(&paths.files).filter_map(|folder| {
            let folder_is = fs::metadata(folder).ok()?;
            Some((folder.clone(), (folder_is.dev(), folder_is.ino())))
        });
        let wanted: BTreeMap<_, _> = wanted.collect();
        let entries = paths
            .folders
            .into_iter()
            .flat_map(|(folder, entries)| std::iter::once(folder).chain(entries));
        let entries = entries.collect();
        let mut known = self.entries.lock();
        let mut is_news = *known != entries;
        *known = entries;
        drop(known);
        let old = std::mem::take(&mut self.watched);
        for folder in old.iter().filter(|(folder, id)| wanted.get(*folder) != Some(*id)) {
            // The kernel has stopped watching a folder that is gone.
            let _ = watcher.unwatch(folder.0);
        }
        for (folder, id) in wanted {
            let is_watched = old.get(&folder) == Some(&id);
            // A folder that cannot be watched is tried again after the next read.
            if is_watched || watcher.watch(&folder, RecursiveMode::NonRecursive).is_ok() {
                self.watched.insert(folder, id);
                is_news |= !is_watched;
            }
        }
        if is_news {
            // Changes on the new path before it was watched were not reported.
            self.changed.notify_one();
        }
    }
}

fn start_watcher(
    changed: Arc<Notify>,
    entries: Arc<Mutex<BTreeSet<PathBuf>>>,
) -> notify::Result<RecommendedWatcher> {
    notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
        // An error may have lost events, so it counts as one. Reading is not a change: otherwise
        // the task's own reading would wake it for ever.
        let matters = event.map_or(true, |event| {
            let is_change = match event.kind {
                EventKind::Access(AccessKind::Close(AccessMode::Write)) => true,
                EventKind::Access(_) => false,
                _ => true,
            };
            let entries = entries.lock();
            let is_ours = event.paths.iter().any(|path| entries.contains(path));
            is_change && (is_ours || event.paths.is_empty() || event.need_rescan())
        });
        if matters {
            changed.notify_one();
        }
    })
}
