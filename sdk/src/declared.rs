//! The type of an input, as its component declares it.

use std::sync::Arc;

use crate::message_type::MessageType;

/// The type that an input was declared with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeclaredType<'a> {
    pub input: &'a str,
    pub name: &'a str,
    pub schema_hash: u64,
    /// Of an input that takes any type: the one that it has.
    pub learned: Option<&'a Arc<MessageType>>,
}
