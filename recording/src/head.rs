//! What a message is besides its bytes: a small message of its own in front of it.

use armor_sdk::prelude::Message;
use armor_wire::codec;
use armor_wire::message::WireType;

use crate::ros::{LayoutError, RosMessage};

/// The topic of the heads.
pub(crate) const HEADS: &str = "armor.heads";

/// Sequence, stamp and publisher of a message, as they were published.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MessageHead {
    /// Its number among all that its output has published.
    pub sequence: u64,
    /// When it was published, in system time.
    pub stamp_s: f64,
    /// The process that published it.
    pub instance: u64,
    /// How many messages the recorder has lost immediately before it.
    pub lost: u64,
}

/// The same in the file, with the channel of the message that follows.
#[derive(Message, Clone, Debug, PartialEq)]
pub(crate) struct RecordedHead {
    pub channel: u16,
    pub sequence: u64,
    #[message(unit = "s")]
    pub published: f64,
    pub instance: u64,
    pub lost: u64,
    /// Of the message, where nanoseconds cannot express them.
    #[message(unit = "s")]
    pub stamps: Vec<f64>,
}

/// Converts heads.
#[derive(Debug)]
pub(crate) struct HeadCodec {
    pub message: RosMessage,
}

impl HeadCodec {
    pub fn new() -> Self {
        Self { message: RosMessage::new(&RecordedHead::schema()) }
    }

    pub fn encode(&self, head: &RecordedHead) -> Result<Vec<u8>, LayoutError> {
        let payload = codec::encode(head).map_err(|_| NO_HEAD)?;
        Ok(self.message.encode(&payload)?.bytes)
    }

    pub fn decode(&self, bytes: &[u8]) -> Result<RecordedHead, LayoutError> {
        let payload = self.message.decode(bytes, &[])?;
        codec::decode(&payload).map_err(|_| NO_HEAD)
    }
}

const NO_HEAD: LayoutError = LayoutError { problem: "it is no head of a message", at: 0 };
