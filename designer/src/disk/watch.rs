//! Notices that an open file is another one on the disk: looked immediately a second, on a thread of
//! its own, since a network disk may take its time. A look costs one `stat`; only what that states
//! may have changed is read.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Pause between two looks.
const EVERY: Duration = Duration::from_secs(1);
/// Pause before the second look at a file that is just being written.
const SETTLING: Duration = Duration::from_millis(120);

/// A file as it is on the disk; none if it is not there.
pub type OnDisk = Option<Arc<[u8]>>;

/// A file that is not what the designer read or wrote last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct News {
    /// Which.
    pub path: PathBuf,
    /// What it is now.
    pub now: OnDisk,
}

/// What tells a version of a file from the next without reading it.
type Stamp = Option<(u64, u64, i64, i64, i64, i64)>;

struct Watched {
    /// What the designer knows.
    known: OnDisk,
    /// As of the last reading; none before the first.
    stamp: Option<Stamp>,
    /// The stamp of the look before, if it was another: the file may not be written to its end.
    unsettled: Option<Stamp>,
}

/// The files looked at, without the thread.
#[derive(Default)]
struct Looker {
    files: BTreeMap<PathBuf, Watched>,
    news: Vec<News>,
}

impl Looker {
    fn follow(&mut self, files: impl IntoIterator<Item = (PathBuf, OnDisk)>) {
        let mut old = std::mem::take(&mut self.files);
        for (path, known) in files {
            let same = old.remove(&path).filter(|watched| watched.known == known);
            let watched = same.unwrap_or(Watched { known, stamp: None, unsettled: None });
            self.files.insert(path, watched);
        }
        // What was noticed of an earlier version, or of a file that is closed, is old.
        let files = &self.files;
        self.news.retain(|news| files.get(&news.path).is_some_and(|w| w.known == news.now));
    }

    /// Looks once at each file; whether one has to be looked at again soon.
    fn look(&mut self) -> bool {
        let mut is_unsettled = false;
        for (path, watched) in &mut self.files {
            let stamp = stamp(path);
            if watched.stamp == Some(stamp) {
                watched.unsettled = None;
                continue;
            }
            if watched.stamp.is_some() && watched.unsettled != Some(stamp) {
                watched.unsettled = Some(stamp);
                is_unsettled = true;
                continue;
            }
            watched.unsettled = None;
            // A file that cannot be read for a moment is not gone; it is tried again.
            let Ok(now) = read(path) else { continue };
            watched.stamp = Some(stamp);
            if now != watched.known {
                watched.known.clone_from(&now);
                self.news.retain(|news| news.path != *path);
                self.news.push(News { path: path.clone(), now });
            }
        }
        is_unsettled
    }
}

fn stamp(path: &Path) -> Stamp {
    let of = fs::metadata(path).ok()?;
    Some((of.ino(), of.len(), of.mtime(), of.mtime_nsec(), of.ctime(), of.ctime_nsec()))
}

fn read(path: &Path) -> std::io::Result<OnDisk> {
    match armor_robotfile::read_bytes(path) {
        Ok(bytes) => Ok(Some(bytes.into())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

#[derive(Default)]
struct State {
    looker: Looker,
    is_closed: bool,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Looks at the open files until it is dropped.
pub struct Watch {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Begins with no files. `wake` is called, from another thread, when there is news.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn begin(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new() });
        let theirs = Arc::clone(&shared);
        let thread = thread::Builder::new().name("watch".into()).spawn(move || {
            run(&theirs, &wake);
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Looks at these files from now on, each with what the designer knows of it; call it whenever
    /// a file was read or saved, so that one's own saving is no news.
    pub fn follow(&self, files: impl IntoIterator<Item = (PathBuf, OnDisk)>) {
        self.shared.state().looker.follow(files);
    }

    /// What has changed since this was asked last.
    pub fn news(&self) -> Vec<News> {
        std::mem::take(&mut self.shared.state().looker.news)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.shared.state().is_closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared, wake: &impl Fn()) {
    let mut state = shared.state();
    while !state.is_closed {
        let had = state.looker.news.len();
        let pause = if state.looker.look() { SETTLING } else { EVERY };
        if state.looker.news.len() > had {
            wake();
        }
        let waited = shared.changed.wait_timeout(state, pause);
        state = waited.unwrap_or_else(PoisonError::into_inner).0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::scratch::Scratch;

    fn on_disk(text: &str) -> OnDisk {
        Some(text.as_bytes().into())
    }

    /// Looks until nothing is being written any longer, and gives the news.
    fn looked(looker: &mut Looker) -> Vec<News> {
        while looker.look() {}
        std::mem::take(&mut looker.news)
    }

    fn following(path: &Path, text: &str) -> Looker {
        let mut looker = Looker::default();
        looker.follow([(path.to_path_buf(), on_disk(text))]);
        looker
    }

    #[test]
    fn a_change_is_told_once() {
        let folder = Scratch::new();
        let path = folder.path().join("a.xml");
        fs::write(&path, "one").expect("written");
        let mut looker = following(&path, "one");
        assert_eq!(looked(&mut looker), []);
        armor_files::save_atomically(&path, b"two").expect("saved");
        assert_eq!(looked(&mut looker), [News { path: path.clone(), now: on_disk("two") }]);
        assert_eq!(looked(&mut looker), []);
        fs::remove_file(&path).expect("removed");
        assert_eq!(looked(&mut looker), [News { path, now: None }]);
    }

    #[test]
    fn what_was_changed_between_reading_and_following_is_told_too() {
        let folder = Scratch::new();
        let path = folder.path().join("a.xml");
        fs::write(&path, "two").expect("written");
        let mut looker = following(&path, "one");
        assert_eq!(looked(&mut looker).len(), 1);
    }

    #[test]
    fn ones_own_saving_is_no_news() {
        let folder = Scratch::new();
        let path = folder.path().join("a.xml");
        fs::write(&path, "one").expect("written");
        let mut looker = following(&path, "one");
        assert_eq!(looked(&mut looker), []);
        armor_files::save_atomically(&path, b"two").expect("saved");
        looker.follow([(path, on_disk("two"))]);
        assert_eq!(looked(&mut looker), []);
    }

    #[test]
    fn a_file_that_is_still_being_written_is_looked_at_again_first() {
        let folder = Scratch::new();
        let path = folder.path().join("a.xml");
        fs::write(&path, "one").expect("written");
        let mut looker = following(&path, "one");
        assert_eq!(looked(&mut looker), []);
        fs::write(&path, "tw").expect("begun");
        assert!(looker.look(), "it is to be looked at again soon");
        assert_eq!(looker.news, []);
        fs::write(&path, "two and more").expect("written");
        assert!(looker.look(), "it has changed again");
        assert!(!looker.look());
        assert_eq!(looker.news, [News { path, now: on_disk("two and more") }]);
    }

    #[test]
    fn the_thread_wakes_the_window() {
        let folder = Scratch::new();
        let path = folder.path().join("a.xml");
        fs::write(&path, "two").expect("written");
        let (woken, wait) = std::sync::mpsc::channel();
        let watch = Watch::begin(move || woken.send(()).unwrap_or_default()).expect("a thread");
        watch.follow([(path, on_disk("one"))]);
        wait.recv_timeout(Duration::from_secs(60)).expect("woken");
        assert_eq!(watch.news().len(), 1);
    }
}
