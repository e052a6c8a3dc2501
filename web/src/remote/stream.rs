//! The bytes of a browser on another host, from the first of its first request on, until its
//! connection is ended.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio_rustls::server::TlsStream;

use super::connection::RemoteConnection;

/// See the module.
pub(crate) struct RemoteStream {
    tls: TlsStream<TcpStream>,
    /// Bytes that were looked at to find out what is requested.
    first: Vec<u8>,
    connection: Arc<RemoteConnection>,
}

impl RemoteStream {
    /// The bytes `first`, and then those of `tls`.
    pub(crate) fn new(
        tls: TlsStream<TcpStream>,
        first: Vec<u8>,
        connection: Arc<RemoteConnection>,
    ) -> Self {
        Self { tls, first, connection }
    }

    /// Who uses it.
    pub(crate) fn connection(&self) -> &Arc<RemoteConnection> {
        &self.connection
    }

    fn check(&self, context: &Context<'_>) -> io::Result<()> {
        match self.connection.poll_cut(context) {
            Poll::Ready(()) => {
                Err(io::Error::new(io::ErrorKind::ConnectionAborted, "the session has ended"))
            }
            Poll::Pending => Ok(()),
        }
    }
}

impl AsyncRead for RemoteStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.check(context)?;
        if !self.first.is_empty() {
            let len = self.first.len().min(buffer.remaining());
            buffer.put_slice(&self.first[..len]);
            self.first.drain(..len);
            return Poll::Ready(Ok(()));
        }
        Pin::new(&mut self.tls).poll_read(context, buffer)
    }
}

impl AsyncWrite for RemoteStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.check(context)?;
        Pin::new(&mut self.tls).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.tls).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.tls).poll_shutdown(context)
    }
}
