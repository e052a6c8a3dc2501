//! What the registry answers.

use armor_wire::registry::{ComponentEntry, DataEntry};

/// The provider of data.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundProvider {
    /// The data.
    pub entry: DataEntry,
    /// The process that provides it.
    pub provider: ComponentEntry,
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
