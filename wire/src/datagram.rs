//! Data of a link in datagrams: how a message is cut into them, sent again while it may still be of
//! use, and put together again (docs/protocol.md, Datagrams).
//!
//! [`DatagramSender`] is the publisher's end, [`DatagramReceiver`] the subscriber's. Both are state
//! machines: datagrams and the time are handed to them, and what they send is handed back.

mod fragments;
mod packet;
mod receiver;
mod round_trip;
mod sender;
#[cfg(test)]
mod tests;

use crate::Message;

pub use packet::read_token;
pub use receiver::{DatagramReceiver, ReceivedMessage};
pub use sender::{DatagramSender, ReceiptEffect};

/// Longest datagram in bytes: sealed, with the headers of UDP and IPv6, it fits into the 1280 bytes that
/// every way of IPv6 carries whole.
pub const DATAGRAM_LEN: usize = 1200;
/// Longest payload of a message that datagrams carry, in bytes; a longer one takes the stream.
pub const MAX_DATAGRAM_MESSAGE: usize = 256 << 10;
/// Most messages that are sent again until they have arrived.
pub const MAX_RESENT: u32 = 64;

/// The body of [`FrameKind::DatagramOffer`](crate::frame::FrameKind::DatagramOffer): the publisher can
/// send the data of this link in datagrams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "DatagramOffer")]
pub struct DatagramOfferBody {
    /// Begins every datagram of this link.
    pub token: u64,
    /// How many messages are sent again until they have arrived or newer ones have taken their places:
    /// the newest ones. 0: none.
    pub resent: u32,
}

/// The body of [`FrameKind::DatagramSwitch`](crate::frame::FrameKind::DatagramSwitch): what carries the
/// data from here on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire", name = "DatagramSwitch")]
pub struct DatagramSwitchBody {
    /// Whether data come in datagrams; otherwise by the stream.
    pub in_datagrams: bool,
    /// No data before this sequence follow, neither by the stream nor in datagrams.
    pub next: u64,
}
