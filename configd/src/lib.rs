//! configd: owns the system's file and answers what components ask of it. It takes a new version
//! of the file only when all of it is valid, and otherwise keeps the last good one.
//!
//! Start with [`versions`], the pure state machine; [`serve`] puts it on a socket and watches the
//! file.

mod answers;
mod background;
mod files;
pub mod history;
mod kinds;
mod serve;
mod store;
mod told;
pub mod versions;
mod watch;
mod way;

pub use background::Background;
pub use files::write;
pub use history::Kept;
pub use kinds::Kinds;
pub use serve::{Options, ServeError, serve};
pub use store::{kept_files, newer_than};
pub use versions::{Action, Event, Notice, Rules, Versions, Write};
