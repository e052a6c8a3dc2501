//! Why a component is called, and what it returns.

use std::error::Error;

/// What user code may fail with: any error. It reaches the executive and the log as a report.
pub type Fault = Box<dyn Error + Send + Sync>;

/// Why `exec` is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// The component has been activated.
    Started,
    /// Its period is over.
    Tick,
    /// It has received data, and the file gives it no rate.
    Data,
    /// The last call before it is frozen or ended: bring actuators to rest.
    Stopping,
}

/// What `exec` returns.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Outcome {
    /// Nothing to report.
    #[default]
    CarryOn,
    /// The task is over; no more calls in this activation, except `Stopping`.
    Done,
    /// The task cannot be done, and why; no more calls in this activation, except `Stopping`.
    Failed(String),
    /// Something happened that the mission may wait for.
    Event {
        /// Its name: `on="component.name"` in the mission.
        name: String,
        /// Its value.
        value: f64,
    },
}

impl Outcome {
    /// A named event with a value.
    pub fn event(name: &str, value: f64) -> Self {
        Self::Event { name: name.into(), value }
    }
}
