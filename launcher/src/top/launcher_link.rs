//! What the launcher of the system reports and does: the components whose processes do not run, the
//! other hosts, the number of starts, and requests to stop or restart one. On threads of its own, since it may be busy.

use std::collections::HashMap;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use armor_inspect::run_control::{self, AbsentComponent, HostReport, RunRequest};
use parking_lot::Mutex;

use crate::arguments::RunningSystem;
use crate::system;

/// Time between two questions.
const ASK_EVERY: Duration = Duration::from_secs(1);

/// The launcher, as far as it can be asked.
pub struct LauncherLink {
    running: RunningSystem,
    shared: Arc<Mutex<LauncherReport>>,
}

#[derive(Default)]
struct LauncherReport {
    absent: Vec<AbsentComponent>,
    hosts: Vec<HostReport>,
    /// The process start for which the number is to be known, or is known.
    wanted: HashMap<String, u64>,
    starts: HashMap<String, (u64, u32)>,
    /// The results of requests that have not been shown.
    results: Vec<String>,
}

impl LauncherLink {
    /// Begins to ask the launcher, for as long as this exists.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(running: &RunningSystem) -> std::io::Result<Self> {
        let shared = Arc::<Mutex<LauncherReport>>::default();
        let (weak, asked) = (Arc::downgrade(&shared), running.clone());
        thread::Builder::new().name("launcher".into()).spawn(move || {
            while let Some(shared) = weak.upgrade() {
                ask_launcher(&asked, &shared);
                drop(shared);
                thread::sleep(ASK_EVERY);
            }
        })?;
        Ok(Self { running: running.clone(), shared })
    }

    /// Returns the components whose processes do not run.
    pub fn absent(&self) -> Vec<AbsentComponent> {
        self.shared.lock().absent.clone()
    }

    /// Returns the other hosts of the system.
    pub fn hosts(&self) -> Vec<HostReport> {
        self.shared.lock().hosts.clone()
    }

    /// Returns how many times a component was started again, up to this start of its process; none
    /// until the launcher has reported it.
    pub fn count_restarts(&self, component: &str, instance: u64) -> Option<u32> {
        let mut shared = self.shared.lock();
        shared.wanted.insert(component.to_owned(), instance);
        let (_, starts) = shared.starts.get(component)?;
        Some(starts.saturating_sub(1))
    }

    /// Sends a request; its result is among [`take_results`](Self::take_results) later.
    pub fn send(&self, request: RunRequest) {
        let (running, shared) = (self.running.clone(), Arc::clone(&self.shared));
        let carry_out = move || {
            let record = system::find_record(&running);
            let reply = record.and_then(|record| Ok(run_control::request(&record, &request)?));
            let text = match reply {
                Ok(reply) if reply.accepted => reply.text,
                Ok(reply) => format!("refused: {}", reply.text),
                Err(error) => format!("error: {error:#}"),
            };
            shared.lock().results.push(text);
        };
        if let Err(error) = thread::Builder::new().name("request".into()).spawn(carry_out) {
            self.shared.lock().results.push(format!("error: no thread: {error}"));
        }
    }

    /// Returns the results of requests since the last call.
    pub fn take_results(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.lock().results)
    }
}

fn ask_launcher(running: &RunningSystem, shared: &Mutex<LauncherReport>) {
    let Ok(record) = system::find_record(running) else {
        let mut report = shared.lock();
        report.absent.clear();
        report.hosts.clear();
        return;
    };
    let reply = run_control::request(&record, &RunRequest::List);
    let (absent, hosts) = reply.map(|reply| (reply.absent, reply.hosts)).unwrap_or_default();
    {
        let mut report = shared.lock();
        (report.absent, report.hosts) = (absent, hosts);
    }
    // Each process start is asked about once: two hundred questions a second would be a load.
    let due: Vec<(String, u64)> = {
        let report = shared.lock();
        let is_new = |name: &str, instance: u64| {
            report.starts.get(name).is_none_or(|(known, _)| *known != instance)
        };
        let wanted = report.wanted.iter().map(|(name, instance)| (name.clone(), *instance));
        wanted.filter(|(name, instance)| is_new(name, *instance)).collect()
    };
    for (component, instance) in due {
        let request = RunRequest::History { component: component.clone() };
        let Ok(reply) = run_control::request(&record, &request) else { return };
        // The launcher does not know a process that was started by hand.
        let starts = reply.history.map_or(1, |history| history.starts);
        shared.lock().starts.insert(component, (instance, starts));
    }
}
