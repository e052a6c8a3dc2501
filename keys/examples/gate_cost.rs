//! What a connection through a gate costs, compared with one on loopback, and with one through two
//! proxies without TLS: round trips of 100 bytes and of 1 MiB, bytes per second in one direction, the
//! processor time that all ends take for these bytes, that of the end which takes the most, and the time
//! to connect. Tool, proxy, gate and
//! process are on one host, each in a thread of its own.
//!
//! `cargo run --release -p armor-keys --example gate_cost`, with the `GLIBC_TUNABLES` that `armor gate`
//! sets for itself: docs/performance.md.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use armor_keys::connect::GateClient;
use armor_keys::gate::{GateLimits, GateOptions, serve};
use armor_keys::reach::SystemReach;
use armor_keys::{HostKeys, KeyHolder, KeysFolder};
use armor_wire::frame::{self, FrameKind, PREFIX_LEN};

type Failure = Box<dyn std::error::Error>;

const MESSAGE_LEN: usize = 100;
const ROUND_TRIPS: usize = 20_000;
const LARGE_LEN: usize = 1 << 20;
const LARGE_ROUND_TRIPS: usize = 200;
const CONNECTIONS: usize = 200;
const BULK_LEN: usize = 512 << 20;
const PIECE_LEN: usize = 64 << 10;
/// Switches the process from echoing to swallowing.
const BULK: u8 = 0xff;

fn main() -> Result<(), Failure> {
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
    let gate = start_gate(&path, process)?;
    let proxy = start_proxy(gate, &key)?;
    let plain = start_forwarder(start_forwarder(process)?)?;
    println!("                        loopback   proxies      gate  gate / proxies");
    let direct = || -> Result<_, Failure> { Ok(TcpStream::connect(process)?) };
    let forwarded = || -> Result<_, Failure> { Ok(TcpStream::connect(plain)?) };
    let through = || connect_through(proxy, process);
    let transfers = [transfer(direct()?)?, transfer(forwarded()?)?, transfer(through()?)?];
    let rows: [(&str, [f64; 3]); 6] = [
        (
            "round trip 100 B, us",
            [round_trip_us(direct()?)?, round_trip_us(forwarded()?)?, round_trip_us(through()?)?],
        ),
        (
            "round trip 1 MiB, us",
            [
                large_round_trip_us(direct()?)?,
                large_round_trip_us(forwarded()?)?,
                large_round_trip_us(through()?)?,
            ],
        ),
        ("MB/s in one direction", transfers.map(|it| it.megabytes_per_s)),
        ("processor s for 1 GB", transfers.map(|it| it.processor_s_per_gb)),
        ("of the busiest end", transfers.map(|it| it.busiest_s_per_gb)),
        (
            "connecting, us",
            [connecting_us(direct)?, connecting_us(forwarded)?, connecting_us(through)?],
        ),
    ];
    for (name, [loopback, proxies, gate]) in rows {
        println!("{name:22} {loopback:9.1} {proxies:9.1} {gate:9.1} {:9.2}", gate / proxies);
    }
    Ok(())
}

/// A process of the system: acknowledges a preface if there is one, then echoes messages, or
/// swallows what follows the byte for bulk data. The gate takes its address for that of the registry.
fn start_process() -> Result<SocketAddr, Failure> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            thread::spawn(move || serve_connection(stream));
        }
    });
    Ok(address)
}

fn serve_connection(mut stream: TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let mut bytes = vec![0; PIECE_LEN];
    loop {
        let len = stream.read(&mut bytes)?;
        if len == 0 {
            return Ok(());
        }
        if bytes[..len].get(4) == Some(&(FrameKind::Preface as u8)) && len < MESSAGE_LEN {
            stream.write_all(&frame::signal(FrameKind::Beat))?;
        } else if bytes[0] == BULK {
            let mut left = BULK_LEN - len;
            while left > 0 {
                left -= stream.read(&mut bytes)?.min(left);
            }
            stream.write_all(&[BULK])?;
        } else {
            stream.write_all(&bytes[..len])?;
        }
    }
}

/// A proxy without TLS.
fn start_forwarder(target: SocketAddr) -> Result<SocketAddr, Failure> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    thread::spawn(move || -> Result<(), std::io::Error> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            loop {
                let (mut near, _) = listener.accept().await?;
                tokio::spawn(async move {
                    let mut far = tokio::net::TcpStream::connect(target).await?;
                    near.set_nodelay(true)?;
                    far.set_nodelay(true)?;
                    let copy = tokio::io::copy_bidirectional_with_sizes;
                    copy(&mut near, &mut far, PIECE_LEN / 2, PIECE_LEN / 2).await
                });
            }
        })
    });
    Ok(address)
}

fn start_gate(keys: &Path, registry: SocketAddr) -> Result<SocketAddr, Failure> {
    let (sender, ready) = channel();
    let (listen, keys) = (([127, 0, 0, 1], 0).into(), HostKeys::read(keys)?);
    let reach = Arc::new(SystemReach::new(registry, keys.host_name()));
    let options = GateOptions {
        listen,
        keys,
        reach,
        runs: None,
        examiner: Arc::new(Vec::new),
        limits: GateLimits::default(),
    };
    thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let ended = runtime.map(|it| {
            it.block_on(serve(options, |address| sender.send(address).unwrap_or_default()))
        });
        println!("the gate has ended: {:?}", ended.map(|ended| ended.err()));
    });
    Ok(ready.recv_timeout(Duration::from_secs(5))?)
}

fn start_proxy(gate: SocketAddr, key: &Path) -> Result<SocketAddr, Failure> {
    let client = Arc::new(GateClient::new(&gate.to_string(), key)?);
    let listener = TcpListener::bind("127.0.0.1:0")?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    thread::spawn(move || -> Result<(), std::io::Error> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            client.serve_tools(listener, |notice| println!("{notice:?}")).await;
            Ok(())
        })
    });
    Ok(address)
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

/// The median of the round trips of one message.
fn round_trip_us(mut stream: TcpStream) -> Result<f64, Failure> {
    stream.set_nodelay(true)?;
    // Its fifth byte is no frame's kind.
    let message = [0; MESSAGE_LEN];
    let mut answer = [0; MESSAGE_LEN];
    let mut times = Vec::with_capacity(ROUND_TRIPS);
    for _ in 0..ROUND_TRIPS {
        let start = Instant::now();
        stream.write_all(&message)?;
        stream.read_exact(&mut answer)?;
        times.push(start.elapsed());
    }
    Ok(median_us(times))
}

/// The median of the round trips of a large message, which begins to come back before all of it is sent.
fn large_round_trip_us(mut stream: TcpStream) -> Result<f64, Failure> {
    stream.set_nodelay(true)?;
    let mut writing = stream.try_clone()?;
    let (begin, begins) = channel::<()>();
    let writer = thread::spawn(move || -> std::io::Result<()> {
        let message = vec![0; LARGE_LEN];
        for () in begins {
            writing.write_all(&message)?;
        }
        Ok(())
    });
    let mut answer = vec![0; LARGE_LEN];
    let mut times = Vec::with_capacity(LARGE_ROUND_TRIPS);
    for _ in 0..LARGE_ROUND_TRIPS {
        let start = Instant::now();
        begin.send(())?;
        stream.read_exact(&mut answer)?;
        times.push(start.elapsed());
    }
    drop(begin);
    writer.join().map_err(|_| "the writer has panicked")??;
    Ok(median_us(times))
}

/// What many bytes in one direction take.
#[derive(Clone, Copy)]
struct Transfer {
    megabytes_per_s: f64,
    /// Of all ends together. Other programs change it less than the time that passes.
    processor_s_per_gb: f64,
    /// Of the end that takes the most. Where each end has a core, this one limits the rate.
    busiest_s_per_gb: f64,
}

fn transfer(mut stream: TcpStream) -> Result<Transfer, Failure> {
    let piece = [BULK; PIECE_LEN];
    let (start, before) = (Instant::now(), read_processor_s()?);
    for _ in 0..BULK_LEN / PIECE_LEN {
        stream.write_all(&piece)?;
    }
    stream.read_exact(&mut [0])?;
    let seconds = start.elapsed().as_secs_f64();
    let after = read_processor_s()?;
    let spent = after.iter().map(|(thread, s)| s - before.get(thread).copied().unwrap_or_default());
    let spent: Vec<f64> = spent.collect();
    let gigabytes = BULK_LEN as f64 / 1e9;
    Ok(Transfer {
        megabytes_per_s: 1e3 * gigabytes / seconds,
        processor_s_per_gb: spent.iter().sum::<f64>() / gigabytes,
        busiest_s_per_gb: spent.iter().copied().fold(0.0, f64::max) / gigabytes,
    })
}

/// The processor time of each thread of this process, in seconds.
fn read_processor_s() -> Result<BTreeMap<OsString, f64>, Failure> {
    let mut threads = BTreeMap::new();
    for thread in std::fs::read_dir("/proc/self/task")? {
        let thread = thread?;
        // The first number of three is the time on a processor, in nanoseconds.
        // A thread may end in between.
        let Ok(text) = std::fs::read_to_string(thread.path().join("schedstat")) else { continue };
        let ran_ns: f64 = text.split_whitespace().next().ok_or("it has another form")?.parse()?;
        threads.insert(thread.file_name(), ran_ns / 1e9);
    }
    Ok(threads)
}

fn connecting_us(connect: impl Fn() -> Result<TcpStream, Failure>) -> Result<f64, Failure> {
    let mut times = Vec::new();
    for _ in 0..CONNECTIONS {
        let start = Instant::now();
        drop(connect()?);
        times.push(start.elapsed());
    }
    Ok(median_us(times))
}

fn median_us(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e6
}

const _: () = assert!(PREFIX_LEN < MESSAGE_LEN, "a preface is recognized by its length");
