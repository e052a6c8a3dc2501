//! Connecting to a process of the system on behalf of the holder of a key. Only to the registry, and
//! to where a registered process listens; and no byte of the client goes to a process that does not
//! acknowledge the preface.

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

use super::limits::DIAL;

/// The name of the gate to the registry.
const FROM: &str = "tool-gate";
/// Most frames of the registry before its listing.
const MAX_FRAMES: usize = 64;

/// Connects to `address`, if a process of the system listens there. Returns its name, too.
///
/// # Errors
/// The refusal for the client.
pub(crate) fn dial_process(
    registry: SocketAddr,
    address: &str,
    preface: &Preface,
) -> Result<TcpStream, Refusal> {
    let refuse = |code, text: String| Err(Refusal::new(code, text));
    let Ok(target) = address.parse::<SocketAddr>() else {
        let text = format!("{address} is not an address with a port, such as {registry}");
        return refuse(RefusalCode::Malformed, text);
    };
    if !target.ip().is_loopback() {
        let text = format!("{target} is not on the robot's host: a gate leads to its system only");
        return refuse(RefusalCode::WrongPurpose, text);
    }
    if target != registry {
        let endpoints = list_endpoints(registry).map_err(|error| {
            let text = format!("the registry at {registry} does not answer the gate: {error}");
            Refusal::new(RefusalCode::UnknownData, text)
        })?;
        if !endpoints.contains(&target) {
            let text = format!("no process of the system listens on {target} of the robot's host");
            return refuse(RefusalCode::UnknownData, text);
        }
    }
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
fn list_endpoints(registry: SocketAddr) -> io::Result<Vec<SocketAddr>> {
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
                return Ok(components.iter().filter_map(|it| it.endpoint.parse().ok()).collect());
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
