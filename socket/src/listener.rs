//! Where processes listen: on loopback, on a port below the ephemeral range, and on a Unix socket.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd, RawFd};
use std::os::unix::net::UnixListener;

use armor_wire::transport::unix_socket_name;
use socket2::{Domain, SockAddr, SockRef, Socket, Type};
use thiserror::Error;

use crate::hosts::name_endpoint;
use crate::identity::random_id;
use crate::port_holder::explain_bind_error;
use crate::proxy;
use crate::stream::Stream;

/// Ports taken when any will do. They lie below the range from which the kernel gives a connecting
/// socket its own port: above it, a client that connects to a process that has gone can happen to
/// get the very port it connects to, and then talks to itself.
pub const PORTS: std::ops::Range<u16> = 10_000..32_000;

/// How many random ports are tried. With half of them taken, all fail once in 10^19 times.
const MAX_TRIES: usize = 64;
/// Connections that may wait to be accepted. Of a flood that fills this queue, the kernel forgets
/// connections that the client takes for open, and repeats them only after seconds.
const BACKLOG: i32 = 1024;

/// Why a process cannot listen.
#[derive(Debug, Error)]
pub enum ListenError {
    /// The address can be reached from other machines.
    #[error(
        "{0} can be reached from other machines, and without keys every one of them could command \
         the robot; listen on a loopback address such as 127.0.0.1, and let `armor gate` listen for \
         other machines"
    )]
    Wide(SocketAddr),
    /// The system refuses the address.
    #[error("cannot listen on {address}: {reason}; or choose another port")]
    Taken {
        /// Which.
        address: SocketAddr,
        /// Why; for a port in use, which process holds it.
        reason: String,
    },
}

/// A listening socket. Accepting never waits.
#[derive(Debug)]
pub enum Listener {
    /// For clients on this host.
    Unix(UnixListener),
    /// For all clients.
    Tcp(TcpListener),
}

impl Listener {
    /// Accepts a waiting connection.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if none waits.
    pub fn accept(&self) -> io::Result<Stream> {
        Ok(match self {
            Self::Unix(listener) => Stream::Unix(listener.accept()?.0),
            Self::Tcp(listener) => Stream::Tcp(listener.accept()?.0),
        })
    }

    /// Returns the IP address and port on which it listens.
    ///
    /// # Errors
    /// If it is a Unix socket, which has neither.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        match self {
            Self::Unix(_) => Err(io::ErrorKind::Unsupported.into()),
            Self::Tcp(listener) => listener.local_addr(),
        }
    }

    /// Listens on the Unix socket of the process start `instance`.
    fn bind_unix(instance: u64) -> io::Result<Self> {
        let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
        socket.bind(&unix_address(instance)?)?;
        socket.listen(BACKLOG)?;
        socket.set_nonblocking(true)?;
        Ok(Self::Unix(OwnedFd::from(socket).into()))
    }

    fn bind_tcp(address: SocketAddr) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        SockRef::from(&listener).listen(BACKLOG)?;
        listener.set_nonblocking(true)?;
        Ok(Self::Tcp(listener))
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Unix(listener) => listener.as_fd(),
            Self::Tcp(listener) => listener.as_fd(),
        }
    }
}

impl AsRawFd for Listener {
    fn as_raw_fd(&self) -> RawFd {
        self.as_fd().as_raw_fd()
    }
}

/// Returns the address of a process start's Unix socket. The leading zero byte selects Linux's
/// abstract namespace: no file is left behind when the process dies.
pub(crate) fn unix_address(instance: u64) -> io::Result<SockAddr> {
    SockAddr::unix(format!("\0{}", unix_socket_name(instance)))
}

/// Listens on a loopback address; port 0 stands for a free one of [`PORTS`].
///
/// # Errors
/// [`ListenError`] if the address is not loopback or not free.
pub fn listen(address: SocketAddr) -> Result<Listener, ListenError> {
    if !address.ip().is_loopback() {
        return Err(ListenError::Wide(address));
    }
    let is_any_port = address.port() == 0;
    let mut tries = if is_any_port { MAX_TRIES } else { 1 };
    loop {
        tries -= 1;
        let mut candidate = address;
        if is_any_port {
            candidate.set_port(choose_port());
        }
        match Listener::bind_tcp(candidate) {
            Ok(listener) => return Ok(listener),
            Err(error) if tries > 0 && error.kind() == io::ErrorKind::AddrInUse => {}
            Err(error) => {
                let reason = explain_bind_error(candidate, &error);
                return Err(ListenError::Taken { address: candidate, reason });
            }
        }
    }
}

fn choose_port() -> u16 {
    let width = u64::from(PORTS.end - PORTS.start);
    let offset = u16::try_from(random_id() % width).unwrap_or(0);
    PORTS.start + offset
}

/// All sockets on which a component listens, one for each transport.
#[derive(Debug)]
pub struct ComponentListeners {
    listeners: [Listener; 2],
}

impl ComponentListeners {
    /// Listens for connections to the process start `instance`: on its Unix socket, and on the port
    /// that `ARMOR_PORT` sets or a free one.
    ///
    /// # Errors
    /// If `ARMOR_PORT` is not a port, or the system refuses a socket.
    pub fn open(instance: u64) -> io::Result<Self> {
        let localhost = |port| SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let tcp = match proxy::fixed_port()? {
            Some(port) => Listener::bind_tcp(localhost(port)).map_err(|error| {
                let reason = explain_bind_error(localhost(port), &error);
                io::Error::other(format!("ARMOR_PORT={port}: {reason}; or set another port"))
            })?,
            None => listen(localhost(0)).map_err(io::Error::other)?,
        };
        Ok(Self { listeners: [tcp, Listener::bind_unix(instance)?] })
    }

    /// Returns the TCP address that the registry hands to clients, `address:port`, or `HOST:port` in a
    /// system of several hosts.
    ///
    /// # Errors
    /// If the system does not know it.
    pub fn endpoint(&self) -> io::Result<String> {
        let [tcp, _] = &self.listeners;
        Ok(name_endpoint(tcp.local_addr()?))
    }

    /// Returns the TCP port on which it listens, if the system knows it.
    pub fn port(&self) -> Option<u16> {
        let [tcp, _] = &self.listeners;
        tcp.local_addr().ok().map(|address| address.port())
    }

    /// Returns the sockets, for waiting on all of them.
    pub fn sockets(&self) -> impl Iterator<Item = &Listener> {
        self.listeners.iter()
    }

    /// Accepts a connection that waits on any of the sockets; `None` if none waits.
    ///
    /// # Errors
    /// If the process has no file descriptors or memory left.
    pub fn accept(&self) -> io::Result<Option<Stream>> {
        for listener in &self.listeners {
            match listener.accept() {
                Ok(stream) => return Ok(Some(stream)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn port_0_is_a_free_port_below_the_ephemeral_range() {
        let mut listeners = Vec::new();
        for _ in 0..20 {
            let listener = listen(([127, 0, 0, 1], 0).into()).unwrap();
            assert!(PORTS.contains(&listener.local_addr().unwrap().port()));
            listeners.push(listener);
        }
    }

    #[test]
    fn listening_wider_than_loopback_is_refused() {
        let error = listen(([0, 0, 0, 0], 0).into()).unwrap_err();
        assert!(error.to_string().contains("without keys"), "{error}");
        assert!(listen("[::]:0".parse().unwrap()).is_err());
    }

    #[test]
    fn a_taken_port_is_named() {
        let first = listen(([127, 0, 0, 1], 0).into()).unwrap();
        let address = first.local_addr().unwrap();
        let error = listen(address).unwrap_err();
        assert!(error.to_string().contains(&address.to_string()), "{error}");
    }
}
