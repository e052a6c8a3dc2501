//! What can go wrong with a recording.

use std::io;
use std::path::PathBuf;

use armor_sdk::directory::DirectoryError;
use thiserror::Error;

use crate::writer::WriteError;

/// Why nothing is recorded, or no more.
#[derive(Debug, Error)]
pub enum RecorderError {
    /// The registry does not answer.
    #[error(transparent)]
    Directory(#[from] DirectoryError),
    /// A file cannot be created, or is there already.
    #[error("{} cannot be created: {reason}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: io::Error,
    },
    /// A file cannot be written.
    #[error("{}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: WriteError,
    },
    /// Nothing can be written into a folder.
    #[error("nothing can be written to {}: {reason}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        reason: io::Error,
    },
    /// The disk is full from the beginning.
    #[error("the disk of {} has {free} bytes left, less than the {least} that a mission needs", path.display())]
    DiskFull {
        /// The file that was to be written.
        path: PathBuf,
        /// What is left.
        free: u64,
        /// What must be left.
        least: u64,
    },
    /// A thread cannot be started.
    #[error("no thread can be started: {0}")]
    Thread(io::Error),
}
