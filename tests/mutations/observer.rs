//! The configuration of a running system: the state that configd publishes, and its answers.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use armor_sdk::directory::Directory;
use armor_sdk::tap::Tap;
use armor_wire::codec;
use armor_wire::config::{ConfigReply, ConfigRequest, ConfigurationState, ListedParameter};
use armor_wire::frame::{self, FrameKind, FrameReader};
use armor_wire::hello::{self, Hello, Purpose};
use armor_wire::keep::Keep;

use crate::fixture::{DEADLINE, Run, wait_for};

/// Observes one run.
pub struct Observer {
    directory: Directory,
    states: Receiver<(Instant, ConfigurationState)>,
    configd: SocketAddr,
}

impl Observer {
    /// Waits for configd and subscribes to the state that it publishes.
    pub fn of(run: &Run) -> Self {
        let directory = Directory::observer(&run.registry().to_string(), "observer");
        let configd = wait_for("configd", || {
            let all = directory.fetch_listing(Duration::from_secs(2)).ok()?.components;
            all.into_iter().find(|entry| entry.name == "configd")?.endpoint.parse().ok()
        });
        let (sender, states) = channel();
        let mut tap = Tap::open(&directory, "configuration.state", Keep::ALL, DEADLINE)
            .expect("the state is published");
        std::thread::spawn(move || {
            while let Ok(data) = tap.next(Duration::from_secs(1)) {
                let now = Instant::now();
                let Some(data) = data else { continue };
                assert_eq!(data.lost, 0, "states were lost");
                let state = codec::decode(&data.payload).expect("as its schema states");
                if sender.send((now, state)).is_err() {
                    return;
                }
            }
        });
        Self { directory, states, configd }
    }

    /// Returns the next state and the time at which it arrived.
    pub fn state(&self, within: Duration) -> Option<(Instant, ConfigurationState)> {
        self.states.recv_timeout(within).ok()
    }

    /// Returns the components and their process ids.
    pub fn processes(&self) -> Vec<(String, u32)> {
        let all = self.directory.fetch_listing(DEADLINE).expect("the registry answers").components;
        let all = all.into_iter().filter(|entry| entry.kind != "configuration");
        all.map(|entry| (entry.name, entry.pid)).collect()
    }

    /// Asks configd; returns the version in force, whether the file is refused, and all parameters.
    pub fn parameters(&self) -> (u64, bool, Vec<ListedParameter>) {
        let mut all = Vec::new();
        loop {
            let from = u32::try_from(all.len()).expect("few");
            match self.ask(&ConfigRequest::List { request: 1, component: None, from }) {
                ConfigReply::Listed { version, refused, parameters, total, .. } => {
                    all.extend(parameters);
                    if all.len() >= total as usize {
                        return (version, refused, all);
                    }
                }
                other => panic!("{other:?}"),
            }
        }
    }

    /// Connects, sends one request and disconnects.
    fn ask(&self, request: &ConfigRequest) -> ConfigReply {
        let mut stream = TcpStream::connect(self.configd).expect("configd listens");
        stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let hello = Hello::new("observer", 1, Purpose::Config);
        let hello = frame::to_bytes(FrameKind::Hello, &hello).expect("it fits");
        let request = frame::to_bytes(FrameKind::Control, request).expect("it fits");
        stream.write_all(&[hello, request].concat()).expect("it is taken");
        let (mut frames, mut welcome) = (FrameReader::new(), false);
        loop {
            while let Some(frame) = frames.next_frame().expect("frames") {
                match frame.kind {
                    FrameKind::Beat => {}
                    _ if !welcome => {
                        welcome = hello::read_answer(&frame).map(|_| true).expect("yes");
                    }
                    _ => match codec::decode_control(frame.body).expect("a reply") {
                        ConfigReply::Beat => {}
                        reply => return reply,
                    },
                }
            }
            let read = stream.read(frames.space()).expect("an answer");
            assert!(read > 0, "closed without an answer");
            frames.filled(read);
        }
    }
}
