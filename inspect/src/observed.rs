//! One observation of a running system: its components and the status that each reports.

use std::thread;
use std::time::Duration;

use armor_sdk::control::{ControlConnection, Role, Status};
use armor_sdk::directory::{Directory, DirectoryError, Listing};
use armor_sdk::tap::{Tap, TapError};
use armor_wire::keep::Keep;
use armor_wire::registry::ComponentEntry;

/// Time within which the registry must answer.
const REGISTRY_WITHIN: Duration = Duration::from_secs(3);
/// Time within which a component must answer.
const STATUS_WITHIN: Duration = Duration::from_secs(1);
/// Components asked in parallel; each takes a thread.
const AT_ONCE: usize = 32;
/// Queue for a tool that prints slowly; further data are dropped and counted.
pub const TAP_KEEP: Keep = Keep::Last { count: 1000 };

/// The kind of the one registered process that has no control port.
pub const CONFIGD: &str = "configd";
/// The name under which that process publishes the state of the file.
pub const CONFIGURATION: &str = "configuration";

/// The variable with the address of the registry, which the launcher sets.
const REGISTRY_VARIABLE: &str = "ARMOR_REGISTRY";

/// Returns the registry of the system of which this process is a component: its argument
/// `--registry`, or what the launcher has set.
pub fn find_own_registry() -> Option<String> {
    let given = std::env::args().skip_while(|argument| argument != "--registry").nth(1);
    given.or_else(|| std::env::var(REGISTRY_VARIABLE).ok()).filter(|address| !address.is_empty())
}

/// A registered component and its status.
pub struct Sighting {
    /// Its entry in the registry.
    pub entry: ComponentEntry,
    /// The status it reports, or why there is none.
    pub status: Result<Status, String>,
}

/// A running system. Clones share the connection to its registry.
#[derive(Clone)]
pub struct ObservedSystem {
    directory: Directory,
    name: String,
}

impl ObservedSystem {
    /// Returns the system whose registry listens at `registry`; `tool` names the observer.
    pub fn at(registry: &str, tool: &str) -> Self {
        let name = format!("{tool}-{}", std::process::id());
        Self { directory: Directory::observer(registry, &name), name }
    }

    /// Returns its registry.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// Returns system time, in seconds.
    pub fn timestamp(&self) -> f64 {
        self.directory.clock().timestamp()
    }

    /// Returns everything that is registered.
    ///
    /// # Errors
    /// If the registry does not answer.
    pub fn list(&self) -> Result<Listing, DirectoryError> {
        self.directory.fetch_listing(REGISTRY_WITHIN)
    }

    /// Asks every component for its status, in parallel.
    ///
    /// # Errors
    /// If the registry does not answer.
    pub fn ask_statuses(&self) -> Result<Vec<Sighting>, DirectoryError> {
        let entries = self.list()?.components;
        let mut sightings = Vec::new();
        for some in entries.chunks(AT_ONCE) {
            thread::scope(|scope| {
                let asked: Vec<_> =
                    some.iter().map(|entry| scope.spawn(|| self.ask_status(entry))).collect();
                for (entry, answer) in some.iter().zip(asked) {
                    let status =
                        answer.join().unwrap_or_else(|_| Err("the request panicked".into()));
                    sightings.push(Sighting { entry: entry.clone(), status });
                }
            });
        }
        Ok(sightings)
    }

    /// Asks one component for its status.
    ///
    /// # Errors
    /// In words, if it is not registered or does not answer.
    pub fn ask_component(&self, name: &str) -> Result<Status, String> {
        let entry = self.directory.find_process(name, STATUS_WITHIN);
        self.ask_status(&entry.map_err(|error| error.to_string())?)
    }

    /// Links to the data of one output.
    ///
    /// # Errors
    /// If no component provides it, or its provider cannot be reached.
    pub fn tap(&self, data: &str) -> Result<Tap, TapError> {
        self.tap_within(data, REGISTRY_WITHIN)
    }

    /// As [`Self::tap`]; waits until `timeout` for a provider.
    ///
    /// # Errors
    /// If no component provides it, or its provider cannot be reached.
    pub fn tap_within(&self, data: &str, timeout: Duration) -> Result<Tap, TapError> {
        Tap::open(&self.directory, data, TAP_KEEP, timeout)
    }

    fn ask_status(&self, entry: &ComponentEntry) -> Result<Status, String> {
        if entry.kind == CONFIGD {
            return Err("it serves configuration, not control".into());
        }
        let connection = ControlConnection::connect(entry, Role::Observer, &self.name, |_| {})
            .map_err(|error| error.to_string())?;
        connection.status(STATUS_WITHIN).map_err(|error| error.to_string())
    }
}
