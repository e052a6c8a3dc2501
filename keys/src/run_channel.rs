//! The connection on which a component of another host is run: orders in one direction, events in the
//! other, beats in both. Its end means only that the two hosts are cut off from each other.

use std::io::{self, Read};
use std::path::Path;
use std::pin::Pin;
use std::time::Duration;

use armor_wire::codec;
use armor_wire::frame::{self, FrameKind};
use armor_wire::gate::{GateReply, GateRequest};
use armor_wire::hello::Refusal;
use armor_wire::liveness::{BEAT, SILENCE};
use armor_wire::message::WireType;
use armor_wire::remote_process::{RemoteEvent, RemoteOrder, RemoteStart};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadHalf, WriteHalf};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio::time;
use tokio_rustls::{client, server};

use crate::connect::{GateClient, GateError};
use crate::frames::{read_control, read_frame, write_control};
use crate::streams::refuse;

/// Longest piece of output in one event, in bytes: a frame takes 16 KiB.
pub const MAX_OUTPUT_LEN: usize = 8 << 10;

/// How long the next piece of an executable may take.
const NEXT_PIECE_WITHIN: Duration = Duration::from_secs(5);
/// How long the agent may take for an executable that it has received: it is asked for its ports.
const ANSWERS_WITHIN: Duration = Duration::from_secs(30);
/// Bytes of an executable that are read and written at a time.
const PIECE_LEN: usize = 64 << 10;

/// The agent's end.
pub struct RunChannel {
    stream: server::TlsStream<TcpStream>,
    /// Returns why the gate ends the connection.
    ended: Pin<Box<dyn Future<Output = String> + Send>>,
}

impl RunChannel {
    pub(crate) fn new(
        stream: server::TlsStream<TcpStream>,
        ended: impl Future<Output = String> + Send + 'static,
    ) -> Self {
        Self { stream, ended: Box::pin(ended) }
    }

    /// Refuses the request.
    pub async fn refuse(mut self, refusal: Refusal) {
        refuse(&mut self.stream, refusal).await;
    }

    /// Asks for the executable of the component, of `len` bytes, and calls `take` with each piece.
    /// [`Self::serve`] or [`Self::refuse`] follows.
    ///
    /// # Errors
    /// Why it has not arrived.
    pub async fn receive_executable(
        &mut self,
        len: u64,
        mut take: impl FnMut(&[u8]) -> io::Result<()>,
    ) -> Result<(), String> {
        let Self { stream, ended } = self;
        let receive = async {
            write_control(stream, &GateReply::ExecutableWanted).await?;
            let mut bytes = vec![0; PIECE_LEN];
            let mut rest = len;
            while rest > 0 {
                let most = usize::try_from(rest).unwrap_or(PIECE_LEN).min(PIECE_LEN);
                let read = time::timeout(NEXT_PIECE_WITHIN, stream.read(&mut bytes[..most])).await;
                match read.map_err(|_| io::Error::other("no more of it arrives"))?? {
                    0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                    len => {
                        take(&bytes[..len])?;
                        rest -= len as u64;
                    }
                }
            }
            Ok(())
        };
        tokio::select! {
            received = receive => received.map_err(|error: io::Error| explain_end(&error)),
            why = ended => Err(why),
        }
    }

    /// Accepts the request, sends `events`, and calls `obey` with each order. Returns why the
    /// connection has ended, or `None` when there are no more events; events that it has not sent are
    /// still in `events` then.
    pub async fn serve(
        mut self,
        events: &mut mpsc::Receiver<RemoteEvent>,
        mut obey: impl FnMut(RemoteOrder),
    ) -> Option<String> {
        if let Err(error) = write_control(&mut self.stream, &GateReply::Connected).await {
            return Some(error.to_string());
        }
        let (mut reader, mut writer) = tokio::io::split(self.stream);
        tokio::select! {
            ended = send_messages(&mut writer, events) => match ended {
                Ok(()) => {
                    let _ = time::timeout(SILENCE, writer.shutdown()).await;
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            error = hear_messages(&mut reader, &mut obey) => Some(explain_end(&error)),
            why = &mut self.ended => Some(why),
        }
    }
}

/// The launcher's end.
pub struct RunConnection {
    /// Returns that the key of the agent is revoked.
    revoked: Pin<Box<dyn Future<Output = String> + Send>>,
    reader: ReadHalf<client::TlsStream<TcpStream>>,
    writer: WriteHalf<client::TlsStream<TcpStream>>,
}

impl GateClient {
    /// Asks the agent behind this gate to run a component, and sends its executable if the agent asks
    /// for it.
    ///
    /// # Errors
    /// If the agent cannot be reached, or refuses.
    pub async fn run(
        &self,
        start: RemoteStart,
        executable: Option<&Path>,
    ) -> Result<RunConnection, GateError> {
        let len = start.executable_len;
        let (mut stream, mut reply) = self.request(GateRequest::Run { start }).await?;
        if let (GateReply::ExecutableWanted, Some(path)) = (&reply, executable) {
            let unsent = |error: io::Error| GateError::Unsent {
                path: path.to_owned(),
                reason: explain_end(&error),
            };
            send_executable(&mut stream, path, len).await.map_err(unsent)?;
            let answer = time::timeout(ANSWERS_WITHIN, read_control(&mut stream)).await;
            let silent = |_| io::Error::other("it does not answer");
            reply = answer.map_err(silent).and_then(|answer| answer).map_err(unsent)?;
        }
        match (stream, reply) {
            (stream, GateReply::Connected) => {
                let revoked = Box::pin(self.wait_for_revocation(&stream));
                let (reader, writer) = tokio::io::split(stream);
                Ok(RunConnection { revoked, reader, writer })
            }
            (_, GateReply::Refused { refusal }) => Err(GateError::Refused(refusal)),
            _ => Err(GateError::Unreachable {
                gate: self.name_gate(),
                reason: "it answers another request".into(),
            }),
        }
    }
}

impl RunConnection {
    /// Sends `orders`, and calls `heard` with each event until it returns a value, which ends the
    /// connection.
    ///
    /// # Errors
    /// Why the connection has ended before: the agent is cut off.
    pub async fn follow<T>(
        self,
        orders: &mut mpsc::Receiver<RemoteOrder>,
        heard: impl FnMut(RemoteEvent) -> Option<T>,
    ) -> Result<T, String> {
        self.exchange(orders, heard).await.map_err(|error| explain_end(&error))
    }

    async fn exchange<T>(
        mut self,
        orders: &mut mpsc::Receiver<RemoteOrder>,
        mut heard: impl FnMut(RemoteEvent) -> Option<T>,
    ) -> io::Result<T> {
        let mut result = None;
        let hear = async {
            loop {
                if let Some(event) = hear_message(&mut self.reader).await?
                    && let Some(value) = heard(event)
                {
                    result = Some(value);
                    return io::Result::Ok(());
                }
            }
        };
        tokio::select! {
            ended = hear => ended?,
            why = &mut self.revoked => return Err(io::Error::other(why)),
            sent = send_messages(&mut self.writer, orders) => {
                sent?;
                return Err(io::ErrorKind::ConnectionAborted.into());
            }
        }
        result.ok_or_else(|| io::ErrorKind::ConnectionAborted.into())
    }
}

/// Sends `len` bytes of a file.
async fn send_executable(
    stream: &mut client::TlsStream<TcpStream>,
    path: &Path,
    len: u64,
) -> io::Result<()> {
    let mut file = std::fs::File::open(path)?.take(len);
    let mut bytes = vec![0; PIECE_LEN];
    let mut sent = 0;
    while sent < len {
        // From the disk's cache: the file was read when the system was checked.
        let read = file.read(&mut bytes)?;
        if read == 0 {
            return Err(io::Error::other("it was replaced since the file was checked"));
        }
        let written = time::timeout(NEXT_PIECE_WITHIN, stream.write_all(&bytes[..read])).await;
        written.map_err(|_| io::Error::other("the agent does not read"))??;
        sent += read as u64;
    }
    stream.flush().await
}

/// Why a connection has ended, for people: TLS adds how it would have ended in order.
fn explain_end(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "it has closed the connection".into(),
        _ => error.to_string(),
    }
}

/// Sends what comes, and beats in between; returns when no more can come.
async fn send_messages<T: WireType>(
    writer: &mut (impl AsyncWrite + Unpin),
    messages: &mut mpsc::Receiver<T>,
) -> io::Result<()> {
    loop {
        let sent = match time::timeout(BEAT, messages.recv()).await {
            Ok(Some(message)) => time::timeout(SILENCE, write_control(writer, &message)).await,
            Ok(None) => return Ok(()),
            Err(_) => {
                let beat = async {
                    writer.write_all(&frame::signal(FrameKind::Beat)).await?;
                    writer.flush().await
                };
                time::timeout(SILENCE, beat).await
            }
        };
        sent.map_err(|_| io::Error::other("the other end does not read"))??;
    }
}

async fn hear_messages<T: WireType>(
    reader: &mut (impl AsyncRead + Unpin),
    take: &mut impl FnMut(T),
) -> io::Error {
    loop {
        match hear_message(reader).await {
            Ok(Some(message)) => take(message),
            Ok(None) => {}
            Err(error) => return error,
        }
    }
}

/// Reads the next frame: a message, or a beat.
async fn hear_message<T: WireType>(reader: &mut (impl AsyncRead + Unpin)) -> io::Result<Option<T>> {
    let frame = time::timeout(SILENCE, read_frame(reader)).await;
    match frame.map_err(|_| io::Error::other("it has fallen silent"))?? {
        (FrameKind::Beat, _) => Ok(None),
        (FrameKind::Control, body) => codec::decode_control(&body)
            .map(Some)
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.to_string())),
        _ => Err(io::ErrorKind::InvalidData.into()),
    }
}
