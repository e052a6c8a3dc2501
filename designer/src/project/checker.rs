//! Looks at each revision of the files on a thread of its own: first what can be read off them,
//! then what has to be proven of the mission. A newer revision ends the proof of an older one.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use armor_plan::Plan;
use armor_proof::{Recheck, explain_by_edit};
use armor_robotfile::{Date, Findings, NeededPath, Reading, needed_paths, passed_dates};
use parking_lot::Mutex;

use crate::kinds::Kinds;
use crate::project::Checked;
use crate::project::files::Disk;

/// Pause between two looks for a result while the user waits.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// A revision to be looked at.
pub(super) struct Wanted {
    pub(super) revision: u64,
    /// What the open files say, the one that was given first.
    pub(super) files: Vec<(PathBuf, Arc<[u8]>)>,
    pub(super) kinds: Arc<Kinds>,
}

type Wake = Arc<dyn Fn() + Send + Sync>;

/// The thread, and what it found.
pub(super) struct Checker {
    newest: Arc<AtomicU64>,
    wanted: Sender<Wanted>,
    found: Receiver<Checked>,
    /// Taken from `found` while the user waited.
    taken: Vec<Checked>,
    wake: Arc<Mutex<Option<Wake>>>,
}

impl Checker {
    pub(super) fn start() -> Self {
        let (wanted, inbox) = channel();
        let (outbox, found) = channel();
        let newest = Arc::new(AtomicU64::new(0));
        let wake = Arc::new(Mutex::new(None));
        let thread = Thread { newest: Arc::clone(&newest), outbox, wake: Arc::clone(&wake) };
        // It ends when the project, and with it `wanted`, is gone.
        if let Err(error) = std::thread::Builder::new()
            .name("check".into())
            .spawn(move || thread.check_revisions(&inbox))
        {
            tracing::error!(%error, "The files are not checked: no thread could be started");
        }
        Self { newest, wanted, found, taken: Vec::new(), wake }
    }

    /// Checks nothing.
    pub(super) fn idle() -> Self {
        let (wanted, found) = (channel().0, channel().1);
        Self { newest: Arc::default(), wanted, found, taken: Vec::new(), wake: Arc::default() }
    }

    pub(super) fn on_found(&self, wake: Wake) {
        *self.wake.lock() = Some(wake);
    }

    pub(super) fn request_check(&self, wanted: Wanted) {
        self.newest.store(wanted.revision, Ordering::Relaxed);
        // Sending fails only if the thread could not be started, which is in the log.
        let _ = self.wanted.send(wanted);
    }

    /// What was found since this was asked last, in its order.
    pub(super) fn take_results(&mut self) -> Vec<Checked> {
        self.taken.extend(self.found.try_iter());
        std::mem::take(&mut self.taken)
    }

    /// Waits for the next result.
    pub(super) fn wait_for_result(&mut self) {
        self.taken.extend(self.found.recv_timeout(LOOK_EVERY));
    }
}

impl Drop for Checker {
    fn drop(&mut self) {
        // Ends a running proof.
        self.newest.store(u64::MAX, Ordering::Relaxed);
    }
}

struct Thread {
    newest: Arc<AtomicU64>,
    outbox: Sender<Checked>,
    wake: Arc<Mutex<Option<Wake>>>,
}

impl Thread {
    fn check_revisions(self, inbox: &Receiver<Wanted>) {
        let mut disk = Disk::default();
        while let Ok(first) = inbox.recv() {
            // Only the newest matters.
            let wanted = inbox.try_iter().last().unwrap_or(first);
            let reading = check_without_proof(&mut disk, &wanted);
            self.send_result(&wanted, &reading.findings, !reading.is_valid());
            if reading.is_valid() {
                let findings = self.prove_mission(reading, &wanted);
                self.send_result(&wanted, &findings, true);
            }
        }
    }

    fn prove_mission(&self, mut reading: Reading, wanted: &Wanted) -> Findings {
        // Only a change ends it early, no time, so that it finds the same as `armor check`.
        let is_stale = || self.newest.load(Ordering::Relaxed) != wanted.revision;
        if let Some(configuration) = &reading.configuration {
            let found = match Plan::of(configuration) {
                Ok(Some(plan)) => armor_proof::prove(configuration, &plan, &is_stale),
                Ok(None) => Findings::default(),
                Err(findings) => findings,
            };
            reading.findings.extend_proven(found, configuration);
        }
        let manifests = wanted.kinds.manifests();
        explain_by_edit(
            &mut reading,
            &Recheck { overrides: &[], manifests, is_cancelled: &is_stale },
        );
        reading.findings.sort();
        reading.findings
    }

    fn send_result(&self, wanted: &Wanted, findings: &Findings, is_complete: bool) {
        let findings = Arc::new(findings.clone());
        let checked = Checked { revision: wanted.revision, findings, is_complete };
        if self.outbox.send(checked).is_err() {
            return;
        }
        // Called without the lock, since waking the window may set another callback.
        let wake = self.wake.lock().clone();
        if let Some(wake) = wake {
            wake();
        }
    }
}

/// Checks the files as far as possible without a proof.
fn check_without_proof(disk: &mut Disk, wanted: &Wanted) -> Reading {
    let reading = disk.read_snapshot(&wanted.files);
    let manifests = wanted.kinds.manifests();
    let mut reading = armor_robotfile::check(reading, &[], manifests);
    if let Some(configuration) = &reading.configuration {
        if let Some(manifests) = manifests {
            let needed = needed_paths(configuration, manifests);
            reading.findings.extend(needed.iter().filter_map(NeededPath::find_fault));
        }
        let utc = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let utc = Date::since_1970(utc);
        reading.findings.extend(passed_dates(configuration, utc));
    }
    reading.findings.sort();
    reading
}
