//! Events of a daemon's peers, and the actions that a daemon takes.

use std::borrow::Cow;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use thiserror::Error;

use crate::acting::Preface;
use crate::codec::DecodeError;
use crate::frame::{FrameError, FrameKind};
use crate::hello::{HandshakeError, Hello, Welcome};
use crate::refusal::{Refusal, RefusalCode};

/// Identifies a connection. The number is not reused while the daemon runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PeerId(pub u64);

/// An event of a connection. For each peer: `Connected`, then any `Message` and `Beat` in the
/// order in which they were sent, then `Closed` unless the daemon itself ended it.
#[expect(clippy::large_enum_variant, reason = "there is one `Connected` for each connection")]
#[derive(Debug)]
pub enum PeerEvent<Q> {
    /// A peer has sent a well-formed hello; it waits for `Welcome` or `Refuse`.
    Connected {
        /// Its connection.
        peer: PeerId,
        /// Its address.
        address: SocketAddr,
        /// Its name, process start and purpose.
        hello: Hello,
        /// On whose behalf it acts, if a gate forwards it.
        preface: Option<Preface>,
    },
    /// A peer has sent a message.
    Message {
        /// Its connection.
        peer: PeerId,
        /// When it arrived, since the start of the server.
        arrived: Duration,
        /// The message.
        message: Q,
    },
    /// A peer has sent a beat.
    Beat {
        /// Its connection.
        peer: PeerId,
    },
    /// A connection has ended.
    Closed {
        /// Its connection.
        peer: PeerId,
        /// Why.
        reason: CloseReason,
    },
}

/// An action of a daemon. An action for a peer that has gone does nothing.
#[derive(Clone, Debug, PartialEq)]
pub enum PeerAction<R> {
    /// Accepts a hello.
    Welcome {
        /// The peer's connection.
        peer: PeerId,
        /// The answer.
        welcome: Welcome,
    },
    /// Refuses a hello and ends the connection. No further event of it follows.
    Refuse {
        /// The peer's connection.
        peer: PeerId,
        /// Why.
        refusal: Refusal,
    },
    /// Sends a message.
    Send {
        /// The peer's connection.
        peer: PeerId,
        /// The message.
        message: R,
    },
    /// Ends a connection. No further event of it follows.
    Close {
        /// Its connection.
        peer: PeerId,
        /// Why; goes to the log.
        reason: String,
    },
}

/// Why a connection ended.
#[derive(Debug, Error)]
pub enum CloseReason {
    /// The peer closed it between two frames.
    #[error("closed by the peer")]
    Ended,
    /// The peer closed it in the middle of a frame.
    #[error("closed by the peer in the middle of a frame")]
    Truncated,
    /// The socket failed.
    #[error("the connection broke: {0}")]
    Broken(#[source] io::Error),
    /// No whole frame has arrived for too long.
    #[error("the peer is silent")]
    Silent,
    /// The peer does not read what is sent to it.
    #[error("the peer does not read")]
    NotReading,
    /// No hello came in time.
    #[error("no hello within the deadline")]
    SlowHello,
    /// The first frame is not a hello of this protocol.
    #[error(transparent)]
    Hello(#[from] HandshakeError),
    /// The bytes are not frames of this protocol.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A frame's body is not a request of this daemon.
    #[error("a malformed request: {0}")]
    Body(#[from] DecodeError),
    /// An answer does not fit into a frame.
    #[error("the answer cannot be sent: {0}")]
    Unsendable(#[source] FrameError),
    /// The peer belongs to another user of the host.
    #[error("{0}")]
    OtherUser(String),
    /// There are too many connections already.
    #[error("too many connections")]
    Crowded,
    /// The daemon ended it.
    #[error("{0}")]
    Daemon(String),
}

impl CloseReason {
    /// Returns the kind of protocol violation, which is logged once per address; `None` if the peer
    /// did not violate the protocol.
    pub fn fault_kind(&self) -> Option<Cow<'static, str>> {
        if let Self::Hello(HandshakeError::Refused(refusal)) = self
            && refusal.code == RefusalCode::Role
        {
            // It names the holder of the key: the first such fault of each holder is logged.
            return Some(Cow::Owned(refusal.text.clone()));
        }
        self.plain_fault_kind().map(Cow::Borrowed)
    }

    fn plain_fault_kind(&self) -> Option<&'static str> {
        Some(match self {
            Self::Ended | Self::Broken(_) | Self::Silent | Self::Daemon(_) => return None,
            Self::Truncated => "truncated",
            Self::NotReading => "not reading",
            Self::SlowHello => "slow hello",
            Self::Hello(HandshakeError::Refused(_)) => "refused hello",
            Self::Hello(HandshakeError::Frame(error)) | Self::Frame(error) => {
                frame_fault_kind(error)
            }
            Self::Hello(_) => "malformed hello",
            Self::Body(_) => "malformed request",
            Self::Unsendable(_) => "unsendable answer",
            Self::OtherUser(_) => "another user",
            Self::Crowded => "too many connections",
        })
    }
}

fn frame_fault_kind(error: &FrameError) -> &'static str {
    match error {
        FrameError::UnknownKind(_) => "unknown frame",
        FrameError::TooLong { .. } => "frame too long",
        FrameError::Malformed(_) => "malformed frame",
        FrameError::Unexpected { got: FrameKind::Data, .. } => "data sent to a daemon",
        FrameError::Unexpected { .. } => "unexpected frame",
    }
}
