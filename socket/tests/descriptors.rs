//! Without free descriptors a daemon pauses and then continues. A test process of its own, because
//! it takes all descriptors.

#![allow(clippy::unwrap_used, reason = "all of it is a test")]

use std::fs::File;
use std::io::Write;
use std::net::TcpStream;
use std::time::Duration;

use armor_socket::{Server, ServerLimits, listen};
use armor_wire::frame::{self, FrameKind};
use armor_wire::hello::{Hello, Purpose};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

const DEADLINE: Duration = Duration::from_secs(20);

#[test]
fn a_client_that_connects_without_free_descriptors_is_served_once_there_are_some() {
    let limit = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: Some(64), ..limit }).unwrap();
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    runtime.enable_all().build().unwrap().block_on(async {
        let listener = listen(([127, 0, 0, 1], 0).into()).unwrap();
        let address = listener.local_addr().unwrap();
        let mut hoard = Vec::new();
        while let Ok(file) = File::open("/dev/null") {
            hoard.push(file);
        }
        // One for the client's end; there is none for the server's.
        hoard.pop();
        let mut client = TcpStream::connect(address).unwrap();
        assert!(File::open("/dev/null").is_err());
        let hello = Hello::new("test", 1, Purpose::Registry { entry: None });
        let bytes = frame::to_bytes(FrameKind::Hello, &hello).unwrap();
        client.write_all(&bytes).unwrap();

        let mut server = Server::<u64, u64>::new(listener, ServerLimits::default()).unwrap();
        let while_out = tokio::time::timeout(Duration::from_millis(500), server.next_event()).await;
        assert!(while_out.is_err(), "no connection can have been accepted");
        drop(hoard);
        let event = tokio::time::timeout(DEADLINE, server.next_event()).await.unwrap();
        assert!(matches!(event, armor_wire::peer::PeerEvent::Connected { .. }), "{event:?}");
    });
}
