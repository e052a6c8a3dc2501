//! The callback by which a watch reports news, and the threads that call it.

use std::io;
use std::sync::Arc;
use std::thread;

/// Called, from any thread, when there is something new to see.
pub type WakeCallback = Arc<dyn Fn() + Send + Sync>;

/// Stack of a watching thread, in bytes: the threads here only read sockets and decode messages.
const STACK_LEN: usize = 512 << 10;

/// Starts a named thread that no other thread joins.
pub(crate) fn spawn_detached(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.into()).stack_size(STACK_LEN).spawn(work).map(drop)
}
