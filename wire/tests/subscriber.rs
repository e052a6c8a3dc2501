//! The Python subscriber of `docs/examples` against a registry and a publisher played here: what
//! the document suffices to talk to this crate.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

use armor_wire::frame::{DataHeader, FrameKind, FrameReader, signal, to_bytes};
use armor_wire::hello::{Hello, Purpose, Welcome};
use armor_wire::keep::Keep;
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryReply, RegistryRequest};
use armor_wire::{Array, Message, WireType, codec};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/subscribe.py");
const INSTANCE: u64 = 77;

#[derive(Message)]
#[message(wire = "armor_wire")]
struct Sample {
    state: State,
    maybe: Option<u16>,
    #[message(unit = "m")]
    ranges: Array<f32>,
    bytes: Array<u8>,
}

#[derive(Message)]
#[message(wire = "armor_wire")]
enum State {
    Idle,
    Busy { job: String },
}

/// The server's end of a connection.
struct Peer {
    stream: TcpStream,
    reader: FrameReader,
}

impl Peer {
    fn accept(listener: &TcpListener) -> Self {
        let (stream, _) = listener.accept().expect("a client");
        stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a socket");
        Self { stream, reader: FrameReader::new() }
    }

    /// The next frame that is no beat, as `read` sees it.
    fn receive<T>(&mut self, read: impl Fn(&armor_wire::frame::Frame<'_>) -> T) -> T {
        loop {
            while let Some(frame) = self.reader.next_frame().expect("well-formed") {
                if frame.kind != FrameKind::Beat {
                    return read(&frame);
                }
            }
            let len = self.stream.read(self.reader.space()).expect("a frame in time");
            assert!(len > 0, "the subscriber went away");
            self.reader.filled(len);
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the subscriber reads");
    }

    fn welcome(&mut self, schema: String) -> Hello {
        let hello = self.receive(|frame| Hello::read(frame).expect("a hello"));
        let welcome = Welcome { name: "fake".into(), instance: INSTANCE, schema };
        self.send(&to_bytes(FrameKind::Welcome, &welcome).expect("short"));
        hello
    }
}

fn serve_registry(listener: &TcpListener, endpoint: String) {
    let mut peer = Peer::accept(listener);
    assert_eq!(peer.welcome(String::new()).purpose, Purpose::Registry { entry: None });
    let request =
        peer.receive(|frame| codec::decode_control::<RegistryRequest>(frame.body).expect("one"));
    let RegistryRequest::Lookup { request, data, schema, wait: true } = request else {
        panic!("{request:?} instead of a lookup that waits");
    };
    let entry = DataEntry { data, type_name: "Sample".into(), schema, latched: false };
    let (name, kind, host) = ("fake".into(), "fake".into(), "here".into());
    let provider = ComponentEntry { name, kind, instance: INSTANCE, pid: 1, host, endpoint };
    let reply = RegistryReply::Found { request, entry, provider, key: None };
    peer.send(&signal(FrameKind::Beat));
    peer.send(&to_bytes(FrameKind::Control, &reply).expect("short"));
}

fn serve_link(listener: &TcpListener, samples: &[(u64, bool, Sample)]) {
    let mut peer = Peer::accept(listener);
    let Purpose::Link { link } = peer.welcome(Sample::schema().to_string()).purpose else {
        panic!("a link is expected");
    };
    assert_eq!(
        (link.data.as_str(), link.instance, link.keep),
        ("fake.out", INSTANCE, Keep::Latest)
    );
    for (sequence, fresh, sample) in samples {
        let payload = codec::encode(sample).expect("short");
        let (sequence, fresh) = (*sequence, *fresh);
        let header = DataHeader { sequence, stamp_s: 1.5, instance: INSTANCE, fresh };
        let frame = [&header.to_bytes(payload.len())[..], &payload].concat();
        let (first, second) = frame.split_at(11);
        peer.send(first);
        peer.send(second);
        peer.send(&signal(FrameKind::Beat));
    }
    // Until the subscriber has had enough.
    let _ = peer.stream.read_to_end(&mut Vec::new());
}

#[test]
fn the_subscriber_in_python_understands_us() {
    if Command::new("python3").arg("--version").stdout(Stdio::null()).status().is_err() {
        assert!(std::env::var_os("CI").is_none(), "the gate needs python3");
        println!("skipped: there is no python3");
        return;
    }
    let listen = || TcpListener::bind("127.0.0.1:0").expect("a port");
    let (registry, publisher) = (listen(), listen());
    let address = |listener: &TcpListener| listener.local_addr().expect("bound").to_string();
    let busy = || State::Busy { job: "é".into() };
    let numbers = || Array::from(vec![0.1, f32::NAN, -2.0]);
    let bytes = || Array::from(vec![0, 127, 255]);
    let samples = [
        (5, true, Sample { state: State::Idle, maybe: None, ranges: numbers(), bytes: bytes() }),
        (
            8,
            false,
            Sample { state: busy(), maybe: Some(7), ranges: Array::default(), bytes: bytes() },
        ),
        (
            20,
            true,
            Sample { state: busy(), maybe: None, ranges: numbers(), bytes: Array::default() },
        ),
    ];
    let child = Command::new("python3")
        .args([SCRIPT, "fake.out", "--count", "3", "--registry", &address(&registry)])
        .stdout(Stdio::piped())
        .spawn()
        .expect("python3 starts");
    // In threads of their own: the script ends by itself whatever becomes of them.
    let endpoint = address(&publisher);
    std::thread::spawn(move || serve_registry(&registry, endpoint));
    std::thread::spawn(move || serve_link(&publisher, &samples));
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success());
    let expected = r#"
5 lost 0 at 1.500000 s, 36 bytes: {"state": "Idle", "maybe": null, "ranges": [0.1, "NaN", -2.0], "bytes": "AH//"}
8 lost 2 at 1.500000 s, 36 bytes: {"state": {"Busy": {"job": "é"}}, "maybe": 7, "ranges": [], "bytes": "AH//"}
20 lost 0 at 1.500000 s, 43 bytes: {"state": {"Busy": {"job": "é"}}, "maybe": null, "ranges": [0.1, "NaN", -2.0], "bytes": ""}
"#;
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), expected.trim());
}
