//! What the registry answers.

use armor_wire::hello::Hello;
use armor_wire::registry::{ComponentEntry, DataEntry};
use armor_wire::run_key::LinkKey;

/// The provider of data.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundProvider {
    /// The data.
    pub entry: DataEntry,
    /// The process that provides it.
    pub provider: ComponentEntry,
    /// The key of a link to it, where that leads to another host of the system.
    pub key: Option<LinkKey>,
}

impl FoundProvider {
    /// Adds to the hello of a link what the provider asks of another host. It must not change after that.
    pub(crate) fn prove_link(&self, hello: &mut Hello) {
        if let Some(key) = &self.key {
            key.prove(hello);
        }
    }
}

/// All that is registered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Listing {
    /// The processes, by name.
    pub components: Vec<ComponentEntry>,
    /// Their outputs, by name.
    pub data: Vec<DataEntry>,
}

/// A change that a watcher receives.
#[derive(Clone, Debug, PartialEq)]
pub enum DirectoryChange {
    /// A process has registered. Also sent for every process that is registered already, at first
    /// and after a restart of the registry.
    Appeared(ComponentEntry),
    /// A process has gone.
    Gone(ComponentEntry),
    /// The registry cannot be reached; the registered processes are unknown until it is found.
    RegistryLost,
    /// The registry can be reached (again).
    RegistryFound,
}
