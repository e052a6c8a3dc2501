//! See `proof` in robotfile/tests/hostile/entry.rs.
#![no_main]

#[allow(dead_code)] // Each target calls one of its functions.
#[path = "../../robotfile/tests/hostile/entry.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::proof(bytes));
