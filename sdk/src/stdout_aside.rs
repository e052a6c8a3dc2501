//! Keeps stdout free for the manifest while a constructor runs.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::fd::AsFd;

use rustix::fs::{MemfdFlags, memfd_create};
use rustix::stdio::dup2_stdout;

/// What is kept of the text, in bytes: enough to find its source.
const MAX_LEN: u64 = 200;

/// Runs `code` with stdout directed into memory. Returns its result, and the beginning of what it has
/// printed.
///
/// # Errors
/// If stdout is closed, or there are no file descriptors left.
pub(crate) fn run_with_stdout_aside<T>(code: impl FnOnce() -> T) -> io::Result<(T, String)> {
    io::stdout().flush()?;
    let real = io::stdout().as_fd().try_clone_to_owned()?;
    let mut aside = File::from(memfd_create("stdout", MemfdFlags::CLOEXEC)?);
    dup2_stdout(&aside)?;
    let result = code();
    let flushed = io::stdout().flush();
    dup2_stdout(&real)?;
    flushed?;
    aside.seek(SeekFrom::Start(0))?;
    let mut printed = Vec::new();
    aside.take(MAX_LEN).read_to_end(&mut printed)?;
    Ok((result, String::from_utf8_lossy(&printed).into_owned()))
}
