//! Writes what a robot has mapped: a picture to look at (`picture`), a map for
//! `map_server` (`map_server`), the trajectory as text (`trajectory`). `record` decides what is
//! written when, `files` puts it on the disk; `ports` is all there is of messages.

mod files;
mod map_server;
mod picture;
mod ports;
mod record;
mod trajectory;

pub use files::WriteError;
pub use ports::MapWriter;
pub use record::{MapRecord, MapSnapshot, RecordProgress};
