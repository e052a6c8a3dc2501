//! The version of the protocol.

/// Version of the protocol. Ends of different versions refuse each other, and a test compares the schemas
/// of a version with `docs/protocol.md`.
pub const VERSION: u16 = 4;
