//! The layout of a type as data: written as text, hashed, compared, and used to read a message
//! without its Rust type.
//!
//! A schema is finite (types are written out in place), so no wire type can be recursive.

mod difference;
mod field;
mod json;
pub(crate) mod layout;
#[cfg(test)]
mod tests;
mod text;

pub use difference::difference;
pub use field::{
    FieldError, FieldPath, Glimpse, GlimpsedValue, PayloadError, Scalar, ValuePath, glimpse_message,
};
pub use json::{JsonError, MAX_JSON_LEN, to_json};
pub use layout::{Field, Schema, Variant, hash_text};
pub use text::{MAX_DEPTH, MAX_LABEL_LEN, MAX_TEXT_LEN, MAX_UNIT_LEN, ParseError, parse};

/// The name of the type that stands for any, where a port is declared.
pub const ANY_NAME: &str = "Any";
/// Its schema text. No message has it: such a port gets the type of what feeds it.
pub const ANY_SCHEMA: &str = "Any{}";
