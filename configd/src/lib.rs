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
mod records;
mod serve;
mod store;
mod store_watch;
pub mod versions;
mod watch;
mod watched_paths;

pub use background::BackgroundConfigd;
pub use files::write;
pub use history::KeptVersion;
pub use kinds::KindSource;
pub use serve::{ConfigdOptions, ConfigdStartError, serve};
pub use store::{kept_files, kept_numbers, kept_version, newer_than};
pub use store_watch::KeptWatch;
pub use versions::{ConfigdAction, ConfigdEvent, Notice, VersionRules, Versions, Write};
