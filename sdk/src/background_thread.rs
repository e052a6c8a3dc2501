//! Threads that wait most of the time, for sockets or signals.

use std::io;
use std::thread;

/// Stack of such a thread: it holds frames on the heap and calls nothing deep. The default of 2 MiB
/// per thread would be most of a small component's address space.
const STACK_LEN: usize = 256 << 10;

/// Starts a thread that runs until `work` returns.
///
/// # Errors
/// If the system has no more threads.
pub(crate) fn spawn_background(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.into()).stack_size(STACK_LEN).spawn(work).map(drop)
}
