//! Follows the versions of the file that configd keeps: a thread polls for newer ones.

use crate::event::ControllerEvent;
use crate::hub::ExecutiveInput;
use armor_plan::Version;
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;

/// Time between two polls: short enough for a user who has just saved a file.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// Finds the newest stored version, if it is newer than a given one.
#[derive(Clone)]
pub struct Newer(Arc<dyn Fn(u64) -> Option<Version> + Send + Sync>);

impl Newer {
    /// `find` receives the number of the newest known version.
    pub fn new(find: impl Fn(u64) -> Option<Version> + Send + Sync + 'static) -> Self {
        Self(Arc::new(find))
    }

    /// Returns the newest version, if it is newer than `known`.
    pub fn than(&self, known: u64) -> Option<Version> {
        (self.0)(known)
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
            std::thread::sleep(LOOK_EVERY);
        }
    };
    if let Err(error) = std::thread::Builder::new().name("versions".into()).spawn(look) {
        tracing::error!("no thread to look for new versions of the file: {error}");
    }
}
