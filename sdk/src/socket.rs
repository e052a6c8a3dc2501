//! TCP sockets as the whole system uses them: no delay, dead peers noticed, never bound where a
//! client could connect to itself.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::Duration;

use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{self, HandshakeError, Hello, Purpose, Welcome};
use armor_wire::keep::Transport;
use armor_wire::liveness::SILENCE;
use armor_wire::registry::ComponentEntry;
use socket2::{Domain, SockRef, TcpKeepalive};
use thiserror::Error;

use crate::{local, via};

/// How long a connection and its handshake may take.
const HANDSHAKE_LIMIT: Duration = Duration::from_secs(2);
/// Ports that are listened on: below the ephemeral range (see [`dial`]).
const PORTS: std::ops::Range<u16> = 10_000..32_000;
/// Socket buffers of a link. A frame up to about this size is handed over in one go.
const BUFFER_LEN: usize = 4 << 20;

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

/// A random number that no other process start has; never 0.
pub(crate) fn fresh_instance() -> u64 {
    use std::hash::{BuildHasher, Hasher};
    // The standard library seeds each hash state from the system's random source.
    let mut hasher = std::hash::RandomState::new().build_hasher();
    hasher.write_u32(std::process::id());
    hasher.finish().max(1)
}

/// Listens on the port that this process was told, or on a free one below the ephemeral range.
pub(crate) fn listen(seed: u64) -> io::Result<TcpListener> {
    if let Some(port) = via::port()? {
        let told = |error| io::Error::other(format!("ARMOR_PORT={port}: {error}"));
        return TcpListener::bind((IpAddr::V4(Ipv4Addr::LOCALHOST), port)).map_err(told);
    }
    let span = u64::from(PORTS.end - PORTS.start);
    let mut last = io::Error::from(io::ErrorKind::AddrInUse);
    for attempt in 0..200u64 {
        let hash = seed.wrapping_add(attempt).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
        let port = PORTS.start + (hash % span) as u16;
        match TcpListener::bind((IpAddr::V4(Ipv4Addr::LOCALHOST), port)) {
            Ok(listener) => return Ok(listener),
            Err(error) => last = error,
        }
    }
    Err(last)
}

pub(crate) fn tune(stream: &TcpStream, buffers: bool) -> io::Result<()> {
    let socket = SockRef::from(stream);
    if socket.domain()? != Domain::UNIX {
        socket.set_tcp_nodelay(true)?;
        socket.set_tcp_user_timeout(Some(SILENCE))?;
        let second = Duration::from_secs(1);
        let probes = TcpKeepalive::new().with_time(second).with_interval(second);
        socket.set_tcp_keepalive(&probes)?;
    }
    if buffers {
        // The kernel caps them at its own maximum; smaller ones still work.
        socket.set_send_buffer_size(BUFFER_LEN)?;
    }
    Ok(())
}

/// A connected, welcomed stream with what it has read so far.
pub(crate) struct Dialled {
    pub stream: TcpStream,
    pub reader: FrameReader,
    pub welcome: Welcome,
}

/// Name of this host, as the registry shows it.
pub(crate) fn host_name() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

/// Connects to `address` and shakes hands.
pub(crate) fn dial(address: &str, hello: &Hello) -> Result<Dialled, ConnectError> {
    shake_hands(connect(address)?, address, hello)
}

/// Connects to that process start the shortest way there is and shakes hands.
pub(crate) fn dial_component(
    to: &ComponentEntry,
    hello: &Hello,
    transport: Transport,
) -> Result<Dialled, ConnectError> {
    let near = transport == Transport::Auto && to.host == host_name() && via::proxy().is_none();
    // Two containers may share a host's name and no sockets: then nobody listens there.
    let local = if near { local::connect(to.instance, HANDSHAKE_LIMIT).ok() } else { None };
    let stream = match local {
        Some(stream) => stream,
        None => connect(&to.endpoint)?,
    };
    let dialled = shake_hands(stream, &to.endpoint, hello)?;
    // Whoever listens there by now may not have looked at who was meant.
    if dialled.welcome.instance == to.instance {
        return Ok(dialled);
    }
    let (holder, meant) = (&dialled.welcome.name, &to.name);
    let text =
        format!("`{holder}` listens there, but not the process start of `{meant}` that was meant");
    Err(unreachable(&to.endpoint, io::Error::new(io::ErrorKind::NotConnected, text)))
}

fn connect(address: &str) -> Result<TcpStream, ConnectError> {
    let unreachable = |error| unreachable(address, error);
    let proxy = via::proxy();
    let target = resolve(proxy.as_deref().unwrap_or(address)).map_err(unreachable)?;
    let stream = TcpStream::connect_timeout(&target, HANDSHAKE_LIMIT);
    if proxy.is_some() {
        let stream = stream.map_err(via::not_there).map_err(unreachable)?;
        via::lead_on(&stream, address, HANDSHAKE_LIMIT).map_err(unreachable)?;
        return Ok(stream);
    }
    let stream = stream.map_err(unreachable)?;
    // Connecting to a dead port in the ephemeral range can, on one host, succeed to itself.
    if stream.local_addr().ok() == stream.peer_addr().ok() {
        return Err(unreachable(io::ErrorKind::ConnectionRefused.into()));
    }
    Ok(stream)
}

fn unreachable(address: &str, error: io::Error) -> ConnectError {
    // A stopped process does not refuse, and its socket says only that there is nothing yet.
    let error = match error.kind() {
        io::ErrorKind::WouldBlock => io::ErrorKind::TimedOut.into(),
        _ => error,
    };
    ConnectError::Unreachable { address: address.into(), error }
}

fn shake_hands(stream: TcpStream, address: &str, hello: &Hello) -> Result<Dialled, ConnectError> {
    let unreachable = |error| unreachable(address, error);
    let failed = |error| ConnectError::Handshake { address: address.into(), error };
    let buffers = matches!(hello.purpose, Purpose::Link { .. });
    tune(&stream, buffers).map_err(unreachable)?;
    stream.set_read_timeout(Some(HANDSHAKE_LIMIT)).map_err(unreachable)?;
    let bytes = frame::to_bytes(FrameKind::Hello, hello).map_err(|error| failed(error.into()))?;
    io::Write::write_all(&mut &stream, &bytes).map_err(unreachable)?;
    let mut reader = FrameReader::new();
    loop {
        if let Some(frame) = reader.next_frame().map_err(|error| failed(error.into()))? {
            let welcome = hello::read_answer(&frame).map_err(failed)?;
            return Ok(Dialled { stream, reader, welcome });
        }
        match io::Read::read(&mut &stream, reader.space()) {
            Ok(0) => return Err(unreachable(io::ErrorKind::UnexpectedEof.into())),
            Ok(len) => reader.filled(len),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(unreachable(error)),
        }
    }
}

fn resolve(address: &str) -> io::Result<SocketAddr> {
    address.to_socket_addrs()?.next().ok_or_else(|| io::ErrorKind::AddrNotAvailable.into())
}
