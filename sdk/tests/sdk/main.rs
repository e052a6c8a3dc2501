//! Components in threads of this process, linked through a real registry.

// A test that cannot continue may panic.
#![allow(clippy::unwrap_used)]

mod acting;
mod any_message;
mod bench_system;
mod copies;
mod datagrams;
mod hand_written_publisher;
mod histories;
mod links;
mod many;
mod pull;
mod role_process;
mod shared_memory;
mod simulated_time;
mod slot_kills;
mod standard_messages;
mod states;
mod strangers;
