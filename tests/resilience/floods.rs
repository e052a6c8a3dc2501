//! Floods of strangers of the same user at every port: idle connections, garbage, and slow handshakes. A
//! newcomer gets in, links continue, and memory comes back. `ARMOR_FULL=1` makes as many as
//! docs/reliability.md has, and prints the figures.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use armor_socket::Stream;
use armor_wire::control::Role;
use armor_wire::frame::{FrameKind, FrameReader, to_bytes};
use armor_wire::hello::{Hello, Purpose};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use super::hostile_bytes::{Port, connect, playing, tcp};
use super::system::{System, proc_number};
use super::trace::check_nothing_lost;
use crate::fixture::DEADLINE;

/// Most memory that the floods may leave to a process, in KiB.
const MOST_GROWTH_KIB: u64 = 20 << 10;

/// How many strangers there are.
struct Flood {
    idle: usize,
    garbage: usize,
    slow: usize,
}

impl Flood {
    fn chosen() -> Self {
        if std::env::var_os("ARMOR_FULL").is_some() {
            Self { idle: 2000, garbage: 10_000, slow: 500 }
        } else {
            Self { idle: 200, garbage: 300, slow: 20 }
        }
    }
}

/// A port, what a newcomer wants there, and the process behind it.
struct FloodedPort {
    name: &'static str,
    port: Port,
    purpose: Purpose,
    pid: i32,
}

impl FloodedPort {
    fn hello(&self) -> Vec<u8> {
        let hello = Hello::new("newcomer", 7, self.purpose.clone());
        to_bytes(FrameKind::Hello, &hello).expect("it fits")
    }

    /// Connects until it is welcomed; returns how long that took. One that comes while all places are
    /// taken may be closed, and comes again, as a component does.
    fn welcome_newcomer(&self) -> Duration {
        let start = Instant::now();
        while !is_welcome(&connect(self.port), &self.hello()) {
            assert!(start.elapsed() < DEADLINE, "{}: no newcomer gets in", self.name);
            std::thread::sleep(Duration::from_millis(10));
        }
        start.elapsed()
    }

    fn memory_kib(&self) -> u64 {
        proc_number(self.pid, "status", "VmRSS")
    }
}

fn is_welcome(mut stream: &Stream, hello: &[u8]) -> bool {
    if stream.write_all(hello).is_err() {
        return false;
    }
    let mut reader = FrameReader::new();
    loop {
        match reader.next_frame().map(|frame| frame.map(|frame| frame.kind)) {
            Ok(Some(kind)) => return kind == FrameKind::Welcome,
            Ok(None) => {}
            Err(_) => return false,
        }
        match stream.read(reader.space()) {
            Ok(len) if len > 0 => reader.filled(len),
            _ => return false,
        }
    }
}

/// Connections that send nothing, or half a hello, are there while newcomers come.
fn flood_idle(port: &FloodedPort, count: usize) -> Vec<Duration> {
    let hello = port.hello();
    let idle: Vec<_> = (0..count).map(|_| connect(port.port)).collect();
    for mut stream in idle.iter().skip(1).step_by(2) {
        let _ = stream.write_all(&hello[..hello.len() / 2]);
    }
    let newcomers = (0..10).map(|_| port.welcome_newcomer()).collect();
    drop(idle);
    newcomers
}

fn flood_garbage(port: &FloodedPort, count: usize) {
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..count {
        let bytes: Vec<u8> = (0..100).map(|_| random.u8(..)).collect();
        let _ = (&connect(port.port)).write_all(&bytes);
    }
}

/// Connections that send a byte now and then are closed; returns after how long the last one was.
fn flood_slow(port: &FloodedPort, count: usize) -> Duration {
    let hello = port.hello();
    let start = Instant::now();
    let mut slow: Vec<_> = (0..count).map(|_| connect(port.port)).collect();
    for stream in &slow {
        stream.set_read_timeout(Some(Duration::from_millis(1))).expect("a timeout");
    }
    for byte in hello.iter().cycle() {
        slow.retain(|mut stream| {
            let is_written = stream.write_all(&[*byte]).is_ok();
            is_written && !matches!(stream.read(&mut [0]), Ok(0))
        });
        if slow.is_empty() {
            break;
        }
        assert!(start.elapsed() < DEADLINE, "{}: {} are still open", port.name, slow.len());
        std::thread::sleep(Duration::from_millis(100));
    }
    start.elapsed()
}

fn longest_gap(system: &System) -> Duration {
    let got = system.trace("sink").got("a");
    let gaps = got.windows(2).map(|pair| pair[1].at_ns - pair[0].at_ns);
    Duration::from_nanos(gaps.max().unwrap_or_default())
}

#[test]
fn a_flood_of_strangers_keeps_no_newcomer_out_and_disturbs_no_link() {
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: limit.maximum, maximum: limit.maximum };
    setrlimit(Resource::Nofile, raised).expect("as many as are allowed");
    let flood = Flood::chosen();
    let system = playing("floods");
    let control = Purpose::Control { role: Role::Observer };
    let source = system.entry("source");
    let ports = [
        ("registry", Port::Tcp(system.registry), Purpose::Registry { entry: None }),
        ("configd", tcp(&system.entry("configd")), Purpose::Config),
        ("executive", tcp(&system.entry("executive")), control.clone()),
        ("source", tcp(&source), control.clone()),
        ("source", Port::Local(source.instance), control),
    ]
    .map(|(name, port, purpose)| FloodedPort { name, port, purpose, pid: system.pid(name) });
    println!("gap before the floods: {:?}", longest_gap(&system));
    for port in &ports {
        let before = port.memory_kib();
        let mut newcomers = flood_idle(port, flood.idle);
        let idle = port.memory_kib();
        flood_garbage(port, flood.garbage);
        let closed = flood_slow(port, flood.slow);
        let after = port.memory_kib();
        newcomers.sort();
        println!(
            "{} ({:?}): newcomers {:?} to {:?}; slow ones closed after {closed:?}; {before} KiB, \
             {idle} with the idle ones, {after} after",
            port.name,
            port.port,
            newcomers[0],
            newcomers[newcomers.len() - 1]
        );
        assert!(after.saturating_sub(before) < MOST_GROWTH_KIB, "{}: {before}, {after}", port.name);
        assert_eq!(port.pid, system.pid(port.name), "{} was replaced", port.name);
    }
    let flow = system.trace("sink").got("a").len();
    system
        .traced("sink", "data after it", |trace| (trace.got("a").len() > flow + 100).then_some(()));
    check_nothing_lost("the sink", &system.trace("sink").got("a"));
    println!("longest gap of the link: {:?}", longest_gap(&system));
}
