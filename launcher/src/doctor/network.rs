//! Whether processes of this host reach each other: by dialling, as they will.

use std::io;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::time::Duration;

use armor_socket::{OwnerError, Stream, check_client};

/// Longest wait for a connection within this host.
const CONNECT_WITHIN: Duration = Duration::from_secs(2);

/// What keeps processes of this host from reaching each other over TCP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LoopbackFault {
    /// No socket listens on loopback.
    Listen(String),
    /// The connection fails: a firewall drops or refuses it.
    Connect(String),
    /// The kernel does not say to whom the other end belongs.
    Owner(String),
}

/// Connects to a socket of this process, and asks the kernel for the user at the other end.
pub fn find_loopback_fault() -> Option<LoopbackFault> {
    let listener = match TcpListener::bind((Ipv4Addr::LOCALHOST, 0)) {
        Ok(listener) => listener,
        Err(error) => return Some(LoopbackFault::Listen(error.to_string())),
    };
    let connect = || -> io::Result<(TcpStream, TcpStream)> {
        let client = TcpStream::connect_timeout(&listener.local_addr()?, CONNECT_WITHIN)?;
        // The kernel completes the connection before this returns, so this does not wait.
        Ok((client, listener.accept()?.0))
    };
    let (_client, server) = match connect() {
        Ok(both) => both,
        Err(error) => return Some(LoopbackFault::Connect(error.to_string())),
    };
    match check_client(&Stream::Tcp(server)) {
        Ok(()) => None,
        Err(error @ (OwnerError::Unknown(_) | OwnerError::Closed)) => {
            Some(LoopbackFault::Owner(error.to_string()))
        }
        Err(error) => Some(LoopbackFault::Connect(error.to_string())),
    }
}
