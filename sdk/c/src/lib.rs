//! Components in C and C++: the twelve functions as C functions, messages as C structs that tables
//! describe, and components under test.
//!
//! [`boundary`] is what C calls, and the one module with `unsafe`; [`declaration`] has the structs that
//! C fills in. [`layout`] turns the table of a struct into a schema and a list of steps, by which
//! [`codec`] encodes and decodes. The header `include/armor.h` is generated from these files
//! (`tests/header.rs`); `armor.hpp` is C++ over it.

// A message is copied between memory and the wire as it is.
#[cfg(target_endian = "big")]
compile_error!("armor-c needs a little-endian machine");

pub mod boundary;
mod codec;
mod component;
pub mod declaration;
pub mod failure;
mod layout;
