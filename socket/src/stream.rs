//! A connected socket of any transport, with blocking and non-waiting reads and writes.

use std::io::{self, IoSlice, IoSliceMut, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpStream};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, RawFd};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use rustix::net::{RecvFlags, SendFlags, recv, send, sendmsg};

/// What every send without waiting asks for: an error instead of waiting, and instead of SIGPIPE.
pub(crate) const SEND_NOW: SendFlags = SendFlags::DONTWAIT.union(SendFlags::NOSIGNAL);

/// A connected socket.
///
/// Each method is one system call and allocates nothing: links send and receive their messages with
/// them. All of them take `&self`, so that one thread can read while another one writes.
#[derive(Debug)]
pub enum Stream {
    /// Within one host.
    Unix(UnixStream),
    /// Between hosts, or where the link asks for it.
    Tcp(TcpStream),
}

impl Stream {
    /// Sends what the socket takes of `bytes` without waiting. Returns how many bytes it took.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if the socket takes nothing now.
    pub fn try_send(&self, bytes: &[u8]) -> io::Result<usize> {
        Ok(send(self, bytes, SEND_NOW)?)
    }

    /// Sends what the socket takes of `pieces`, one after the other, without waiting. Returns how
    /// many bytes it took.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if the socket takes nothing now.
    pub fn try_send_vectored(&self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
        Ok(sendmsg(self, pieces, &mut Default::default(), SEND_NOW)?)
    }

    /// Receives what has arrived, without waiting. Returns the number of bytes, 0 at the end of the
    /// stream.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if nothing has arrived.
    pub fn try_receive(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(recv(self, buffer, RecvFlags::DONTWAIT)?.1)
    }

    /// Waits for bytes as long as the read timeout allows, and receives them. Returns their number,
    /// 0 at the end of the stream.
    ///
    /// # Errors
    /// [`io::ErrorKind::WouldBlock`] if the read timeout has passed.
    pub fn receive(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(recv(self, buffer, RecvFlags::empty())?.1)
    }

    /// Ends the connection in one or both directions. Threads that read or write it wake up.
    ///
    /// # Errors
    /// If the connection has ended already.
    pub fn shutdown(&self, how: Shutdown) -> io::Result<()> {
        match self {
            Self::Unix(stream) => stream.shutdown(how),
            Self::Tcp(stream) => stream.shutdown(how),
        }
    }

    /// Limits how long [`receive`](Self::receive) and [`Read::read`] wait; `None` sets no
    /// limit.
    ///
    /// # Errors
    /// If `timeout` is zero.
    pub fn set_read_timeout(&self, timeout: Option<Duration>) -> io::Result<()> {
        match self {
            Self::Unix(stream) => stream.set_read_timeout(timeout),
            Self::Tcp(stream) => stream.set_read_timeout(timeout),
        }
    }

    /// Limits how long [`Write::write`] waits; `None` sets no limit.
    ///
    /// # Errors
    /// If `timeout` is zero.
    pub fn set_write_timeout(&self, timeout: Option<Duration>) -> io::Result<()> {
        match self {
            Self::Unix(stream) => stream.set_write_timeout(timeout),
            Self::Tcp(stream) => stream.set_write_timeout(timeout),
        }
    }

    /// Sets whether [`Read::read`] and [`Write::write`] return instead of waiting.
    ///
    /// # Errors
    /// If the system refuses it.
    pub fn set_nonblocking(&self, is_nonblocking: bool) -> io::Result<()> {
        match self {
            Self::Unix(stream) => stream.set_nonblocking(is_nonblocking),
            Self::Tcp(stream) => stream.set_nonblocking(is_nonblocking),
        }
    }

    /// Returns a second handle to the same connection.
    ///
    /// # Errors
    /// If the process has no file descriptors left.
    pub fn try_clone(&self) -> io::Result<Self> {
        Ok(match self {
            Self::Unix(stream) => Self::Unix(stream.try_clone()?),
            Self::Tcp(stream) => Self::Tcp(stream.try_clone()?),
        })
    }

    /// Returns the peer's address. A Unix socket's peer is on this host and has no port: its
    /// address is the loopback address with port 0.
    ///
    /// # Errors
    /// If the peer has gone.
    pub fn peer_address(&self) -> io::Result<SocketAddr> {
        match self {
            Self::Unix(_) => Ok((Ipv4Addr::LOCALHOST, 0).into()),
            Self::Tcp(stream) => stream.peer_addr(),
        }
    }
}

impl Read for &Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match *self {
            Stream::Unix(stream) => (&*stream).read(buffer),
            Stream::Tcp(stream) => (&*stream).read(buffer),
        }
    }

    fn read_vectored(&mut self, buffers: &mut [IoSliceMut<'_>]) -> io::Result<usize> {
        match *self {
            Stream::Unix(stream) => (&*stream).read_vectored(buffers),
            Stream::Tcp(stream) => (&*stream).read_vectored(buffers),
        }
    }
}

impl Write for &Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match *self {
            Stream::Unix(stream) => (&*stream).write(bytes),
            Stream::Tcp(stream) => (&*stream).write(bytes),
        }
    }

    fn write_vectored(&mut self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
        match *self {
            Stream::Unix(stream) => (&*stream).write_vectored(pieces),
            Stream::Tcp(stream) => (&*stream).write_vectored(pieces),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        (&*self).read(buffer)
    }
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        (&*self).write(bytes)
    }

    fn write_vectored(&mut self, pieces: &[IoSlice<'_>]) -> io::Result<usize> {
        (&*self).write_vectored(pieces)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl AsFd for Stream {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Unix(stream) => stream.as_fd(),
            Self::Tcp(stream) => stream.as_fd(),
        }
    }
}

impl AsRawFd for Stream {
    fn as_raw_fd(&self) -> RawFd {
        self.as_fd().as_raw_fd()
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    fn connect_pair_of_each() -> [(Stream, Stream); 2] {
        let (near, far) = UnixStream::pair().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let server = listener.accept().unwrap().0;
        [(Stream::Unix(near), Stream::Unix(far)), (Stream::Tcp(client), Stream::Tcp(server))]
    }

    #[test]
    fn bytes_arrive_in_order_whichever_call_sends_and_receives_them() {
        for (near, far) in connect_pair_of_each() {
            let mut buffer = [0; 16];
            assert_eq!(
                near.try_receive(&mut buffer).unwrap_err().kind(),
                io::ErrorKind::WouldBlock
            );
            assert_eq!(far.try_send(b"one ").unwrap(), 4);
            let pieces = [IoSlice::new(b"two "), IoSlice::new(b"three ")];
            assert_eq!(far.try_send_vectored(&pieces).unwrap(), 10);
            (&far).write_all(b"4").unwrap();
            near.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
            assert_eq!(near.receive(&mut buffer[..4]).unwrap(), 4);
            (&near).read_exact(&mut buffer[4..15]).unwrap();
            assert_eq!(&buffer[..15], b"one two three 4");
        }
    }

    #[test]
    fn a_full_socket_takes_a_part_and_then_nothing() {
        for (near, far) in connect_pair_of_each() {
            let bytes = vec![7; 16 << 20];
            let mut sent = 0;
            let error = loop {
                match near.try_send(&bytes) {
                    Ok(len) => sent += len,
                    Err(error) => break error,
                }
            };
            assert!(error.kind() == io::ErrorKind::WouldBlock && sent > 0, "{error} after {sent}");
            drop(far);
        }
    }

    #[test]
    fn the_end_of_the_stream_is_zero_bytes_and_its_peer_is_on_this_host() {
        for (near, far) in connect_pair_of_each() {
            assert!(near.peer_address().unwrap().ip().is_loopback());
            far.try_clone().unwrap().shutdown(Shutdown::Both).unwrap();
            assert_eq!(near.receive(&mut [0; 4]).unwrap(), 0);
            drop(far);
        }
    }
}
