//! The server against plain sockets, in one thread.

use armor_wire::acting::{KeyRole, Preface};
use armor_wire::control::Role;
use armor_wire::frame::{Frame, FrameReader};
use armor_wire::hello::{self, Hello, Purpose, Welcome};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::*;
use crate::listener::listen;

/// How long anything may take before a test counts as failed.
const DEADLINE: Duration = Duration::from_secs(20);

struct Peer {
    stream: TcpStream,
    frames: FrameReader,
}

impl Peer {
    async fn send_frame<T: WireType>(&mut self, kind: FrameKind, value: &T) {
        self.stream.write_all(&frame::to_bytes(kind, value).unwrap()).await.unwrap();
    }

    /// The kind and body of the next frame; `None` at the end.
    async fn hear(&mut self) -> Option<(FrameKind, Vec<u8>)> {
        loop {
            if let Some(frame) = self.frames.next_frame().unwrap() {
                return Some((frame.kind, frame.body.to_vec()));
            }
            let len = self.stream.read(self.frames.space()).await.ok().filter(|len| *len > 0)?;
            self.frames.filled(len);
        }
    }
}

fn run(test: impl Future<Output = ()>) {
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = runtime.enable_all().build().unwrap();
    runtime.block_on(async { time::timeout(DEADLINE, test).await.expect("in time") });
}

async fn server() -> (Server<u64, u64>, std::net::SocketAddr) {
    let listener = listen(([127, 0, 0, 1], 0).into()).unwrap();
    let address = listener.local_addr().unwrap();
    (Server::new(listener, ServerLimits::default()).unwrap(), address)
}

/// A peer that has sent its hello, and its number at the server.
async fn join(server: &mut Server<u64, u64>, address: std::net::SocketAddr) -> (Peer, PeerId) {
    let stream = TcpStream::connect(address).await.unwrap();
    let mut peer = Peer { stream, frames: FrameReader::new() };
    let purpose = Purpose::Registry { entry: None };
    peer.send_frame(FrameKind::Hello, &Hello::new("test", 1, purpose)).await;
    match server.next_event().await {
        PeerEvent::Connected { peer: id, hello, .. } if hello.from == "test" => (peer, id),
        other => panic!("{other:?}"),
    }
}

fn welcome(peer: PeerId) -> PeerAction<u64> {
    let welcome = Welcome { name: "daemon".into(), instance: 5, schema: String::new() };
    PeerAction::Welcome { peer, welcome }
}

#[test]
fn messages_arrive_in_order_in_both_directions() {
    run(async {
        let (mut server, address) = server().await;
        let (mut peer, id) = join(&mut server, address).await;
        server.perform(welcome(id));
        for number in 0..1000 {
            peer.send_frame(FrameKind::Control, &number).await;
            server.perform(PeerAction::Send { peer: id, message: number });
        }
        for number in 0..1000 {
            let event = server.next_event().await;
            let PeerEvent::Message { peer, message, .. } = event else { panic!("{event:?}") };
            assert_eq!((peer, message), (id, number));
        }
        assert_eq!(peer.hear().await.unwrap().0, FrameKind::Welcome);
        for number in 0..1000_u64 {
            let (kind, body) = peer.hear().await.unwrap();
            assert_eq!((kind, body), (FrameKind::Control, number.to_le_bytes().to_vec()));
        }
    });
}

#[test]
fn a_refused_peer_gets_the_reason_and_causes_no_further_event() {
    run(async {
        let (mut server, address) = server().await;
        let (mut peer, id) = join(&mut server, address).await;
        let refusal = Refusal::new(RefusalCode::DuplicateName, "taken");
        peer.send_frame(FrameKind::Control, &1_u64).await;
        server.perform(PeerAction::Refuse { peer: id, refusal: refusal.clone() });
        server.perform(PeerAction::Send { peer: id, message: 7 });
        let (kind, body) = peer.hear().await.unwrap();
        let heard = hello::read_answer(&Frame { kind, flags: 0, body: &body });
        assert_eq!(heard.unwrap_err().to_string(), refusal.text);
        assert!(peer.hear().await.is_none());
        // The next event is of another connection.
        join(&mut server, address).await;
    });
}

#[test]
fn an_idle_peer_gets_beats_and_is_closed_when_it_sends_none() {
    run(async {
        let (mut server, address) = server().await;
        let (mut silent, id) = join(&mut server, address).await;
        server.perform(welcome(id));
        assert_eq!(silent.hear().await.unwrap().0, FrameKind::Welcome);
        assert_eq!(silent.hear().await.unwrap().0, FrameKind::Beat);
        let event = server.next_event().await;
        assert!(
            matches!(event, PeerEvent::Closed { peer, reason: CloseReason::Silent } if peer == id),
            "{event:?}"
        );
        while silent.hear().await.is_some() {}
    });
}

#[test]
fn a_peer_that_leaves_is_reported_once_with_the_reason() {
    run(async {
        let (mut server, address) = server().await;
        let (whole, first) = join(&mut server, address).await;
        let (mut half, second) = join(&mut server, address).await;
        half.stream.write_all(&[9, 0, 0, 0]).await.unwrap();
        drop((whole, half));
        let mut reasons = Vec::new();
        for _ in 0..2 {
            let event = server.next_event().await;
            let PeerEvent::Closed { peer, reason } = event else { panic!("{event:?}") };
            reasons.push((peer, reason.to_string()));
        }
        reasons.sort();
        let expected = [(first, CloseReason::Ended), (second, CloseReason::Truncated)];
        assert_eq!(reasons, expected.map(|(peer, reason)| (peer, reason.to_string())));
        server.perform(PeerAction::Send { peer: first, message: 1 });
        join(&mut server, address).await;
    });
}

#[test]
fn an_answer_too_long_for_a_frame_ends_the_connection_with_that_reason() {
    run(async {
        let listener = listen(([127, 0, 0, 1], 0).into()).unwrap();
        let address = listener.local_addr().unwrap();
        let mut server = Server::<u64, String>::new(listener, ServerLimits::default()).unwrap();
        let mut stream = TcpStream::connect(address).await.unwrap();
        let hello = Hello::new("test", 1, Purpose::Config);
        stream.write_all(&frame::to_bytes(FrameKind::Hello, &hello).unwrap()).await.unwrap();
        let PeerEvent::Connected { peer, .. } = server.next_event().await else {
            panic!("no hello")
        };
        server.perform(PeerAction::Send { peer, message: "x".repeat(2 << 20) });
        let event = server.next_event().await;
        assert!(
            matches!(event, PeerEvent::Closed { reason: CloseReason::Unsendable(_), .. }),
            "{event:?}"
        );
    });
}

#[test]
fn dropping_the_server_closes_everything_and_frees_the_port() {
    run(async {
        let (mut server, address) = server().await;
        let (mut peer, _) = join(&mut server, address).await;
        let mut stranger = TcpStream::connect(address).await.unwrap();
        drop(server);
        assert!(peer.hear().await.is_none());
        assert!(!matches!(stranger.read(&mut [0; 8]).await, Ok(len) if len > 0));
        listen(address).unwrap();
    });
}

fn preface(role: KeyRole) -> Preface {
    Preface::of_person("alice", role)
}

#[test]
fn a_preface_is_acknowledged_before_the_hello_and_reported_with_it() {
    run(async {
        let (mut server, address) = server().await;
        let stream = TcpStream::connect(address).await.unwrap();
        let mut peer = Peer { stream, frames: FrameReader::new() };
        peer.send_frame(FrameKind::Preface, &preface(KeyRole::Observer)).await;
        assert_eq!(peer.hear().await, Some((FrameKind::Beat, Vec::new())));
        let purpose = Purpose::Registry { entry: None };
        peer.send_frame(FrameKind::Hello, &Hello::new("tool-1", 1, purpose)).await;
        let event = server.next_event().await;
        let PeerEvent::Connected { preface: reported, .. } = event else { panic!("{event:?}") };
        assert_eq!(reported, Some(preface(KeyRole::Observer)));
    });
}

#[test]
fn a_hello_that_the_role_does_not_allow_is_refused_with_the_reason() {
    run(async {
        let (_server, address) = server().await;
        let stream = TcpStream::connect(address).await.unwrap();
        let mut peer = Peer { stream, frames: FrameReader::new() };
        peer.send_frame(FrameKind::Preface, &preface(KeyRole::Engineer)).await;
        peer.hear().await.unwrap();
        let purpose = Purpose::Control { role: Role::Executive };
        peer.send_frame(FrameKind::Hello, &Hello::new("tool-1", 1, purpose)).await;
        let (kind, body) = peer.hear().await.unwrap();
        let refused = hello::read_answer(&Frame { kind, flags: 0, body: &body }).unwrap_err();
        assert!(refused.to_string().contains("not for the key of alice"), "{refused}");
        assert_eq!(peer.hear().await, None);
    });
}
