//! Behaviour under failures (the table in ARCHITECTURE.md): killed and stopped processes, many
//! components, false and hostile peers. The systems consist of [probes](../probe.rs), which record
//! every call.

mod bad_network;
mod crowd;
mod datagrams;
mod deaths;
mod failures;
mod far_sink;
mod floods;
mod hangs;
mod hostile_bytes;
mod impostors;
mod random_kills;
mod relinking;
mod shutdown;
pub mod system;
pub mod trace;
