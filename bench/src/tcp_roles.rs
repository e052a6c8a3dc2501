//! The other side of the comparison: blocking TCP of `std::net`, one write for each message, its
//! length first. The least that a program without middleware would do.

use std::io::{ErrorKind, Read, Result as IoResult, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::readings::{
    MOST_ROUND_TRIPS, monotonic_ns, print_round_trips, publishing_time, watch_window,
};

const LEN_LEN: usize = 4;
/// Small messages are read many at a time.
const READ_LEN: usize = 64 << 10;

/// Plays a role until it is killed.
pub fn play_role(role: &str, arguments: &[String]) -> Result<()> {
    let number = |index: usize| -> Result<f64> {
        Ok(arguments.get(index).context("an argument is missing")?.parse()?)
    };
    let whole = |index: usize| number(index).map(|number| number as usize);
    let window =
        |index: usize| Ok::<_, anyhow::Error>(Duration::try_from_secs_f64(number(index)?)?);
    match role {
        "echo" => play_echo(whole(0)?, whole(1)? != 0),
        "ping" => play_ping(whole(0)?, whole(1)? != 0, whole(2)?, window(3)?),
        "flood" => play_flood(whole(0)?, whole(1)?, window(2)?, number(3)?),
        "sink" => play_sink(whole(0)?, whole(1)?, window(2)?),
        "tick" => play_tick(window(0)?),
        "first" => play_first(whole(0)?),
        _ => bail!("there is no role `{role}`"),
    }
}

/// A stream that sleeps until it is ready, or polls.
struct SpinningStream {
    socket: TcpStream,
}

impl SpinningStream {
    fn new(socket: TcpStream, spin: bool) -> IoResult<Self> {
        socket.set_nodelay(true)?;
        socket.set_nonblocking(spin)?;
        Ok(Self { socket })
    }

    fn connect(port: usize, spin: bool) -> Result<Self> {
        let socket = TcpStream::connect(("127.0.0.1", u16::try_from(port)?))?;
        Ok(Self::new(socket, spin)?)
    }
}

fn poll_until_ready<T>(mut attempt: impl FnMut() -> IoResult<T>) -> IoResult<T> {
    loop {
        match attempt() {
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::hint::spin_loop(),
            result => return result,
        }
    }
}

impl Read for SpinningStream {
    fn read(&mut self, bytes: &mut [u8]) -> IoResult<usize> {
        poll_until_ready(|| self.socket.read(bytes))
    }
}

impl Write for SpinningStream {
    fn write(&mut self, bytes: &[u8]) -> IoResult<usize> {
        poll_until_ready(|| self.socket.write(bytes))
    }

    fn flush(&mut self) -> IoResult<()> {
        Ok(())
    }
}

fn encode_message(len: usize) -> Result<Vec<u8>> {
    let mut bytes = u32::try_from(len)?.to_le_bytes().to_vec();
    bytes.resize(LEN_LEN + len, 0x5a);
    Ok(bytes)
}

fn listen_and_print() -> Result<TcpListener> {
    let listener = TcpListener::bind(("127.0.0.1", 0))?;
    println!("listening port={}", listener.local_addr()?.port());
    Ok(listener)
}

fn play_echo(len: usize, spin: bool) -> Result<()> {
    let mut stream = SpinningStream::new(listen_and_print()?.accept()?.0, spin)?;
    let mut bytes = encode_message(len)?;
    while stream.read_exact(&mut bytes).is_ok() {
        stream.write_all(&bytes)?;
    }
    Ok(())
}

fn play_ping(port: usize, spin: bool, len: usize, window: Duration) -> Result<()> {
    let mut stream = SpinningStream::connect(port, spin)?;
    let (ping, mut pong) = (encode_message(len)?, encode_message(len)?);
    let mut times_ns = Vec::with_capacity(MOST_ROUND_TRIPS);
    for window in [window.mul_f64(0.15), window] {
        times_ns.clear();
        let start = Instant::now();
        loop {
            let sent = Instant::now();
            stream.write_all(&ping)?;
            stream.read_exact(&mut pong)?;
            let now = Instant::now();
            times_ns.push((now - sent).as_nanos() as u64);
            if now - start >= window || times_ns.len() >= MOST_ROUND_TRIPS {
                break;
            }
        }
    }
    print_round_trips(&mut times_ns);
    Ok(())
}

/// Publishes to every subscriber; at a rate, or as fast as they take it (rate 0).
fn play_flood(len: usize, subscribers: usize, window: Duration, rate_hz: f64) -> Result<()> {
    let listener = listen_and_print()?;
    let mut streams = Vec::new();
    for _ in 0..subscribers {
        streams.push(SpinningStream::new(listener.accept()?.0, false)?);
    }
    let bytes = encode_message(len)?;
    let count = watch_window(window);
    let start = Instant::now();
    let mut sent = 0_u64;
    while start.elapsed() < publishing_time(window) {
        // Looking at the clock for every small message would cost what it should measure.
        for _ in 0..if len > 4096 || rate_hz > 0.0 { 1 } else { 16 } {
            if rate_hz > 0.0 {
                let due = start + Duration::from_secs_f64(sent as f64 / rate_hz);
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
            }
            for stream in &mut streams {
                stream.write_all(&bytes)?;
            }
            sent += 1;
            count.store(sent, Ordering::Relaxed);
        }
    }
    println!("published count={sent}");
    drop(streams);
    wait_forever()
}

fn play_sink(port: usize, len: usize, window: Duration) -> Result<()> {
    let stream = SpinningStream::connect(port, false)?;
    let (mut count, mut received) = (None, 0_u64);
    read_messages(stream, |message| {
        assert_eq!(message.len(), len, "a message of another length");
        received += 1;
        count.get_or_insert_with(|| watch_window(window)).store(received, Ordering::Relaxed);
    })?;
    println!("received count={received} lost=0");
    wait_forever()
}

fn play_tick(period: Duration) -> Result<()> {
    let listener = listen_and_print()?;
    let mut stream = SpinningStream::new(listener.accept()?.0, false)?;
    let bytes = encode_message(100)?;
    loop {
        stream.write_all(&bytes)?;
        std::thread::sleep(period);
    }
}

/// Prints the time of the first message and continues to receive on a thread of its own, like a
/// program that has something else to do.
fn play_first(port: usize) -> Result<()> {
    let stream = SpinningStream::connect(port, false)?;
    let mut has_printed = false;
    std::thread::spawn(move || {
        read_messages(stream, |_| {
            if !std::mem::replace(&mut has_printed, true) {
                println!("first at_ns={}", monotonic_ns());
            }
        })
    });
    wait_forever()
}

fn wait_forever() -> ! {
    loop {
        std::thread::park();
    }
}

/// Reads small messages many at a time into one buffer; the rest of a large one goes straight to
/// its own.
fn read_messages(mut stream: SpinningStream, mut on_message: impl FnMut(&[u8])) -> Result<()> {
    let mut buffer = vec![0; READ_LEN];
    let mut large = Vec::new();
    let (mut start, mut end) = (0, 0);
    loop {
        while let Some(len) = buffer[start..end].first_chunk::<LEN_LEN>() {
            let len = u32::from_le_bytes(*len) as usize;
            let body = start + LEN_LEN;
            if let Some(message) = buffer[body..end].get(..len) {
                on_message(message);
                start = body + len;
            } else if LEN_LEN + len > READ_LEN {
                let have = end - body;
                large.resize(len, 0);
                large[..have].copy_from_slice(&buffer[body..end]);
                stream.read_exact(&mut large[have..])?;
                on_message(&large);
                (start, end) = (0, 0);
            } else {
                break;
            }
        }
        buffer.copy_within(start..end, 0);
        (start, end) = (0, end - start);
        match stream.read(&mut buffer[end..])? {
            0 => return Ok(()),
            len => end += len,
        }
    }
}
