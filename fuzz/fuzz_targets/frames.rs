//! See `armor_fuzz::frames`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_fuzz::frames(bytes));
