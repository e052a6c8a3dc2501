//! What a process of C lacks that one of Rust has.

use std::ffi::{c_char, c_int, c_void};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::failure::{ArmorError, Failure};

unsafe extern "C" {
    /// Of the C library: `stdio.h`.
    fn fflush(stream: *mut c_void) -> c_int;
    fn setvbuf(stream: *mut c_void, buffer: *mut c_char, mode: c_int, size: usize) -> c_int;
    static stdout: *mut c_void;
}

/// `_IOLBF` of Linux: a stream is written line by line.
const LINE_BUFFERED: c_int = 1;

/// What a component prints reaches its log line by line, as in the other languages: stdout is a pipe, which
/// the C library would fill before it writes.
pub(super) fn print_by_lines() {
    // That it fails has no consequence but the delay.
    let _ = unsafe { setvbuf(stdout, std::ptr::null_mut(), LINE_BUFFERED, 0) };
}

/// Writes what C has printed and its library still holds: what `create` prints on stdout is found where it
/// is printed, not after the manifest.
pub(crate) fn flush_printed() {
    // NULL stands for all streams; that it fails has no consequence.
    let _ = unsafe { fflush(std::ptr::null_mut()) };
}

/// A write to a connection whose other end has gone is an error. Programs of Rust begin with that; those of
/// C would be ended by SIGPIPE.
pub(super) fn survive_broken_pipes() -> Result<(), Failure> {
    let received = Arc::new(AtomicBool::new(false));
    let registered = signal_hook::flag::register(signal_hook::consts::SIGPIPE, received);
    let explain = |why| Failure::new(ArmorError::Internal, format!("SIGPIPE: {why}"));
    registered.map(|_| ()).map_err(explain)
}
