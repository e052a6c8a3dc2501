//! Serves a running system to browsers and programs: JSON over HTTP and WebSocket, metrics in the
//! text format of Prometheus, and one page for operators. On loopback it serves the user of the
//! system; beyond, HTTPS to persons with an invitation (`remote.rs`).
//!
//! Start with `endpoints.rs`, the table of all routes; `server.rs` accepts connections, on one
//! thread for STOP and on others for everything else. [`WebServer`] is all that other crates see.

mod commands;
mod control_desk;
mod control_routes;
mod data_hub;
mod data_routes;
mod endpoints;
mod failure;
mod first_bytes;
mod histogram;
mod images;
mod launcher_question;
mod live;
mod metrics;
mod mission_routes;
mod openapi;
mod order_desk;
mod order_queue;
mod page;
mod parameter_routes;
mod process_usage;
mod query;
mod remote;
mod request_guard;
mod server;
mod stall_guard;
mod stop_desk;
mod stop_routes;
mod system_routes;
mod web_options;
mod web_state;

#[cfg(test)]
mod tests;

pub use armor_inspect::DriveLimits;
pub use armor_keys::folder::find_keys_folder;
pub use commands::RobotCommands;
pub use server::{RemoteFacts, WebServer, WebStartError};
pub use web_options::{DEFAULT_LISTEN, WebOptions};
