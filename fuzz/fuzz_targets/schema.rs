//! See `armor_fuzz::schema_text`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| armor_fuzz::schema_text(bytes));
