//! See `read_picture` in tests/hostile/src/entry.rs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_hostile::entry::read_picture(bytes));
