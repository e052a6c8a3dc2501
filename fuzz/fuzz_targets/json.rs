//! See `armor_fuzz::json`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_fuzz::json(bytes));
