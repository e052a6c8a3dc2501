//! Detects that another program has changed an open file. A thread looks once a second, since a
//! network disk may be slow. A look costs one `stat`; a file is read only if its `stat` has
//! changed.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use parking_lot::{Condvar, Mutex};

/// Pause between two looks.
const EVERY: Duration = Duration::from_secs(1);
/// Pause before the second look at a file that is just being written.
const SETTLING: Duration = Duration::from_millis(120);

/// The contents of a file on the disk; none if it does not exist.
pub type OnDisk = Option<Arc<[u8]>>;

/// A file whose contents are not those that the designer read or wrote last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct News {
    /// Its path.
    pub path: PathBuf,
    /// Its contents now.
    pub now: OnDisk,
}

/// Distinguishes the versions of a file without reading it: inode, length, and the times of the
/// last modification and of the last status change, each in seconds and nanoseconds.
type Stamp = Option<(u64, u64, i64, i64, i64, i64)>;

struct Watched {
    /// The contents that the designer knows.
    known: OnDisk,
    /// The stamp at the last reading; none before the first.
    stamp: Option<Stamp>,
    /// The stamp of the previous look, if it was a new one: the file may still be being written.
    unsettled: Option<Stamp>,
}

/// The files looked at, without the thread.
#[derive(Default)]
struct Looker {
    files: BTreeMap<PathBuf, Watched>,
    news: Vec<News>,
}

impl Looker {
    fn follow_files(&mut self, files: impl IntoIterator<Item = (PathBuf, OnDisk)>) {
        let mut old = std::mem::take(&mut self.files);
        for (path, known) in files {
            let same = old.remove(&path).filter(|watched| watched.known == known);
            let watched = same.unwrap_or(Watched { known, stamp: None, unsettled: None });
            self.files.insert(path, watched);
        }
        // Drop news about an earlier version, or about a file that is closed by now.
        let files = &self.files;
        self.news.retain(|news| files.get(&news.path).is_some_and(|w| w.known == news.now));
    }

    /// Looks once at each file. Returns whether one has to be looked at again soon.
    fn look_at_files(&mut self) -> bool {
        let mut is_unsettled = false;
        for (path, watched) in &mut self.files {
            let stamp = stamp(path);
            if watched.stamp == Some(stamp) {
                watched.unsettled = None;
                continue;
            }
            // Read only when two looks in a row see the same stamp: a program that writes in place
            // would otherwise be read halfway.
            if watched.stamp.is_some() && watched.unsettled != Some(stamp) {
                watched.unsettled = Some(stamp);
                is_unsettled = true;
                continue;
            }
            watched.unsettled = None;
            // A file that cannot be read at the moment is not deleted. The stamp stays old, so the
            // next look reads it again.
            let Ok(now) = read(path) else { continue };
            // The stamp was taken before reading: a change in between is seen at the next look.
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

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
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
        let shared = Arc::<Shared>::default();
        let theirs = Arc::clone(&shared);
        let thread = thread::Builder::new().name("watch".into()).spawn(move || {
            look_until_closed(&theirs, &wake);
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Watches these files from now on, each with the contents that the designer knows. Call it
    /// whenever a file was read or saved, so that the designer's own saving is no news.
    pub fn follow_files(&self, files: impl IntoIterator<Item = (PathBuf, OnDisk)>) {
        self.shared.state.lock().looker.follow_files(files);
    }

    /// Returns what has changed since the last call.
    pub fn news(&self) -> Vec<News> {
        std::mem::take(&mut self.shared.state.lock().looker.news)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.shared.state.lock().is_closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn look_until_closed(shared: &Shared, wake: &impl Fn()) {
    let mut state = shared.state.lock();
    while !state.is_closed {
        let had = state.looker.news.len();
        let pause = if state.looker.look_at_files() { SETTLING } else { EVERY };
        if state.looker.news.len() > had {
            wake();
        }
        shared.changed.wait_for(&mut state, pause);
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
        while looker.look_at_files() {}
        std::mem::take(&mut looker.news)
    }

    fn following(path: &Path, text: &str) -> Looker {
        let mut looker = Looker::default();
        looker.follow_files([(path.to_path_buf(), on_disk(text))]);
        looker
    }

    #[test]
    fn a_change_is_reported_once() {
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
    fn a_change_between_reading_and_following_is_reported_too() {
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
        looker.follow_files([(path, on_disk("two"))]);
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
        assert!(looker.look_at_files(), "it is to be looked at again soon");
        assert_eq!(looker.news, []);
        fs::write(&path, "two and more").expect("written");
        assert!(looker.look_at_files(), "it has changed again");
        assert!(!looker.look_at_files());
        assert_eq!(looker.news, [News { path, now: on_disk("two and more") }]);
    }

    #[test]
    fn the_thread_wakes_the_window() {
        let folder = Scratch::new();
        let path = folder.path().join("a.xml");
        fs::write(&path, "two").expect("written");
        let (woken, wait) = std::sync::mpsc::channel();
        let watch = Watch::begin(move || woken.send(()).unwrap_or_default()).expect("a thread");
        watch.follow_files([(path, on_disk("one"))]);
        wait.recv_timeout(Duration::from_secs(60)).expect("woken");
        assert_eq!(watch.news().len(), 1);
    }
}
