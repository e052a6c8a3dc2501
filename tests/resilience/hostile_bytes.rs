//! Garbage, half frames, giant lengths, wrong versions, slow handshakes and idle connections on
//! every port. Each connection is closed, memory and log stay bounded, and data continues to flow.

use std::io::{ErrorKind, Read, Write};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use armor_socket::Stream;
use armor_wire::control::Role;
use armor_wire::frame::{FrameKind, FrameReader, to_bytes};
use armor_wire::hello::{Hello, LinkRequest, Purpose, Refusal, RefusalCode};
use armor_wire::keep::{Keep, Wake};
use armor_wire::registry::ComponentEntry;
use armor_wire::shared_memory::MemoryUse;
use armor_wire::transport::Endpoint;

use super::system::{Draft, System, proc_number};
use super::trace::check_nothing_lost;
use crate::fixture::{DEADLINE, Folder};

/// Number of repetitions of each attack.
const TIMES: usize = 20;
/// Number of connections that are opened and left idle.
const LEFT: usize = 200;
/// Most memory that all attacks together may cost a process, in KiB: the buffers of the most
/// connections it accepts, and the freed memory that the allocator retains.
const MOST_GROWTH_KIB: u64 = 24 << 10;
/// Most lines in the log of one process: one or two for each attack, not one for each repetition.
const MOST_LINES: usize = 30;

/// An address at which a process listens.
#[derive(Clone, Copy, Debug)]
pub enum Port {
    Tcp(SocketAddr),
    /// The Unix socket of a process start on this host.
    Local(u64),
}

pub fn connect(port: Port) -> Stream {
    let endpoint = match port {
        Port::Tcp(address) => Endpoint::Tcp(address.to_string()),
        Port::Local(instance) => Endpoint::Unix(instance),
    };
    let stream = armor_socket::connect(&endpoint, DEADLINE).expect("it listens");
    stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    stream
}

/// Reads to the end; returns the bytes, or nothing if the connection was reset.
fn rest(mut stream: &Stream) -> Vec<u8> {
    let mut answer = Vec::new();
    match stream.read_to_end(&mut answer) {
        Ok(_) => {}
        Err(error) if error.kind() == ErrorKind::ConnectionReset => {}
        Err(error) => panic!("not closed: {error}"),
    }
    answer
}

/// Sends `bytes` and waits until the process closes the connection.
fn is_closed(port: Port, bytes: &[u8]) {
    for _ in 0..TIMES {
        let stream = connect(port);
        // The process may close the connection before all bytes are written.
        let _ = (&stream).write_all(bytes);
        rest(&stream);
    }
}

/// Sends a hello, waits for the welcome, sends `bytes` and waits until the process closes the
/// connection.
fn is_closed_after_welcome(port: Port, purpose: &Purpose, bytes: &[u8]) {
    for _ in 0..TIMES {
        let stream = connect(port);
        let hello = to_bytes(FrameKind::Hello, &Hello::new("stranger", 7, purpose.clone()));
        (&stream).write_all(&hello.expect("it fits")).expect("it listens");
        let mut reader = FrameReader::new();
        while reader.next_frame().expect("frames").is_none() {
            let len = (&stream).read(reader.space()).expect("an answer");
            assert!(len > 0, "no welcome");
            reader.filled(len);
        }
        let _ = (&stream).write_all(bytes);
        rest(&stream);
    }
}

/// A peer with another protocol version receives a refusal that states the reason.
fn is_refused(port: Port, mut hello: Hello) {
    hello.version = 99;
    let bytes = to_bytes(FrameKind::Hello, &hello).expect("it fits");
    for _ in 0..TIMES {
        let stream = connect(port);
        (&stream).write_all(&bytes).expect("it listens");
        let answer = rest(&stream);
        let mut reader = FrameReader::new();
        reader.space()[..answer.len()].copy_from_slice(&answer);
        reader.filled(answer.len());
        let frame = reader.next_frame().expect("a frame").expect("an answer");
        assert_eq!(frame.kind, FrameKind::Refusal);
        let refusal: Refusal = armor_wire::codec::decode_control(frame.body).expect("a refusal");
        assert_eq!(refusal.code, RefusalCode::Version, "{refusal}");
    }
}

/// A hello at five bytes per second is cut off by the handshake's deadline.
fn is_too_slow(port: Port, hello: &[u8]) {
    let mut stream = connect(port);
    stream.set_read_timeout(Some(Duration::from_millis(200))).expect("a timeout");
    let start = Instant::now();
    for byte in hello.iter().cycle() {
        assert!(start.elapsed() < DEADLINE, "still open");
        let closed = stream.write_all(&[*byte]).is_err()
            || match stream.read(&mut [0]) {
                Ok(len) => len == 0,
                Err(error) => !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
            };
        if closed {
            return;
        }
    }
}

/// Many connections that send nothing, or half a hello, are closed by the process.
fn are_closed(port: Port, hello: &[u8]) {
    let left: Vec<_> = (0..LEFT).map(|_| connect(port)).collect();
    for (number, mut stream) in left.iter().enumerate() {
        if number % 2 == 0 {
            let _ = stream.write_all(&hello[..hello.len() / 2]);
        }
    }
    left.iter().for_each(|stream| drop(rest(stream)));
}

fn prefix(len: u32, kind: u8, flags: u8) -> Vec<u8> {
    let mut bytes = len.to_le_bytes().to_vec();
    bytes.extend([kind, flags, 0, 0]);
    bytes
}

/// Random bytes from a fixed seed.
fn noise() -> impl Iterator<Item = Vec<u8>> {
    let mut random = fastrand::Rng::with_seed(1);
    (0..TIMES).map(move |_| (0..100).map(|_| random.u8(..)).collect())
}

/// Makes every attack on one port, which accepts connections with any of `purposes`.
fn attack(port: Port, purposes: &[Purpose]) {
    let hello = Hello::new("stranger", 7, purposes[0].clone());
    let bytes = to_bytes(FrameKind::Hello, &hello).expect("it fits");
    for noise in noise() {
        let stream = connect(port);
        let _ = (&stream).write_all(&noise);
        // Random bytes may contain a valid length. Then the process waits for the rest of the
        // frame, so end the stream.
        let _ = stream.shutdown(std::net::Shutdown::Write);
        rest(&stream);
    }
    is_closed(port, b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n");
    for kind in [0, 1, 4, 8, 255] {
        is_closed(port, &prefix(u32::MAX, kind, 0));
        is_closed(port, &prefix(1 << 26, kind, 0));
    }
    is_closed(port, &prefix(0, FrameKind::Beat as u8, 0));
    is_closed(port, &prefix(8, FrameKind::Hello as u8, 0x80));
    let mut wrong_magic = bytes.clone();
    wrong_magic[8] ^= 1;
    is_closed(port, &wrong_magic);
    is_refused(port, hello);
    for purpose in purposes {
        is_closed_after_welcome(port, purpose, &prefix(u32::MAX, 8, 0));
        is_closed_after_welcome(port, purpose, &prefix(0, 99, 0));
        let mut no_request = prefix(8, 8, 0);
        no_request.extend([0xff; 8]);
        is_closed_after_welcome(port, purpose, &no_request);
        let mut data = prefix(32, FrameKind::Data as u8, 0);
        data.extend([0; 32]);
        is_closed_after_welcome(port, purpose, &data);
        is_closed_after_welcome(port, purpose, &bytes);
    }
    for half in [4, 8, bytes.len() - 1] {
        let stream = connect(port);
        let _ = (&stream).write_all(&bytes[..half]);
    }
    is_too_slow(port, &bytes);
    are_closed(port, &bytes);
}

fn link_to(data: &str) -> Purpose {
    let link = LinkRequest {
        data: data.into(),
        instance: 0,
        schema: String::new(),
        schema_hash: 0,
        keep: Keep::Latest,
        wake: Wake::Sleep,
        paused: true,
        history: 1,
        memory: MemoryUse::Large,
        datagrams: true,
    };
    Purpose::Link { link }
}

/// Two probes, one of which sends to the other, in a folder of this name.
pub fn playing(folder: &str) -> System {
    let draft = Draft::default()
        .probe("source", "rate='200Hz'", "bulk=1000")
        .probe("sink", "", "")
        .link("source", "sink.a", "all")
        .mission(
            "<mission name='stay' goal='over' safe='over'>
              <place name='here' initial='true'/><place name='over'/>
              <transition name='late' from='here' to='over' timeout='1h'/>
            </mission>",
        );
    let system = draft.run(Folder::new(folder));
    system.traced("sink", "data", |trace| (trace.got("a").len() > 20).then_some(()));
    system
}

pub fn tcp(entry: &ComponentEntry) -> Port {
    Port::Tcp(entry.endpoint.parse().expect("an address"))
}

#[test]
fn strangers_are_closed_bounded_and_logged_once_on_every_port_while_data_flows() {
    let system = playing("strangers");
    let control = Purpose::Control { role: Role::Observer };
    let source = system.entry("source");
    let ports = [
        ("registry", Port::Tcp(system.registry), vec![Purpose::Registry { entry: None }]),
        ("configd", tcp(&system.entry("configd")), vec![Purpose::Config]),
        (
            "executive",
            tcp(&system.entry("executive")),
            vec![control.clone(), link_to("executive.marking")],
        ),
        ("source", tcp(&source), vec![control.clone(), link_to("source.numbers")]),
        ("source", Port::Local(source.instance), vec![control, link_to("source.numbers")]),
    ];
    let pids = ports.each_ref().map(|port| system.pid(port.0));
    let memory = || pids.map(|pid| proc_number(pid, "status", "VmRSS"));
    let before = memory();
    let flow = system.trace("sink").got("a").len();
    std::thread::scope(|scope| {
        for (_, port, purposes) in &ports {
            scope.spawn(|| attack(*port, purposes));
        }
    });
    let after = memory();
    assert_eq!(pids, ports.each_ref().map(|port| system.pid(port.0)), "no process was replaced");
    system
        .traced("sink", "data after it", |trace| (trace.got("a").len() > flow + 200).then_some(()));
    check_nothing_lost("the sink", &system.trace("sink").got("a"));
    assert_eq!(system.trace("sink").count("started"), 1);
    for (index, (name, ..)) in ports.iter().enumerate() {
        let log = system.folder.path().join(format!("out/logs/{name}.log"));
        let log = std::fs::read_to_string(log).expect("a log");
        let growth = after[index].saturating_sub(before[index]);
        println!(
            "{name}: {} -> {} KiB, {} lines",
            before[index],
            after[index],
            log.lines().count()
        );
        assert!(growth < MOST_GROWTH_KIB, "{name}: {growth} KiB more");
        assert!(log.lines().count() < MOST_LINES, "{name}:\n{log}");
        assert!(log.contains("closed"), "{name} logs it at least once:\n{log}");
    }
}
