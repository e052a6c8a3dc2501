//! A [`Stream`] and a [`Listener`] that tasks wait on. They know nothing of transports: tokio waits
//! on the descriptor, and the reads, writes and accepts are those of the blocking types.

use std::io;
use std::net::Shutdown;
use std::os::fd::AsRawFd;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use crate::listener::Listener;
use crate::stream::Stream;

/// Registers `socket` with the current tokio runtime.
///
/// # Errors
/// If the system cannot watch one more descriptor.
#[expect(
    deprecated,
    reason = "its successor is unsafe: it asks for a type whose descriptor never changes and closes \
              only when it is dropped, which is so for a Stream and a Listener"
)]
fn watch_socket<T: AsRawFd>(socket: T) -> io::Result<AsyncFd<T>> {
    AsyncFd::new(socket)
}

/// A connected socket, read and written by tasks.
pub(crate) struct AsyncStream(AsyncFd<Stream>);

impl AsyncStream {
    /// Registers `stream` with the current tokio runtime.
    ///
    /// # Errors
    /// If the system cannot watch one more descriptor.
    pub(crate) fn new(stream: Stream) -> io::Result<Self> {
        watch_socket(stream).map(Self)
    }

    /// Waits for bytes and receives them. Returns their number, 0 at the end of the stream.
    pub(crate) async fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.async_io(Interest::READABLE, |stream| stream.try_receive(buffer)).await
    }

    /// Waits until the socket takes bytes. Returns how many of `bytes` it took.
    pub(crate) async fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        self.0.async_io(Interest::WRITABLE, |stream| stream.try_send(bytes)).await
    }

    /// Writes all of `bytes`.
    pub(crate) async fn write_all(&self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.write(bytes).await? {
                0 => return Err(io::ErrorKind::WriteZero.into()),
                len => bytes = &bytes[len..],
            }
        }
        Ok(())
    }

    /// Announces the end of what this side writes.
    pub(crate) fn shutdown_writing(&self) -> io::Result<()> {
        self.0.get_ref().shutdown(Shutdown::Write)
    }
}

/// A listening socket whose connections a task accepts.
pub(crate) struct AsyncListener(AsyncFd<Listener>);

impl AsyncListener {
    /// Registers `listener` with the current tokio runtime.
    ///
    /// # Errors
    /// If the system cannot watch one more descriptor.
    pub(crate) fn new(listener: Listener) -> io::Result<Self> {
        watch_socket(listener).map(Self)
    }

    /// Waits for a connection and accepts it.
    pub(crate) async fn accept(&self) -> io::Result<Stream> {
        self.0.async_io(Interest::READABLE, Listener::accept).await
    }
}
