//! Follows the versions of the file that configd keeps: a thread waits for newer ones.

use crate::event::ControllerEvent;
use crate::hub::ExecutiveInput;
use armor_plan::Version;
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;

/// Longest time between two looks: what wakes the thread may have failed.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// Finds the newest stored version, if it is newer than a given one, and waits for the next.
#[derive(Clone)]
pub struct Newer {
    find: Arc<dyn Fn(u64) -> Option<Version> + Send + Sync>,
    wait: Arc<dyn Fn(Duration) + Send + Sync>,
}

impl Newer {
    /// `find` receives the number of the newest known version; `wait` returns when there may be a
    /// newer one, after the given time at the latest.
    pub fn new(
        find: impl Fn(u64) -> Option<Version> + Send + Sync + 'static,
        wait: impl Fn(Duration) + Send + Sync + 'static,
    ) -> Self {
        Self { find: Arc::new(find), wait: Arc::new(wait) }
    }

    /// Returns the newest version, if it is newer than `known`.
    pub fn than(&self, known: u64) -> Option<Version> {
        (self.find)(known)
    }

    /// Waits until there may be a newer version, at most for this time.
    pub fn wait(&self, at_most: Duration) {
        (self.wait)(at_most);
    }
}

impl fmt::Debug for Newer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Newer")
    }
}

/// Sends each version newer than `known`, until the receiver is gone.
pub(crate) fn follow(newer: Newer, mut known: u64, inputs: Sender<ExecutiveInput>) {
    let look = move || {
        loop {
            if let Some(version) = newer.than(known) {
                known = version.number;
                let event = ControllerEvent::Offered(Arc::new(version));
                if inputs.send(ExecutiveInput::Event(event)).is_err() {
                    return;
                }
            }
            newer.wait(LOOK_EVERY);
        }
    };
    if let Err(error) = std::thread::Builder::new().name("versions".into()).spawn(look) {
        tracing::error!("no thread to look for new versions of the file: {error}");
    }
}
