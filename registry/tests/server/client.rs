//! A plain blocking client that beats by itself once it has sent its hello.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, LazyLock, Mutex, Weak};
use std::thread;
use std::time::Duration;

use armor_wire::codec;
use armor_wire::frame::{self, Frame, FrameKind, FrameReader};
use armor_wire::hello::{self, HandshakeError, Hello, Purpose, Welcome};
use armor_wire::liveness::BEAT;
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryReply, RegistryRequest};

/// How long anything may take before a test counts as failed.
pub const DEADLINE: Duration = Duration::from_secs(20);

/// The streams of those who beat; one thread does it on all of them.
static BEATING: LazyLock<Mutex<Vec<Weak<TcpStream>>>> = LazyLock::new(|| {
    thread::spawn(|| {
        loop {
            thread::sleep(BEAT);
            let streams = BEATING.lock().unwrap().clone();
            for stream in streams.iter().filter_map(Weak::upgrade) {
                // A client that was closed finds out when it reads.
                let _ = (&*stream).write_all(&frame::signal(FrameKind::Beat));
            }
        }
    });
    Mutex::default()
});

pub struct Client {
    pub stream: Arc<TcpStream>,
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
        client.send_frame(FrameKind::Hello, &Hello::new("test", 1, purpose));
        client.beat();
        client.answer()?;
        Ok(client)
    }

    /// The answer to the hello.
    pub fn answer(&mut self) -> Result<Welcome, HandshakeError> {
        self.next(|frame| Some(hello::read_answer(&frame)))
    }

    /// Beats from now on, once the hello is sent.
    pub fn beat(&self) {
        let mut beating = BEATING.lock().unwrap();
        beating.retain(|stream| stream.strong_count() > 0);
        beating.push(Arc::downgrade(&self.stream));
    }

    /// A connection on which nothing was sent yet.
    pub fn stranger(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.set_write_timeout(Some(DEADLINE)).unwrap();
        Self { stream: Arc::new(stream), frames: FrameReader::new() }
    }

    pub fn send(&mut self, request: &RegistryRequest) {
        self.send_frame(FrameKind::Control, request);
    }

    pub fn send_frame<T: armor_wire::WireType>(&mut self, kind: FrameKind, value: &T) {
        self.write(&frame::to_bytes(kind, value).unwrap()).unwrap();
    }

    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        (&*self.stream).write_all(bytes)
    }

    /// The next reply; beats are passed over.
    pub fn reply(&mut self) -> RegistryReply {
        self.next(|frame| match frame.kind {
            FrameKind::Beat => None,
            FrameKind::Control => Some(codec::decode_control(frame.body).unwrap()),
            other => panic!("a {other:?} frame"),
        })
    }

    /// Reads until the registry closes the connection; what it sends before does not matter.
    pub fn expect_closed(self) {
        let mut bytes = Vec::new();
        match (&*self.stream).read_to_end(&mut bytes) {
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::ConnectionReset => {}
            Err(error) => panic!("not closed: {error}"),
        }
    }

    fn next<T>(&mut self, mut take: impl FnMut(Frame<'_>) -> Option<T>) -> T {
        loop {
            while let Some(frame) = self.frames.next_frame().unwrap() {
                if let Some(taken) = take(frame) {
                    return taken;
                }
            }
            let len = (&*self.stream).read(self.frames.space()).unwrap();
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
