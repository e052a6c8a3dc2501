//! The refusal of a connection or a request.

use thiserror::Error;

use crate::Message;

/// Why a connection or a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum RefusalCode {
    /// The protocol version differs.
    Version,
    /// The one asked is another process start than the one meant.
    WrongInstance,
    /// There is no such data here.
    UnknownData,
    /// The two ends mean different types.
    TypeMismatch,
    /// The name is taken.
    DuplicateName,
    /// A limit is reached.
    Limit,
    /// This port does not serve that purpose.
    WrongPurpose,
    /// A name or another part of the request is malformed.
    Malformed,
    /// The process that asks belongs to another user of the host.
    OtherUser,
    /// The role of the key does not allow it.
    Role,
}

/// Refuses a hello or a request, with the reason.
#[derive(Clone, Debug, PartialEq, Message, Error)]
#[message(wire = "armor_wire")]
#[error("{text}")]
pub struct Refusal {
    /// For programs.
    pub code: RefusalCode,
    /// For people: what is wrong, where, and what to do.
    pub text: String,
}

impl Refusal {
    /// A refusal with its reason in words.
    pub fn new(code: RefusalCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }
}
