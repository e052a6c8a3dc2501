//! Reads the calls of the components of a running system, each on a thread of its own.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use armor_sdk::call_trace::{TracedCall, TracedCalls, calls_of};
use armor_sdk::directory::{Directory, DirectoryChange};
use armor_sdk::tap::{Tap, TapError};
use armor_wire::codec;
use armor_wire::registry::ComponentEntry;
use parking_lot::Mutex;

use crate::observed::TAP_KEEP;

/// Time after which a waiting thread looks whether it must end.
const LOOK: Duration = Duration::from_millis(200);
/// Time between two attempts to link to a component that is registered.
const RETRY: Duration = Duration::from_secs(1);

/// The calls of a component since its last report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CallReport {
    /// The component.
    pub component: String,
    /// Its process start.
    pub instance: u64,
    /// The calls.
    pub calls: Vec<TracedCall>,
    /// How many are missing, at least: the component left them out, or this tool was too slow.
    pub missed: u64,
}

/// See the module. Dropping it ends its threads.
pub struct CallTaps {
    shared: Arc<SharedTaps>,
    reports: Receiver<CallReport>,
}

struct SharedTaps {
    is_ended: AtomicBool,
    /// The process starts that the registry lists.
    present: Mutex<BTreeSet<u64>>,
    /// Whether the registry has been lost.
    is_system_lost: AtomicBool,
    /// What is linked now.
    linked: Mutex<BTreeSet<String>>,
    /// Components that serve no calls, with the reason.
    refused: Mutex<Vec<(String, String)>>,
}

impl CallTaps {
    /// Begins to follow every component of the system, also those that appear later.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn begin(directory: &Directory) -> std::io::Result<Self> {
        let shared = Arc::new(SharedTaps {
            is_ended: AtomicBool::new(false),
            present: Mutex::default(),
            is_system_lost: AtomicBool::new(false),
            linked: Mutex::default(),
            refused: Mutex::default(),
        });
        let (sender, reports) = channel();
        let changes = directory.watch_changes();
        let following = Arc::clone(&shared);
        let follow = move || following.follow_components(&changes, &sender);
        thread::Builder::new().name("calls".into()).spawn(follow)?;
        Ok(Self { shared, reports })
    }

    /// Returns the next report; `None` if none comes within `timeout`.
    pub fn next(&self, timeout: Duration) -> Option<CallReport> {
        self.reports.recv_timeout(timeout).ok()
    }

    /// Whether the registry cannot be reached any more.
    pub fn has_lost_system(&self) -> bool {
        self.shared.is_system_lost.load(Ordering::Relaxed)
    }

    /// The components that are followed now.
    pub fn linked(&self) -> Vec<String> {
        self.shared.linked.lock().iter().cloned().collect()
    }

    /// Takes the components that turned out to serve no calls, with the reason.
    pub fn take_refused(&self) -> Vec<(String, String)> {
        std::mem::take(&mut *self.shared.refused.lock())
    }
}

impl Drop for CallTaps {
    fn drop(&mut self) {
        self.shared.is_ended.store(true, Ordering::Relaxed);
    }
}

impl SharedTaps {
    fn follow_components(
        self: &Arc<Self>,
        changes: &Receiver<DirectoryChange>,
        sender: &Sender<CallReport>,
    ) {
        while !self.is_ended.load(Ordering::Relaxed) {
            let Ok(change) = changes.recv_timeout(LOOK) else { continue };
            match change {
                DirectoryChange::Appeared(entry) => {
                    self.is_system_lost.store(false, Ordering::Relaxed);
                    if self.present.lock().insert(entry.instance) {
                        let (shared, sender) = (Arc::clone(self), sender.clone());
                        let name = format!("calls {}", entry.name);
                        let read = move || shared.read_component(&entry, &sender);
                        // Without a thread its calls are missing from the traces, as those of a
                        // component that serves none.
                        if let Err(error) = thread::Builder::new().name(name.clone()).spawn(read) {
                            self.refused.lock().push((name, error.to_string()));
                        }
                    }
                }
                DirectoryChange::Gone(entry) => {
                    self.present.lock().remove(&entry.instance);
                }
                DirectoryChange::RegistryLost => {
                    self.is_system_lost.store(true, Ordering::Relaxed);
                }
                DirectoryChange::RegistryFound => {
                    self.is_system_lost.store(false, Ordering::Relaxed);
                }
            }
        }
    }

    fn is_wanted(&self, entry: &ComponentEntry) -> bool {
        !self.is_ended.load(Ordering::Relaxed) && self.present.lock().contains(&entry.instance)
    }

    fn read_component(&self, entry: &ComponentEntry, sender: &Sender<CallReport>) {
        while self.is_wanted(entry) {
            match Tap::open_unregistered(entry, &calls_of(&entry.name), TAP_KEEP) {
                Ok(tap) => {
                    self.linked.lock().insert(entry.name.clone());
                    self.read_calls(entry, tap, sender);
                    self.linked.lock().remove(&entry.name);
                }
                Err(error) if error.is_unknown_data() => {
                    return self.refused.lock().push((entry.name.clone(), error.to_string()));
                }
                Err(_) => {}
            }
            thread::sleep(RETRY);
        }
    }

    /// Reads until the link ends.
    fn read_calls(&self, entry: &ComponentEntry, mut tap: Tap, sender: &Sender<CallReport>) {
        while self.is_wanted(entry) {
            let data = match tap.next(LOOK) {
                Ok(Some(data)) => data,
                Ok(None) => continue,
                Err(TapError::Ended(_)) => return,
                Err(error) => {
                    return self.refused.lock().push((entry.name.clone(), error.to_string()));
                }
            };
            let TracedCalls { calls, missed } = match codec::decode(&data.payload) {
                Ok(report) => report,
                Err(error) => {
                    let reason = format!("its calls cannot be read: {error}");
                    return self.refused.lock().push((entry.name.clone(), reason));
                }
            };
            let (component, instance) = (entry.name.clone(), entry.instance);
            // A lost report had one call at least.
            let missed = missed + data.lost;
            if sender.send(CallReport { component, instance, calls, missed }).is_err() {
                return;
            }
        }
    }
}
