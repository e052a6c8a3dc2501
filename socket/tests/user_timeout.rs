//! `TCP_USER_TIMEOUT`: a connection ends when what was sent stays unacknowledged, in a network namespace
//! whose one interface goes down. Without the option the kernel repeats it for a quarter of an hour.

#![allow(clippy::expect_used, clippy::panic, reason = "all of it is a test")]

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

use armor_socket::{Stream, tune, tune_between_hosts};

/// Set in the process in the namespace.
const VARIABLE: &str = "ARMOR_TEST_NAMESPACE";
const NAME: &str = "a_connection_ends_when_its_bytes_stay_unacknowledged";
/// Only a connection that never ends exceeds it.
const DEADLINE: Duration = Duration::from_secs(60);

#[test]
fn a_connection_ends_when_its_bytes_stay_unacknowledged() {
    if std::env::var_os(VARIABLE).is_some() {
        return cut_connections();
    }
    let namespace = ["--user", "--map-root-user", "--net"];
    let can_make = |options: &[&str]| {
        let mut command = Command::new("unshare");
        let command = command.args(options).args(["ip", "link", "set", "lo", "up"]);
        let tried = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
        tried.is_ok_and(|status| status.success())
    };
    let Some(options) = [&namespace[2..], &namespace[..]].into_iter().find(|it| can_make(it))
    else {
        println!("no network namespace can be made here");
        return;
    };
    let mut command = Command::new("unshare");
    let own = std::env::current_exe().expect("it has a path");
    let command = command.args(options).arg(own).args(["--exact", NAME, "--nocapture"]);
    assert!(command.env(VARIABLE, "1").status().expect("it runs").success());
}

fn set_link(state: &str) {
    let status = Command::new("ip").args(["link", "set", "lo", state]).status();
    assert!(status.expect("ip runs").success());
}

/// A connection whose other end is kept open.
fn connect() -> (Stream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let stream = TcpStream::connect(listener.local_addr().expect("it listens"));
    let (other, _) = listener.accept().expect("it has connected");
    (Stream::Tcp(stream.expect("it listens")), other)
}

fn cut_connections() {
    set_link("up");
    let connections = [connect(), connect(), connect()];
    let [(within, _), (between, _), (plain, _)] = &connections;
    tune(within).expect("it is tuned");
    tune_between_hosts(between).expect("it is tuned");
    set_link("down");
    for stream in [within, between, plain] {
        let Stream::Tcp(mut stream) = stream.try_clone().expect("a descriptor") else { continue };
        stream.set_read_timeout(Some(DEADLINE)).expect("it is set");
        stream.write_all(b"beat").expect("the kernel keeps it");
    }
    let end_of = |stream: &Stream| {
        let Stream::Tcp(stream) = stream else { panic!("it is TCP") };
        let mut stream: &TcpStream = stream;
        stream.read(&mut [0]).map_err(|error| error.kind())
    };
    for stream in [between, within] {
        let end = end_of(stream).expect_err("the cut ends it");
        assert_ne!(end, ErrorKind::WouldBlock, "it has not ended");
    }
    let Stream::Tcp(plain) = plain else { return };
    plain.set_nonblocking(true).expect("it is set");
    let open = (&mut &*plain).read(&mut [0]).map_err(|error| error.kind());
    assert_eq!(open, Err(ErrorKind::WouldBlock), "the kernel repeats it for much longer");
}
