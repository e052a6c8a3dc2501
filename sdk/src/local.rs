//! The short way between two processes of one host: an abstract Unix socket beside the TCP port.
//!
//! Over TCP every message of a link, which only goes one way, costs an acknowledgement of its own, and
//! every segment the way through the network's layers: on one core a round trip takes twice as long.

use std::io;
use std::net::TcpStream;
use std::os::fd::OwnedFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::time::Duration;

use socket2::{Domain, SockAddr, Socket, Type};

/// Connections that may wait to be accepted.
const WAITING: i32 = 128;

/// Listens on the socket of this process start; its name is its own, whoever else runs on the host.
pub(crate) fn listen(instance: u64) -> io::Result<UnixListener> {
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
    socket.bind(&address(instance)?)?;
    socket.listen(WAITING)?;
    socket.set_nonblocking(true)?;
    Ok(OwnedFd::from(socket).into())
}

/// Takes a waiting connection.
pub(crate) fn accept(listener: &UnixListener) -> io::Result<TcpStream> {
    listener.accept().map(|(stream, _)| as_stream(stream))
}

/// Connects to the process start `instance`, which must be on this host, within `limit`: one that
/// is stopped accepts nobody, and then the connection waits for its turn.
pub(crate) fn connect(instance: u64, limit: Duration) -> io::Result<TcpStream> {
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
    socket.set_write_timeout(Some(limit))?;
    socket.connect(&address(instance)?)?;
    socket.set_write_timeout(None)?;
    Ok(as_stream(OwnedFd::from(socket).into()))
}

fn address(instance: u64) -> io::Result<SockAddr> {
    SockAddr::unix(format!("\0armor-{instance:016x}"))
}

/// Whatever is done with a link's socket is the same for both families; only the options of TCP are
/// not set on this one.
fn as_stream(stream: UnixStream) -> TcpStream {
    TcpStream::from(OwnedFd::from(stream))
}
