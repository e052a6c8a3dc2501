//! Garbage on the registry's port: each kind is closed, and a good client notices nothing.

use std::io::Write;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use armor_wire::codec::MAX_HELLO_LEN;
use armor_wire::frame::{FrameKind, signal, to_bytes};
use armor_wire::hello::{Hello, Purpose, RefusalCode, VERSION};

use super::*;

/// A registered client that asks all the time and must always be answered.
struct Good {
    stop: mpsc::Sender<()>,
    thread: JoinHandle<Client>,
}

impl Good {
    fn start(address: SocketAddr) -> Self {
        let mut client = Client::register(address, &entry("good", 1)).unwrap();
        let (stop, stopped) = mpsc::channel();
        let thread = thread::spawn(move || {
            for request in 0.. {
                client.send(&RegistryRequest::List { request });
                assert!(
                    matches!(client.reply(), RegistryReply::Listing { request: r, .. } if r == request)
                );
                if stopped.recv_timeout(Duration::from_millis(20)) != Err(RecvTimeoutError::Timeout)
                {
                    break;
                }
            }
            client
        });
        Self { stop, thread }
    }

    /// Its connection is the one it began with.
    fn finish(self) {
        self.stop.send(()).unwrap();
        self.thread.join().unwrap();
    }
}

fn hello() -> Vec<u8> {
    let purpose = Purpose::Registry { entry: None };
    to_bytes(FrameKind::Hello, &Hello::new("test", 1, purpose)).unwrap()
}

fn with_length(mut frame: Vec<u8>, len: usize) -> Vec<u8> {
    frame[..4].copy_from_slice(&u32::try_from(len).unwrap().to_le_bytes());
    frame
}

#[test]
fn garbage_is_closed_and_a_good_client_is_unaffected() {
    let (_registry, address) = registry();
    let good = Good::start(address);
    let other_magic = {
        let mut frame = hello();
        frame[8] = b'X';
        frame
    };
    let data = [with_length(signal(FrameKind::Data).to_vec(), 60_000), vec![0; 60_000]].concat();
    let cases = [
        ("http", b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n".to_vec()),
        ("noise", (0..5000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 13) as u8).collect()),
        ("giant length", with_length(hello(), u32::MAX as usize)),
        ("one too long", with_length(hello(), MAX_HELLO_LEN + 1)),
        ("other magic", other_magic),
        ("a beat first", signal(FrameKind::Beat).to_vec()),
        ("no hello at all", Vec::new()),
        ("half a prefix", hello()[..5].to_vec()),
        ("half a hello", hello()[..20].to_vec()),
        ("a hello with a lying length inside", {
            let mut frame = hello();
            frame[14..22].copy_from_slice(&u64::MAX.to_le_bytes());
            frame
        }),
        ("a second hello", [hello(), hello()].concat()),
        ("data", [hello(), data].concat()),
        ("half a request", [hello(), with_length(signal(FrameKind::Control).to_vec(), 9)].concat()),
        (
            "a malformed request",
            [hello(), to_bytes(FrameKind::Control, &u64::MAX).unwrap()].concat(),
        ),
        ("silence after the hello", hello()),
    ];
    let clients = cases.map(|(name, bytes)| {
        let mut client = Client::stranger(address);
        // Who is closed early may not get all of it written.
        let _ = client.write(&bytes);
        (name, client)
    });
    for (name, client) in clients {
        println!("{name}");
        client.expect_closed();
    }
    good.finish();
}

#[test]
fn a_byte_now_and_then_keeps_no_connection() {
    let (_registry, address) = registry();
    for start in [Vec::new(), hello()] {
        let mut slow = Client::stranger(address);
        slow.write(&start).unwrap();
        let writing = Arc::clone(&slow.stream);
        let (stop, stopped) = mpsc::channel::<()>();
        let dribble = thread::spawn(move || {
            let request = with_length(signal(FrameKind::Hello).to_vec(), MAX_HELLO_LEN);
            for byte in request.into_iter().chain(std::iter::repeat(0)) {
                let pace = stopped.recv_timeout(Duration::from_millis(50));
                if pace != Err(RecvTimeoutError::Timeout) || (&*writing).write_all(&[byte]).is_err()
                {
                    break;
                }
            }
        });
        slow.expect_closed();
        drop(stop);
        dribble.join().unwrap();
    }
}

#[test]
fn another_version_is_refused() {
    let (_registry, address) = registry();
    let mut client = Client::stranger(address);
    let purpose = Purpose::Registry { entry: None };
    let hello = Hello { version: VERSION + 1, ..Hello::new("test", 1, purpose) };
    client.send_frame(FrameKind::Hello, &hello);
    let error = client.answer().err().unwrap();
    let HandshakeError::Refused(refusal) = error else { panic!("{error}") };
    assert_eq!(refusal.code, RefusalCode::Version);
    client.expect_closed();
}

#[test]
fn a_client_that_asks_and_never_reads_is_closed() {
    let (_registry, address) = registry();
    let good = Good::start(address);
    let mut deaf = Client::stranger(address);
    deaf.write(&hello()).unwrap();
    // Each answer is longer than its question: sooner or later writing fails.
    let question =
        to_bytes(FrameKind::Control, &RegistryRequest::List { request: 1 }).unwrap().repeat(1000);
    let mut written = 0_usize;
    while deaf.write(&question).is_ok() {
        written += question.len();
        assert!(written < 1 << 30, "nothing stops it");
    }
    good.finish();
}

#[test]
fn one_connection_too_many_is_turned_away() {
    let registry = registry_with(ServerLimits { connections: 2, ..ServerLimits::default() });
    let mut first = Client::observe(registry.address()).unwrap();
    first.send(&RegistryRequest::Watch);
    let second = Client::register(registry.address(), &entry("lidar", 1)).unwrap();
    let mut third = Client::stranger(registry.address());
    let error = third.answer().err().unwrap();
    let HandshakeError::Refused(refusal) = error else { panic!("{error}") };
    assert_eq!(refusal.code, RefusalCode::Limit);
    drop(second);
    while !matches!(first.reply(), RegistryReply::Gone { .. }) {}
    Client::observe(registry.address()).unwrap();
}
