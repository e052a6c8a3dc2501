//! Notices that the files are not what they were: at once by watching their folders (watching a
//! file loses it at the first atomic save), and every [`POLL`] by looking, for where the kernel
//! tells nothing.

use std::sync::Arc;
use std::time::Duration;

use armor_missions::Reading;
use notify::event::{AccessKind, AccessMode, EventKind};
use notify::{RecommendedWatcher, RecursiveMode, Watcher};
use tokio::sync::{Notify, mpsc};
use tokio::time::{self, Instant, MissedTickBehavior};
use tracing::warn;

use crate::files::Files;

/// How often the files are looked at without a reason.
const POLL: Duration = Duration::from_secs(2);
/// A save is over when nothing happens for this long: most half-written files are never seen.
const QUIET: Duration = Duration::from_millis(30);
/// A folder that is never quiet is looked at all the same; faults show within half a second.
const MAX_WAIT: Duration = Duration::from_millis(250);

/// Starts to watch, in a task of its own on the current runtime; it ends with the receiver. Each
/// time the files are other than before, their new reading is sent.
pub(crate) fn watch(files: Files) -> mpsc::Receiver<Reading> {
    let (telling, readings) = mpsc::channel(1);
    tokio::spawn(async move {
        tokio::select! {
            () = run(files, &telling) => {}
            () = telling.closed() => {}
        }
    });
    readings
}

async fn run(mut files: Files, telling: &mpsc::Sender<Reading>) {
    let stirred = Arc::new(Notify::new());
    let mut watcher = watcher(&stirred);
    let mut poll = time::interval(POLL);
    poll.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        // Watching again brings back a folder that was itself replaced.
        if let Some(watcher) = &mut watcher {
            follow(watcher, &files);
        }
        tokio::select! {
            () = stirred.notified() => settle(&stirred).await,
            _ = poll.tick() => {}
        }
        let looked = tokio::task::spawn_blocking(move || {
            let reading = files.reread();
            (files, reading)
        });
        // It fails only when the runtime ends.
        let Ok((back, reading)) = looked.await else { return };
        files = back;
        if let Some(reading) = reading
            && telling.send(reading).await.is_err()
        {
            return;
        }
    }
}

fn watcher(stirred: &Arc<Notify>) -> Option<RecommendedWatcher> {
    let stirred = Arc::clone(stirred);
    let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
        // An error may have lost events, so it counts as one. Reading is no change: our own
        // reading would wake us for ever.
        let changed = event.map_or(true, |event| match event.kind {
            EventKind::Access(AccessKind::Close(AccessMode::Write)) => true,
            EventKind::Access(_) => false,
            _ => true,
        });
        if changed {
            stirred.notify_one();
        }
    });
    watcher
        .inspect_err(|error| warn!(%error, "cannot watch folders; looking at the file every 2 s"))
        .ok()
}

fn follow(watcher: &mut RecommendedWatcher, files: &Files) {
    for folder in files.folders() {
        // A folder that is gone is looked for again at the next poll.
        let _ = watcher.watch(&folder, RecursiveMode::NonRecursive);
    }
}

/// Waits until nothing happens any more.
async fn settle(stirred: &Notify) {
    let deadline = Instant::now() + MAX_WAIT;
    while Instant::now() < deadline && time::timeout(QUIET, stirred.notified()).await.is_ok() {}
}
