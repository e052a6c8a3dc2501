//! See `read_plans` in tests/hostile/src/entry.rs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_hostile::entry::read_plans(bytes));
