//! What holds when things fail (the table of the design): processes killed, stopped, crowded, and
//! lied to, in systems of [probes](../probe.rs) that write down what happens to them.

mod crowd;
mod deaths;
mod ends;
mod failures;
mod impostors;
mod relinking;
mod rounds;
mod silence;
mod strangers;
pub mod system;
pub mod trace;
