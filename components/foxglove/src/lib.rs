//! A live view for Foxglove, and for every other viewer that speaks its WebSocket protocol
//! (`foxglove.sdk.v1`): data, time, parameters, connections, and orders back to the robot.
//!
//! `viewer_protocol` reads and writes the messages, `outbox` is what waits for one client, and
//! `drive_desk` decides who drives; all three are pure. `ports` is the component, its server and
//! everything else that handles the messages of the robot.

mod connection_graph;
mod drive_desk;
mod goal_keeper;
mod outbox;
mod ports;
mod viewer_handshake;
mod viewer_protocol;

pub use ports::{Foxglove, run};
