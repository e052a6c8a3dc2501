//! The messages between a process and the registry: lookups from name to endpoint, type and
//! instance, and the time.

use crate::Message;
use crate::limits::KEY_LEN;
use crate::refusal::Refusal;

/// Port on which the registry listens by default. Below the ephemeral range, so that a client
/// that connects to a dead registry cannot connect to itself.
pub const DEFAULT_PORT: u16 = 7411;

/// A registered process.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct ComponentEntry {
    /// Its name, unique in the system.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Its process start; unique.
    pub instance: u64,
    /// Process id on its host.
    pub pid: u32,
    /// Name of its host.
    pub host: String,
    /// Where it listens, `address:port`.
    pub endpoint: String,
}

/// An output that is provided.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct DataEntry {
    /// Unique name, `component.output`.
    pub data: String,
    /// Name of its type.
    pub type_name: String,
    /// Schema of its type, as canonical text.
    pub schema: String,
    /// Whether a late subscriber gets the last value immediately.
    pub latched: bool,
}

/// The data that a component may read.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct DataReader {
    /// Its name.
    pub component: String,
    /// Unique names of the data that the file leads to it, by links and as its clock.
    pub data: Vec<String>,
    /// Whether it reads all data of the system, as a recorder does.
    pub reads_all: bool,
}

/// From a process to the registry.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Request")]
pub enum RegistryRequest {
    /// Registers an output.
    Provide {
        /// Names the answer.
        request: u64,
        /// What is published.
        entry: DataEntry,
    },
    /// Withdraws an output.
    Withdraw {
        /// Unique name of the data.
        data: String,
    },
    /// Which process publishes this? Answered by `Found` as soon as one does.
    Lookup {
        /// Names the answer.
        request: u64,
        /// Unique name of the data.
        data: String,
        /// Schema the asker expects; empty takes any.
        schema: String,
        /// Whether to wait for a provider that has not registered yet.
        wait: bool,
    },
    /// Cancels a lookup.
    Cancel {
        /// The request.
        request: u64,
    },
    /// Lists everything that is registered. Answered by `Listing`.
    List {
        /// Names the answer.
        request: u64,
    },
    /// Reports every process that appears or goes from now on; the present ones are reported
    /// immediately.
    Watch,
    /// Asks for the system time.
    Time {
        /// The asker's monotonic clock in seconds when it asked.
        asked_s: f64,
    },
    /// A sign of life.
    Beat,
    /// The names that belong to processes which the launcher starts, in place of those before. Only the
    /// launcher may send it.
    Reserve {
        /// The names.
        names: Vec<String>,
    },
    /// The data that the components may read on other hosts, in place of those before. Only configd may
    /// send it.
    Readers {
        /// Each component of the file.
        readers: Vec<DataReader>,
    },
}

/// From the registry to a process.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire", name = "Reply")]
pub enum RegistryReply {
    /// The data is registered.
    Provided {
        /// The request.
        request: u64,
    },
    /// The request is refused.
    Refused {
        /// The request.
        request: u64,
        /// Why.
        refusal: Refusal,
    },
    /// A process publishes the data.
    Found {
        /// The request.
        request: u64,
        /// What is published.
        entry: DataEntry,
        /// Its provider.
        provider: ComponentEntry,
        /// For a process of another host: the key of the link ([`LinkKey`](crate::run_key::LinkKey)).
        key: Option<[u8; KEY_LEN]>,
    },
    /// All that is registered.
    Listing {
        /// The request.
        request: u64,
        /// The processes, by name.
        components: Vec<ComponentEntry>,
        /// Their outputs, by name.
        data: Vec<DataEntry>,
    },
    /// A watched process has come.
    Appeared {
        /// Which.
        entry: ComponentEntry,
    },
    /// A watched process has gone.
    Gone {
        /// Which.
        entry: ComponentEntry,
    },
    /// The time.
    Time {
        /// As in the request.
        asked_s: f64,
        /// System time in seconds when the request arrived.
        received_s: f64,
        /// System time in seconds when this was sent.
        sent_s: f64,
    },
    /// A sign of life.
    Beat,
}
