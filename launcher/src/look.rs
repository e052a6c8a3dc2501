//! Looking at a running system: who is there, what flows, how the mission stands.

pub mod describe;
pub mod echo;
mod following;
pub mod graph;
pub mod hz;
pub mod mission;
pub mod ps;

use std::io::{self, Write};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result};
use armor_sdk::control::ControlConnection;
use armor_sdk::directory::{Directory, Listing};
use armor_sdk::tap::Tap;
use armor_wire::control::{Role, Status};
use armor_wire::keep::Keep;
use armor_wire::registry::ComponentEntry;

use crate::arguments::Running;
use crate::exit::Ending;
use crate::system;

/// How long the registry has to answer.
const REGISTRY_WITHIN: Duration = Duration::from_secs(3);
/// How long a component has to answer.
const STATUS_WITHIN: Duration = Duration::from_secs(1);
/// Components asked at once.
const AT_ONCE: usize = 32;
/// Data waiting for a tool that is slow to print; more is dropped and counted.
const TAP_KEEP: Keep = Keep::Last { count: 1000 };

/// The kind of the one registered process that has no control port.
const CONFIGD: &str = "configd";

/// A component and what it says of itself, or why it says nothing.
pub struct Sighting {
    pub entry: ComponentEntry,
    pub status: Result<Status, String>,
}

/// A running system.
pub struct Observed {
    directory: Directory,
    name: String,
}

impl Observed {
    /// Finds the system that is meant.
    pub fn find(running: &Running, tool: &str) -> Result<Self> {
        let address = system::registry(running)?;
        let name = format!("{tool}-{}", std::process::id());
        Ok(Self { directory: Directory::observer(&address.to_string(), &name), name })
    }

    /// Its registry.
    pub(crate) fn directory(&self) -> &Directory {
        &self.directory
    }

    /// System time, in seconds.
    pub fn timestamp(&self) -> f64 {
        self.directory.clock().timestamp()
    }

    /// Everything that is registered.
    pub fn list(&self) -> Result<Listing> {
        Ok(self.directory.list(REGISTRY_WITHIN)?)
    }

    /// What every component says of itself, asked in parallel.
    pub fn statuses(&self) -> Result<Vec<Sighting>> {
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
    pub fn tap(&self, data: &str) -> Result<Tap> {
        Tap::open(&self.directory, data, TAP_KEEP, REGISTRY_WITHIN)
            .with_context(|| format!("{data} cannot be read"))
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

/// What prints; whoever stops reading has seen enough.
pub fn printed(result: Result<()>) -> Result<Ending> {
    match result {
        Ok(()) => Ok(Ending::Fine),
        Err(error) => match error.downcast_ref::<io::Error>() {
            Some(io) if io.kind() == io::ErrorKind::BrokenPipe => Ok(Ending::Fine),
            _ => Err(error),
        },
    }
}

/// One line on stdout, at once.
pub fn say(line: impl std::fmt::Display) -> Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}")?;
    out.flush()?;
    Ok(())
}
