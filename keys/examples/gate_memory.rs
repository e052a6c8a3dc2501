//! What the connections through a gate take of the memory of both ends: of the gate, and of the proxy
//! that connects to it. Both are processes of their own, with 10 to 200 connections; the figure is the
//! slope of the memory that belongs to the process alone.
//!
//! `cargo run --release -p armor-keys --example gate_memory`

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use armor_keys::connect::GateClient;
use armor_keys::gate::{GateLimits, GateOptions, serve};
use armor_keys::reach::SystemReach;
use armor_keys::{HostKeys, KeyHolder, KeysFolder};
use armor_wire::frame::{self, FrameKind};

type Failure = Box<dyn std::error::Error>;

const MESSAGE_LEN: usize = 100;
const BULK_LEN: usize = 1 << 20;
const PIECE_LEN: usize = 64 << 10;
/// Connections at which the memory is read.
/// What the first ones cost belongs to none.
const COUNTS: [usize; 5] = [10, 50, 100, 150, 200];
/// Until the memory does not change any more.
const SETTLES_AFTER: Duration = Duration::from_millis(500);

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["gate", keys, process] => serve_gate(Path::new(keys), process.parse()?),
        ["proxy", key, gate] => serve_proxy(Path::new(key), gate),
        _ => measure(),
    }
}

fn measure() -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("keys");
    let now_s = i64::try_from(std::time::UNIX_EPOCH.elapsed()?.as_secs())?;
    let keys = KeysFolder::create(&path, now_s)?;
    let make = |name: &str, role: &str| -> Result<_, Failure> {
        let holder = KeyHolder { name: name.into(), purpose: role.parse()? };
        Ok(keys.add_key(holder, 1, now_s)?.path)
    };
    make("robot", "host")?;
    let key = make("alice", "observer")?;
    let process = start_process()?;
    let own = |words: &[&str]| OwnProcess::start(words);
    println!("KiB a connection         gate     proxy");
    for (name, len) in [("after 100 B each way", MESSAGE_LEN), ("after 1 MiB each way", BULK_LEN)] {
        // A process keeps the memory of connections that have ended for the next ones.
        let gate = own(&["gate", &path.to_string_lossy(), &process.to_string()])?;
        let proxy = own(&["proxy", &key.to_string_lossy(), &gate.address.to_string()])?;
        let mut readings = [const { Vec::new() }; 2];
        let mut open = Vec::new();
        for count in COUNTS {
            open.extend(open_connections(proxy.address, process, len, count - open.len())?);
            thread::sleep(SETTLES_AFTER);
            for (readings, process) in readings.iter_mut().zip([&gate, &proxy]) {
                readings.push((count as f64, process.read_memory_kib()?));
            }
        }
        let [gate, proxy] = readings.map(|readings| find_slope(&readings));
        println!("{name:20} {gate:9.1} {proxy:9.1}");
    }
    Ok(())
}

/// This program in another role; it prints where it listens.
struct OwnProcess {
    child: Child,
    address: SocketAddr,
}

impl OwnProcess {
    fn start(words: &[&str]) -> Result<Self, Failure> {
        let mut command = Command::new(std::env::current_exe()?);
        let mut child = command.args(words).stdout(Stdio::piped()).spawn()?;
        let mut line = String::new();
        BufReader::new(child.stdout.take().ok_or("no pipe")?).read_line(&mut line)?;
        Ok(Self { child, address: line.trim().parse()? })
    }

    fn read_memory_kib(&self) -> Result<f64, Failure> {
        let text = std::fs::read_to_string(format!("/proc/{}/smaps_rollup", self.child.id()))?;
        let line = text.lines().find_map(|line| line.strip_prefix("Anonymous:"));
        let number = line.and_then(|line| line.split_whitespace().next()).ok_or("no such line")?;
        Ok(number.parse()?)
    }
}

impl Drop for OwnProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn find_slope(readings: &[(f64, f64)]) -> f64 {
    let count = readings.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| readings.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|it| it.0), mean(|it| it.1));
    let above: f64 = readings.iter().map(|it| (it.0 - x) * (it.1 - y)).sum();
    above / readings.iter().map(|it| (it.0 - x).powi(2)).sum::<f64>()
}

/// Opens connections, each of which has carried `len` bytes in both directions.
fn open_connections(
    proxy: SocketAddr,
    process: SocketAddr,
    len: usize,
    count: usize,
) -> Result<Vec<TcpStream>, Failure> {
    (0..count).map(|_| exchange_bytes(connect_through(proxy, process)?, len)).collect()
}

fn exchange_bytes(stream: TcpStream, len: usize) -> Result<TcpStream, Failure> {
    let mut writing = stream.try_clone()?;
    // No frame's kind in the fifth byte, so that it is no preface.
    let writer = thread::spawn(move || writing.write_all(&vec![0; len]));
    (&stream).read_exact(&mut vec![0; len])?;
    writer.join().map_err(|_| "the writer has panicked")??;
    Ok(stream)
}

/// A process of the system: acknowledges a preface, then echoes.
fn start_process() -> Result<SocketAddr, Failure> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            thread::spawn(move || echo(stream));
        }
    });
    Ok(address)
}

fn echo(mut stream: TcpStream) -> std::io::Result<()> {
    let mut bytes = vec![0; PIECE_LEN];
    loop {
        match stream.read(&mut bytes)? {
            0 => return Ok(()),
            len if len > 4 && bytes[4] == FrameKind::Preface as u8 => {
                stream.write_all(&frame::signal(FrameKind::Beat))?;
            }
            len => stream.write_all(&bytes[..len])?,
        }
    }
}

fn serve_gate(keys: &Path, process: SocketAddr) -> Result<(), Failure> {
    let keys = HostKeys::read(keys)?;
    // The gate takes the process for the registry.
    let reach = Arc::new(SystemReach::new(process, keys.host_name()));
    let limits = GateLimits::of_hosts();
    let limits = GateLimits { sessions_per_name: 1000, sessions_per_process: 1000, ..limits };
    let (listen, examiner) = (([127, 0, 0, 1], 0).into(), Arc::new(Vec::new));
    let options = GateOptions { listen, keys, reach, runs: None, examiner, limits };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(serve(options, |address| println!("{address}")))?;
    Ok(())
}

fn serve_proxy(key: &Path, gate: &str) -> Result<(), Failure> {
    let client = Arc::new(GateClient::new(gate, key)?);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
        println!("{}", listener.local_addr()?);
        client.serve_tools(listener, |notice| eprintln!("{notice:?}")).await;
        Ok(())
    })
}

fn connect_through(proxy: SocketAddr, process: SocketAddr) -> Result<TcpStream, Failure> {
    let mut stream = TcpStream::connect(proxy)?;
    stream.set_nodelay(true)?;
    let mut request = b"\x05\x01\x00\x05\x01\x00\x01\x7f\x00\x00\x01".to_vec();
    request.extend(process.port().to_be_bytes());
    stream.write_all(&request)?;
    let mut answer = [0; 12];
    stream.read_exact(&mut answer)?;
    if answer[3] == 0 { Ok(stream) } else { Err("the gate refuses it".into()) }
}
