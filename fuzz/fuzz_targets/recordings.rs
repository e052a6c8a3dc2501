//! See `read_recording` in tests/hostile/src/entry.rs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_hostile::entry::read_recording(bytes));
