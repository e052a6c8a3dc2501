//! A plain blocking client.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use armor_wire::codec;
use armor_wire::frame::{self, Frame, FrameKind, FrameReader};
use armor_wire::hello::{self, HandshakeError, Hello, Purpose};
use armor_wire::registry::{ComponentEntry, DataEntry, Reply, Request};

/// How long anything may take before a test counts as failed.
pub const DEADLINE: Duration = Duration::from_secs(20);

pub struct Client {
    pub stream: TcpStream,
    frames: FrameReader,
}

impl Client {
    pub fn register(address: SocketAddr, entry: &ComponentEntry) -> Result<Self, HandshakeError> {
        Self::connect(address, Purpose::Registry { entry: Some(entry.clone()) })
    }

    pub fn observe(address: SocketAddr) -> Result<Self, HandshakeError> {
        Self::connect(address, Purpose::Registry { entry: None })
    }

    pub fn connect(address: SocketAddr, purpose: Purpose) -> Result<Self, HandshakeError> {
        let mut client = Self::stranger(address);
        client.say(FrameKind::Hello, &Hello::new("test", 1, purpose));
        client.next(|frame| match frame.kind {
            FrameKind::Beat => None,
            _ => Some(hello::read_answer(&frame)),
        })?;
        Ok(client)
    }

    /// A connection on which nothing was said yet.
    pub fn stranger(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.set_write_timeout(Some(DEADLINE)).unwrap();
        Self { stream, frames: FrameReader::new() }
    }

    pub fn send(&mut self, request: &Request) {
        self.say(FrameKind::Control, request);
    }

    pub fn say<T: armor_wire::WireType>(&mut self, kind: FrameKind, value: &T) {
        self.stream.write_all(&frame::to_bytes(kind, value).unwrap()).unwrap();
    }

    /// The next reply; beats are answered and passed over.
    pub fn reply(&mut self) -> Reply {
        let mut beats = self.stream.try_clone().unwrap();
        self.next(|frame| match frame.kind {
            FrameKind::Beat => {
                beats.write_all(&frame::signal(FrameKind::Beat)).unwrap();
                None
            }
            FrameKind::Control => Some(codec::decode_control(frame.body).unwrap()),
            other => panic!("a {other:?} frame"),
        })
    }

    fn next<T>(&mut self, mut take: impl FnMut(Frame<'_>) -> Option<T>) -> T {
        loop {
            while let Some(frame) = self.frames.next_frame().unwrap() {
                if let Some(taken) = take(frame) {
                    return taken;
                }
            }
            let len = self.stream.read(self.frames.space()).unwrap();
            assert!(len > 0, "the registry closed the connection");
            self.frames.filled(len);
        }
    }
}

pub fn entry(name: &str, instance: u64) -> ComponentEntry {
    ComponentEntry {
        name: name.into(),
        kind: "test".into(),
        instance,
        pid: 4242,
        host: "robot".into(),
        endpoint: "127.0.0.1:4000".into(),
    }
}

pub fn scan(component: &str) -> DataEntry {
    DataEntry {
        data: format!("{component}.scan"),
        type_name: "Scan".into(),
        schema: <f64 as armor_wire::WireType>::schema().to_string(),
        latched: false,
    }
}
