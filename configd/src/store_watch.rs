//! Wakes who follows the versions that are kept on the disk: each appears by a rename in their folder,
//! which the kernel reports.

use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

use parking_lot::Mutex;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};

/// Bytes for the events that are read together; a name has 255 at most.
const EVENT_BYTES: usize = 4096;

/// The folder in which configd keeps the accepted versions.
#[derive(Debug)]
pub struct KeptWatch {
    folder: PathBuf,
    /// None as long as the folder is not there, or cannot be watched.
    events: Mutex<Option<OwnedFd>>,
}

impl KeptWatch {
    /// A watch of this folder, which need not be there yet.
    pub fn of(folder: PathBuf) -> Self {
        Self { folder, events: Mutex::new(None) }
    }

    /// Waits until there may be another version in the folder, at most for this time. A folder that the
    /// kernel cannot watch is waited for that long.
    pub fn wait(&self, at_most: Duration) {
        let mut events = self.events.lock();
        let Some(watched) = &*events else {
            *events = self.start().ok();
            // What came before the watch began is not reported: the caller looks first.
            if events.is_none() {
                std::thread::sleep(at_most);
            }
            return;
        };
        let mut ready = [PollFd::new(watched, PollFlags::IN)];
        let timeout = Timespec::try_from(at_most).ok();
        // An interruption by a signal only makes the caller look once more.
        if poll(&mut ready, timeout.as_ref()).is_ok_and(|count| count > 0) && !is_kept(watched) {
            *events = None;
        }
    }

    fn start(&self) -> rustix::io::Result<OwnedFd> {
        let events = inotify::init(CreateFlags::CLOEXEC | CreateFlags::NONBLOCK)?;
        let flags = WatchFlags::MOVED_TO | WatchFlags::MOVE_SELF | WatchFlags::ONLYDIR;
        inotify::add_watch(&events, &self.folder, flags)?;
        Ok(events)
    }
}

/// Takes the events that are there. Returns whether the folder is still the one at its path.
fn is_kept(events: &OwnedFd) -> bool {
    let mut buffer = [MaybeUninit::uninit(); EVENT_BYTES];
    let mut reader = inotify::Reader::new(events, &mut buffer);
    let mut is_kept = true;
    while let Ok(event) = reader.next() {
        is_kept &= !event.events().intersects(ReadFlags::IGNORED | ReadFlags::MOVE_SELF);
    }
    is_kept
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    /// Longer than a test may take: a wait that lasts so long was not ended by an event.
    const LONG: Duration = Duration::from_secs(100);

    #[test]
    fn a_version_that_appears_ends_the_wait() {
        let folder = std::env::temp_dir().join(format!("armor-kept-watch-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        let watch = KeptWatch::of(folder.join("kept"));
        watch.wait(Duration::from_millis(1));
        let begun = Instant::now();
        for number in 1..=2 {
            // Also when the folder was removed meanwhile.
            std::fs::create_dir_all(folder.join("kept")).expect("writable");
            watch.wait(LONG);
            for version in 1..=3 {
                std::fs::create_dir(folder.join("new")).expect("writable");
                std::fs::rename(folder.join("new"), folder.join(format!("kept/{version}")))
                    .expect("renamed");
                watch.wait(LONG);
            }
            std::fs::rename(folder.join("kept"), folder.join(format!("moved-{number}")))
                .expect("renamed");
            watch.wait(LONG);
        }
        assert!(begun.elapsed() < LONG, "{:?}", begun.elapsed());
        let _ = std::fs::remove_dir_all(&folder);
    }
}
