//! Components in threads of this process, linked through a real registry.

// A test that cannot continue may panic.
#![allow(clippy::unwrap_used)]

mod acting;
mod any_message;
mod bench_system;
mod datagrams;
mod hand_written_publisher;
mod histories;
mod links;
mod many;
mod pull;
mod shared_memory;
mod simulated_time;
mod standard_messages;
mod states;
mod strangers;
