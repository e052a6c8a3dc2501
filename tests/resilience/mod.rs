//! Behaviour under failures (the table in ARCHITECTURE.md): processes that are killed, stopped or
//! crowded, and false or hostile peers, in systems of [probes](../probe.rs) that record every call.

mod crowd;
mod deaths;
mod failures;
mod hangs;
mod hostile_bytes;
mod impostors;
mod random_kills;
mod relinking;
mod shutdown;
pub mod system;
pub mod trace;
