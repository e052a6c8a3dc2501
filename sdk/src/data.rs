//! Data as a component receives them.

use armor_wire::codec::{self, DecodeError};
use armor_wire::message::Message;

/// Where data comes from, when it was created, and what is missing before it.
#[derive(Clone, Copy, Debug)]
pub struct Header<'a> {
    pub(crate) id: &'a str,
    pub(crate) data: &'a str,
    /// Counts what the output has published, from 0.
    pub sequence: u64,
    /// When it was created: system time in seconds.
    pub stamp_s: f64,
    /// Process start that published it.
    pub instance: u64,
    /// How many messages were lost immediately before it.
    pub lost: u64,
}

impl<'a> Header<'a> {
    /// Local name of the input.
    pub fn id(&self) -> &'a str {
        self.id
    }

    /// System-wide name of the data, `component.output`.
    pub fn data(&self) -> &'a str {
        self.data
    }
}

/// The content of data, as it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Data<'a> {
    pub(crate) bytes: &'a [u8],
}

impl<'a> Data<'a> {
    /// Reads the content as a message of the type the input was declared with.
    ///
    /// # Errors
    /// If the bytes are not one message of type `T`.
    pub fn decode<T: Message>(&self) -> Result<T, DecodeError> {
        codec::decode(self.bytes)
    }

    /// The encoded message (`docs/protocol.md`, Values).
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}
