//! The `armor` binary.
fn main() {}
