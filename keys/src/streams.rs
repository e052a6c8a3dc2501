//! What both ends of a connection between hosts do with their sockets.

use std::io;
use std::time::Duration;

use armor_socket::{Stream, own_connection, tune_between_hosts};
use armor_wire::gate::GateReply;
use armor_wire::hello::Refusal;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time;
use tokio_rustls::server::TlsStream;

use crate::frames::write_control;

/// How long a refused client may take to read why, before its socket is closed under it.
const LINGER: Duration = Duration::from_secs(1);

/// Lets a connection notice within two seconds that the other host has fallen silent.
pub(crate) fn tune_stream(stream: TcpStream) -> io::Result<TcpStream> {
    let stream = Stream::Tcp(stream.into_std()?);
    tune_between_hosts(&stream)?;
    match stream {
        Stream::Tcp(stream) => TcpStream::from_std(stream),
        Stream::Unix(_) => Err(io::ErrorKind::Unsupported.into()),
    }
}

/// Accepts a connection of this user only.
pub(crate) fn own_stream(stream: TcpStream) -> io::Result<TcpStream> {
    TcpStream::from_std(own_connection(stream.into_std()?)?)
}

/// Sends a refusal, as far as the client takes it.
pub(crate) async fn refuse(stream: &mut TlsStream<TcpStream>, refusal: Refusal) {
    let refused = async {
        write_control(stream, &GateReply::Refused { refusal }).await?;
        stream.shutdown().await?;
        drain(stream).await;
        io::Result::Ok(())
    };
    let _ = time::timeout(LINGER, refused).await;
}

/// Waits until the client has read the alert: closing a socket that has unread bytes would reset the
/// connection and discard it.
pub(crate) async fn drain_and_close(mut stream: TcpStream) {
    let _ = stream.shutdown().await;
    let _ = time::timeout(LINGER, drain(&mut stream)).await;
}

async fn drain(stream: &mut (impl AsyncRead + Unpin)) {
    // Not in the future, which every connection would hold.
    let mut waste = vec![0; 4 << 10];
    while matches!(stream.read(&mut waste).await, Ok(len) if len > 0) {}
}
