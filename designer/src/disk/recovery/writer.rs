//! Writes the recovery file on a thread of its own, so that a disk that is slow to sync does not
//! block the window. Only the newest waiting work is written.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use parking_lot::{Condvar, Mutex};

use super::Kept;

enum Job {
    Write(Kept),
    Remove,
}

#[derive(Default)]
struct WriterState {
    /// At most one: a newer job replaces one that has not begun, since it covers the same work.
    waiting: Option<Job>,
    is_busy: bool,
    is_closed: bool,
    trouble: Option<String>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<WriterState>,
    changed: Condvar,
}

pub(super) struct Writer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    pub(super) fn of(file: &Path) -> Self {
        let shared = Arc::<Shared>::default();
        let (theirs, file) = (Arc::clone(&shared), file.to_path_buf());
        let thread = thread::Builder::new()
            .name("recovery".into())
            .spawn(move || perform_jobs(&theirs, file));
        if let Err(error) = &thread {
            shared.state.lock().trouble =
                Some(format!("Unsaved work cannot be backed up: {error}"));
        }
        Self { shared, thread: thread.ok() }
    }

    pub(super) fn request_write(&self, work: Kept) {
        self.replace_waiting_job(Job::Write(work));
    }

    pub(super) fn request_removal(&self) {
        self.replace_waiting_job(Job::Remove);
    }

    pub(super) fn trouble(&self) -> Option<String> {
        self.shared.state.lock().trouble.clone()
    }

    pub(super) fn wait_until_idle(&self) {
        if self.thread.is_none() {
            return;
        }
        let mut state = self.shared.state.lock();
        while state.waiting.is_some() || state.is_busy {
            self.shared.changed.wait(&mut state);
        }
    }

    fn replace_waiting_job(&self, job: Job) {
        self.shared.state.lock().waiting = Some(job);
        self.shared.changed.notify_all();
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.shared.state.lock().is_closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn perform_jobs(shared: &Shared, file: PathBuf) {
    loop {
        let mut state = shared.state.lock();
        let job = loop {
            match state.waiting.take() {
                // Before `is_closed`: a waiting job is performed before the thread ends.
                Some(job) => break job,
                None if state.is_closed => return,
                None => shared.changed.wait(&mut state),
            }
        };
        state.is_busy = true;
        // The window must not wait for the disk.
        drop(state);
        let outcome = perform_job(&job, &file);
        let mut state = shared.state.lock();
        state.is_busy = false;
        state.trouble = outcome.err();
        drop(state);
        shared.changed.notify_all();
    }
}

fn perform_job(job: &Job, file: &Path) -> Result<(), String> {
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
