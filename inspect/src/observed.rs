//! A running system, looked at once: who is there, and what each says of itself.

use std::thread;
use std::time::Duration;

use armor_sdk::control::{ControlConnection, Role, Status};
use armor_sdk::directory::{Directory, DirectoryError, Listing};
use armor_sdk::tap::{Tap, TapError};
use armor_wire::keep::Keep;
use armor_wire::registry::ComponentEntry;

/// How long the registry has to answer.
const REGISTRY_WITHIN: Duration = Duration::from_secs(3);
/// How long a component has to answer.
const STATUS_WITHIN: Duration = Duration::from_secs(1);
/// Components asked at once.
const AT_ONCE: usize = 32;
/// Data waiting for a tool that is slow to print; more is dropped and counted.
pub const TAP_KEEP: Keep = Keep::Last { count: 1000 };

/// The kind of the one registered process that has no control port.
pub const CONFIGD: &str = "configd";
/// Under which name that process publishes what becomes of the file.
pub const CONFIGURATION: &str = "configuration";

/// A component and what it says of itself, or why it says nothing.
pub struct Sighting {
    /// What the registry knows of it.
    pub entry: ComponentEntry,
    /// What it says.
    pub status: Result<Status, String>,
}

/// A running system.
pub struct Observed {
    directory: Directory,
    name: String,
}

impl Observed {
    /// The system whose registry listens at `registry`; `tool` says who looks.
    pub fn at(registry: &str, tool: &str) -> Self {
        let name = format!("{tool}-{}", std::process::id());
        Self { directory: Directory::observer(registry, &name), name }
    }

    /// Its registry.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// System time, in seconds.
    pub fn timestamp(&self) -> f64 {
        self.directory.clock().timestamp()
    }

    /// Everything that is registered.
    ///
    /// # Errors
    /// If the registry does not answer.
    pub fn list(&self) -> Result<Listing, DirectoryError> {
        self.directory.list(REGISTRY_WITHIN)
    }

    /// What every component says of itself, asked in parallel.
    ///
    /// # Errors
    /// If the registry does not answer.
    pub fn statuses(&self) -> Result<Vec<Sighting>, DirectoryError> {
        let entries = self.list()?.components;
        let mut sightings = Vec::new();
        for some in entries.chunks(AT_ONCE) {
            thread::scope(|scope| {
                let asked: Vec<_> =
                    some.iter().map(|entry| scope.spawn(|| self.status(entry))).collect();
                for (entry, answer) in some.iter().zip(asked) {
                    let status = answer.join().unwrap_or_else(|_| Err("asking panicked".into()));
                    sightings.push(Sighting { entry: entry.clone(), status });
                }
            });
        }
        Ok(sightings)
    }

    /// The data of one output.
    ///
    /// # Errors
    /// If nobody provides it, or its provider cannot be reached.
    pub fn tap(&self, data: &str) -> Result<Tap, TapError> {
        Tap::open(&self.directory, data, TAP_KEEP, REGISTRY_WITHIN)
    }

    fn status(&self, entry: &ComponentEntry) -> Result<Status, String> {
        if entry.kind == CONFIGD {
            return Err("it serves configuration, not control".into());
        }
        let connection = ControlConnection::connect(entry, Role::Observer, &self.name, |_| {})
            .map_err(|error| error.to_string())?;
        connection.status(STATUS_WITHIN).map_err(|error| error.to_string())
    }
}
