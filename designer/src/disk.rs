//! What the designer does with the disk beyond reading and saving: unsaved work is kept apart and
//! offered again, changes from outside are noticed and merged, recent files are remembered.

pub mod examples;
mod keeper;
pub mod listing;
pub mod merge;
pub mod own;
pub mod recent;
pub mod recovery;
pub mod watch;

pub use keeper::{Keeper, KeeperRequest, put_back};
pub use own::state_folder;

#[cfg(test)]
pub(crate) mod scratch;
