//! Connecting to a process of the system on behalf of the holder of a key: no byte of the client goes to
//! a process that does not acknowledge the preface.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use armor_socket::Stream;
use armor_wire::acting::Preface;
use armor_wire::codec;
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{Hello, Purpose, Refusal, RefusalCode, read_answer};
use armor_wire::registry::{RegistryReply, RegistryRequest};
use armor_wire::transport::Endpoint;

/// How long a process of the system may take to accept a connection and its preface.
const DIAL: Duration = Duration::from_secs(2);
/// The name of the gate to the registry.
const FROM: &str = "tool-gate";
/// Most frames of the registry before its listing.
const MAX_FRAMES: usize = 64;

/// Connects to the process that listens on `target`.
///
/// # Errors
/// The refusal for the client.
pub(crate) fn dial_process(target: SocketAddr, preface: &Preface) -> Result<TcpStream, Refusal> {
    let refuse = |code, text: String| Err(Refusal::new(code, text));
    let dialled = armor_socket::connect(&Endpoint::Tcp(target.to_string()), DIAL)
        .and_then(|stream| send_preface(stream, preface));
    match dialled {
        Ok(Ok(Stream::Tcp(stream))) => Ok(stream),
        Ok(Ok(Stream::Unix(_))) => refuse(RefusalCode::WrongPurpose, "not a TCP port".into()),
        Ok(Err(refusal)) => Err(refusal),
        Err(error) => {
            let text = format!("{target} of the robot's host does not accept it: {error}");
            refuse(RefusalCode::UnknownData, text)
        }
    }
}

/// Sends the preface and waits for its acknowledgement.
fn send_preface(stream: Stream, preface: &Preface) -> io::Result<Result<Stream, Refusal>> {
    armor_socket::tune(&stream)?;
    set_timeouts(&stream, Some(DIAL))?;
    let bytes = frame::to_bytes(FrameKind::Preface, preface).map_err(io::Error::other)?;
    (&stream).write_all(&bytes)?;
    // Exactly one beat: nothing may follow it before the client's hello.
    let beat = frame::signal(FrameKind::Beat);
    let mut prefix = [0; frame::PREFIX_LEN];
    (&stream).read_exact(&mut prefix)?;
    if prefix == beat {
        set_timeouts(&stream, None)?;
        return Ok(Ok(stream));
    }
    let mut reader = FrameReader::new();
    reader.space()[..prefix.len()].copy_from_slice(&prefix);
    reader.filled(prefix.len());
    let (kind, body) = read_frame(&stream, &mut reader)?;
    match read_answer(&frame::Frame { kind, flags: 0, body: &body }) {
        Err(armor_wire::hello::HandshakeError::Refused(refusal)) => Ok(Err(refusal)),
        _ => Err(io::Error::other("it does not acknowledge a preface")),
    }
}

/// Where the processes of the system listen.
pub(crate) fn list_endpoints(registry: SocketAddr) -> io::Result<Vec<String>> {
    let stream = armor_socket::connect(&Endpoint::Tcp(registry.to_string()), DIAL)?;
    set_timeouts(&stream, Some(DIAL))?;
    let purpose = Purpose::Registry { entry: None };
    let hello = Hello::new(FROM, armor_socket::random_id(), purpose);
    let mut bytes = frame::to_bytes(FrameKind::Hello, &hello).map_err(io::Error::other)?;
    (&stream).write_all(&bytes)?;
    let mut reader = FrameReader::new();
    let (kind, body) = read_frame(&stream, &mut reader)?;
    read_answer(&frame::Frame { kind, flags: 0, body: &body }).map_err(io::Error::other)?;
    bytes.clear();
    let list = RegistryRequest::List { request: 1 };
    frame::append(FrameKind::Control, &list, &mut bytes).map_err(io::Error::other)?;
    (&stream).write_all(&bytes)?;
    for _ in 0..MAX_FRAMES {
        let (kind, body) = read_frame(&stream, &mut reader)?;
        if kind != FrameKind::Control {
            continue;
        }
        match codec::decode_control(&body).map_err(io::Error::other)? {
            RegistryReply::Listing { components, .. } => {
                return Ok(components.into_iter().map(|it| it.endpoint).collect());
            }
            RegistryReply::Refused { refusal, .. } => return Err(io::Error::other(refusal)),
            _ => {}
        }
    }
    Err(io::Error::other("it sends no listing"))
}

fn read_frame(stream: &Stream, reader: &mut FrameReader) -> io::Result<(FrameKind, Vec<u8>)> {
    loop {
        if let Some(frame) = reader.next_frame().map_err(io::Error::other)? {
            return Ok((frame.kind, frame.body.to_vec()));
        }
        match stream.receive(reader.space())? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            len => reader.filled(len),
        }
    }
}

fn set_timeouts(stream: &Stream, limit: Option<Duration>) -> io::Result<()> {
    stream.set_read_timeout(limit)?;
    stream.set_write_timeout(limit)
}
