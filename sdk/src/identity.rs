//! The identity of a process in its system.

/// Name, kind and start of a process.
#[derive(Clone, Debug)]
pub(crate) struct ProcessIdentity {
    /// Unique in the system.
    pub name: String,
    pub kind: String,
    /// A random number that no other process start has.
    pub instance: u64,
}
