//! The short way between two processes of one host, for links that spin: an abstract Unix socket
//! beside the TCP port.
//!
//! Over TCP every message of a link, which only goes one way, costs an acknowledgement of its own. A
//! link that sleeps hides that behind its wake-up; one that spins would pay for it.

use std::io;
use std::net::TcpStream;
use std::os::fd::OwnedFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};

/// The socket of a process start; its name is its own, whoever else runs on the host.
fn address(instance: u64) -> io::Result<SocketAddr> {
    SocketAddr::from_abstract_name(format!("armor-{instance:016x}"))
}

/// Listens on the socket of this process start.
pub(crate) fn listen(instance: u64) -> io::Result<UnixListener> {
    let listener = UnixListener::bind_addr(&address(instance)?)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Takes a waiting connection.
pub(crate) fn accept(listener: &UnixListener) -> io::Result<TcpStream> {
    listener.accept().map(|(stream, _)| as_stream(stream))
}

/// Connects to the process start `instance`, which must be on this host.
pub(crate) fn connect(instance: u64) -> io::Result<TcpStream> {
    UnixStream::connect_addr(&address(instance)?).map(as_stream)
}

/// Whatever is done with a link's socket is the same for both families; only the options of TCP are
/// not set on this one.
fn as_stream(stream: UnixStream) -> TcpStream {
    TcpStream::from(OwnedFd::from(stream))
}
