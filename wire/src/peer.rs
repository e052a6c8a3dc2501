//! What a daemon is told about its peers, and what it can do to them.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use thiserror::Error;

use crate::codec::DecodeError;
use crate::frame::{FrameError, FrameKind};
use crate::hello::{HandshakeError, Hello, Refusal, Welcome};

/// One connection, never used again for another one while the daemon runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PeerId(pub u64);

/// What happens on the connections. For each peer: `Connected`, then any `Message` and `Beat` in the
/// order in which they were sent, then `Closed` unless the daemon itself ended it.
#[derive(Debug)]
pub enum PeerEvent<Q> {
    /// A peer has said a well-formed hello; it waits for `Welcome` or `Refuse`.
    Connected {
        /// Its connection.
        peer: PeerId,
        /// Where it comes from.
        address: SocketAddr,
        /// Who it is and what it wants.
        hello: Hello,
    },
    /// A peer says something.
    Message {
        /// Who.
        peer: PeerId,
        /// When it arrived, since the start of the server.
        arrived: Duration,
        /// What.
        message: Q,
    },
    /// A peer says that it is alive.
    Beat {
        /// Who.
        peer: PeerId,
    },
    /// A connection has ended.
    Closed {
        /// Whose.
        peer: PeerId,
        /// Why.
        reason: CloseReason,
    },
}

/// What a daemon does. Actions for peers that are gone do nothing.
#[derive(Clone, Debug, PartialEq)]
pub enum PeerAction<R> {
    /// Answers a hello: go on.
    Welcome {
        /// Whom.
        peer: PeerId,
        /// With what.
        welcome: Welcome,
    },
    /// Answers a hello with a no and ends the connection. No event of it comes after this.
    Refuse {
        /// Whom.
        peer: PeerId,
        /// Why.
        refusal: Refusal,
    },
    /// Says something.
    Send {
        /// To whom.
        peer: PeerId,
        /// What.
        message: R,
    },
    /// Ends a connection. No event of it comes after this.
    Close {
        /// Whose.
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
    /// Nothing whole was heard for too long.
    #[error("the peer is silent")]
    Silent,
    /// The peer does not read what is sent to it.
    #[error("the peer does not read")]
    NotReading,
    /// No hello came in time.
    #[error("no hello within the deadline")]
    SlowHello,
    /// The hello is not one.
    #[error(transparent)]
    Hello(#[from] HandshakeError),
    /// The bytes are not frames of this protocol.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A frame's body is not what this daemon is asked with.
    #[error("a malformed request: {0}")]
    Body(#[from] DecodeError),
    /// An answer does not fit into a frame.
    #[error("the answer cannot be sent: {0}")]
    Unsendable(#[source] FrameError),
    /// There are too many connections already.
    #[error("too many connections")]
    Crowded,
    /// The daemon ended it.
    #[error("{0}")]
    Daemon(String),
}

impl CloseReason {
    /// The kind of misbehaviour, as logged once per address; `None` if the peer did nothing wrong.
    pub fn fault_kind(&self) -> Option<&'static str> {
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
