//! Connections to the other processes of the system: connecting, then the handshake.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::time::Duration;

use armor_socket::Stream;
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{self, HandshakeError, Hello, Purpose, Welcome};
use armor_wire::registry::ComponentEntry;
use armor_wire::transport::{Endpoint, Transport};
use thiserror::Error;

/// How long a connection and its handshake may take.
const HANDSHAKE_LIMIT: Duration = Duration::from_secs(2);

/// Why a connection could not be made.
#[derive(Debug, Error)]
pub enum ConnectError {
    /// The network or the peer's host refuses.
    #[error("cannot connect to {address}: {error}")]
    Unreachable {
        /// Whom.
        address: String,
        /// Why.
        error: io::Error,
    },
    /// The peer does not answer as it should.
    #[error("the handshake with {address} failed: {error}")]
    Handshake {
        /// Whom.
        address: String,
        /// Why.
        error: HandshakeError,
    },
}

/// A connected, welcomed stream with what it has read so far.
pub(crate) struct Dialled {
    pub stream: Stream,
    pub reader: FrameReader,
    /// Files that came with what it has read: memory that was offered directly behind the welcome.
    pub files: VecDeque<OwnedFd>,
    pub welcome: Welcome,
}

/// Connects to the daemon at `address` and shakes hands.
pub(crate) fn dial(address: &str, hello: &Hello) -> Result<Dialled, ConnectError> {
    let stream = armor_socket::connect(&Endpoint::Tcp(address.into()), HANDSHAKE_LIMIT)
        .map_err(|error| unreachable(address, error))?;
    shake_hands(stream, address, hello)
}

/// Connects to the process start `to` over the best transport that `transport` allows, and shakes
/// hands.
pub(crate) fn dial_component(
    to: &ComponentEntry,
    hello: &Hello,
    transport: Transport,
) -> Result<Dialled, ConnectError> {
    let stream = armor_socket::connect_component(to, transport, HANDSHAKE_LIMIT)
        .map_err(|error| unreachable(&to.endpoint, error))?;
    let dialled = shake_hands(stream, &to.endpoint, hello)?;
    // Another process may listen on that port by now, and may not have compared the instance.
    if dialled.welcome.instance == to.instance {
        return Ok(dialled);
    }
    let (holder, meant) = (&dialled.welcome.name, &to.name);
    let text =
        format!("`{holder}` listens there, but not the process start of `{meant}` that was meant");
    Err(unreachable(&to.endpoint, io::Error::new(io::ErrorKind::NotConnected, text)))
}

fn unreachable(address: &str, error: io::Error) -> ConnectError {
    // A stopped process does not refuse: the time limit ends the wait, which sockets report as
    // `WouldBlock`.
    let error = match error.kind() {
        io::ErrorKind::WouldBlock => io::ErrorKind::TimedOut.into(),
        _ => error,
    };
    ConnectError::Unreachable { address: address.into(), error }
}

fn shake_hands(stream: Stream, address: &str, hello: &Hello) -> Result<Dialled, ConnectError> {
    let unreachable = |error| unreachable(address, error);
    let failed = |error| ConnectError::Handshake { address: address.into(), error };
    armor_socket::tune(&stream).map_err(unreachable)?;
    if matches!(hello.purpose, Purpose::Link { .. }) {
        armor_socket::enlarge_send_buffer(&stream).map_err(unreachable)?;
    }
    stream.set_read_timeout(Some(HANDSHAKE_LIMIT)).map_err(unreachable)?;
    let bytes = frame::to_bytes(FrameKind::Hello, hello).map_err(|error| failed(error.into()))?;
    // A server that refuses before it reads the hello may have closed its end already; the reason
    // is there to be read all the same.
    let written = (&stream).write_all(&bytes);
    let (mut reader, mut files) = (FrameReader::new(), VecDeque::new());
    loop {
        if let Some(frame) = reader.next_frame().map_err(|error| failed(error.into()))? {
            let welcome = hello::read_answer(&frame).map_err(failed)?;
            return Ok(Dialled { stream, reader, files, welcome });
        }
        match stream.receive_with_files(reader.space(), &mut files) {
            Ok(0) => {
                written.map_err(unreachable)?;
                return Err(unreachable(io::ErrorKind::UnexpectedEof.into()));
            }
            Ok(len) => reader.filled(len),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(unreachable(error)),
        }
    }
}
