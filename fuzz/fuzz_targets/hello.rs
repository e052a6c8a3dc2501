//! See `armor_fuzz::hello`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_fuzz::hello(bytes));
