//! See `armor_fuzz::control_values`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_fuzz::control_values(bytes));
