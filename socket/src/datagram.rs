//! Sockets for datagrams: of a link, next to its stream, and of all links of a process.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};

use socket2::{Domain, SockRef, Socket, Type};

use crate::stream::Stream;

/// Receive and send buffer, in bytes: a large message is many datagrams together. The kernel caps it
/// at its own maximum.
const BUFFER_LEN: usize = 4 << 20;

/// A UDP socket on loopback that never waits.
#[derive(Debug)]
pub struct DatagramSocket(UdpSocket);

impl DatagramSocket {
    /// The socket of a process that listens for streams on `port`: of the same number.
    ///
    /// # Errors
    /// If another process has that port, or the system refuses it.
    pub fn bind(port: u16) -> io::Result<Self> {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, None)?;
        socket.bind(&SocketAddr::from((Ipv4Addr::LOCALHOST, port)).into())?;
        enlarge_datagram_buffers(&socket);
        socket.set_nonblocking(true)?;
        Ok(Self(socket.into()))
    }

    /// The socket for the datagrams of the link whose stream this is: from the port of the same number
    /// to that of the other end. A router knows by it to which connection they belong; where the other
    /// end is a process of this host, any port will do.
    ///
    /// # Errors
    /// If the stream is a Unix socket, or the system refuses a socket.
    pub fn of_stream(stream: &Stream) -> io::Result<Self> {
        let Stream::Tcp(tcp) = stream else { return Err(io::ErrorKind::Unsupported.into()) };
        let socket = Self::bind(tcp.local_addr()?.port()).or_else(|_| Self::bind(0))?;
        socket.0.connect(tcp.peer_addr()?)?;
        Ok(socket)
    }

    /// Returns its address.
    ///
    /// # Errors
    /// If the system does not know it.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.0.local_addr()
    }

    /// Sends to the other end of a link.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if the buffer is full, and
    /// [`io::ErrorKind::ConnectionRefused`] if an earlier datagram found no process.
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<()> {
        self.0.send(bytes).map(drop)
    }

    /// Sends to `address`.
    ///
    /// # Errors
    /// As [`try_send`](Self::try_send).
    pub fn try_send_to(&self, bytes: &[u8], address: SocketAddr) -> io::Result<()> {
        self.0.send_to(bytes, address).map(drop)
    }

    /// Receives a datagram. Returns its length and where it comes from.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if none has arrived.
    pub fn try_receive(&self, buffer: &mut [u8]) -> io::Result<(usize, SocketAddr)> {
        self.0.recv_from(buffer)
    }
}

/// Gives a socket for datagrams room for several large messages, as far as the system allows; with less
/// it only loses more.
pub fn enlarge_datagram_buffers(socket: &impl AsFd) {
    let socket = SockRef::from(socket);
    let _ = socket.set_recv_buffer_size(BUFFER_LEN);
    let _ = socket.set_send_buffer_size(BUFFER_LEN);
}

impl AsFd for DatagramSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use super::*;

    #[test]
    fn the_datagrams_of_a_link_have_the_ports_of_its_stream() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let server = DatagramSocket::bind(address.port()).unwrap();
        let stream = Stream::Tcp(TcpStream::connect(address).unwrap());
        let own = listener.accept().unwrap().1;
        let client = DatagramSocket::of_stream(&stream).unwrap();
        let mut buffer = [0; 16];
        let error = server.try_receive(&mut buffer).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::WouldBlock);
        client.try_send(b"one").unwrap();
        assert_eq!(server.try_receive(&mut buffer).unwrap(), (3, own));
        server.try_send_to(b"four", own).unwrap();
        assert_eq!(client.try_receive(&mut buffer).unwrap(), (4, address));
        // The port of the number is taken: any will do on one host.
        let other = DatagramSocket::of_stream(&stream).unwrap();
        assert_ne!(other.local_addr().unwrap(), own);
    }
}
