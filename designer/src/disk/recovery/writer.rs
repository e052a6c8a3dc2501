//! Writes the recovery file on a thread of its own: a disk that is slow to sync must not hold up
//! the hand that draws. Only the newest work that waits is written.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use super::Kept;

enum Job {
    Write(Kept),
    Remove,
}

#[derive(Default)]
struct Desk {
    waiting: Option<Job>,
    is_busy: bool,
    is_closed: bool,
    trouble: Option<String>,
}

struct Shared {
    desk: Mutex<Desk>,
    changed: Condvar,
}

impl Shared {
    /// No one panics while holding the lock; if the user did, the desk is still in order.
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

pub(super) struct Writer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    pub(super) fn of(file: &Path) -> Self {
        let shared =
            Arc::new(Shared { desk: Mutex::new(Desk::default()), changed: Condvar::new() });
        let (theirs, file) = (Arc::clone(&shared), file.to_path_buf());
        let thread =
            thread::Builder::new().name("recovery".into()).spawn(move || run(&theirs, file));
        if let Err(error) = &thread {
            shared.desk().trouble = Some(format!("Unsaved work cannot be backed up: {error}"));
        }
        Self { shared, thread: thread.ok() }
    }

    pub(super) fn write(&self, work: Kept) {
        self.ask(Job::Write(work));
    }

    pub(super) fn remove(&self) {
        self.ask(Job::Remove);
    }

    pub(super) fn trouble(&self) -> Option<String> {
        self.shared.desk().trouble.clone()
    }

    pub(super) fn settle(&self) {
        if self.thread.is_none() {
            return;
        }
        let mut desk = self.shared.desk();
        while desk.waiting.is_some() || desk.is_busy {
            desk = self.shared.changed.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn ask(&self, job: Job) {
        self.shared.desk().waiting = Some(job);
        self.shared.changed.notify_all();
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.shared.desk().is_closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared, file: PathBuf) {
    loop {
        let mut desk = shared.desk();
        let job = loop {
            match desk.waiting.take() {
                Some(job) => break job,
                None if desk.is_closed => return,
                None => {
                    desk = shared.changed.wait(desk).unwrap_or_else(PoisonError::into_inner);
                }
            }
        };
        desk.is_busy = true;
        drop(desk);
        let outcome = perform(&job, &file);
        let mut desk = shared.desk();
        desk.is_busy = false;
        desk.trouble = outcome.err();
        drop(desk);
        shared.changed.notify_all();
    }
}

fn perform(job: &Job, file: &Path) -> Result<(), String> {
    match job {
        Job::Write(work) => {
            let text = serde_json::to_vec(work).map_err(|error| error.to_string())?;
            armor_files::save_atomically(file, &text)
                .map_err(|error| format!("Unsaved work cannot be backed up: {error}"))
        }
        Job::Remove => match fs::remove_file(file) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(format!("{} cannot be removed: {error}", file.display()))
            }
            _ => Ok(()),
        },
    }
}
