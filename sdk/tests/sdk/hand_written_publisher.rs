//! A publisher that a test writes by hand: it sends what a real one sends, in other pieces.

use std::io::{IoSlice, Read, Write};
use std::mem::MaybeUninit;
use std::net::TcpStream;
use std::os::fd::AsFd;
use std::time::Instant;

use armor_memory::{LinkPage, PageLayout, RingEntry, RingWriter, SlotMemory};
use armor_sdk::prelude::*;
use armor_sdk::wire::codec;
use armor_sdk::wire::frame::{DataHeader, FrameKind, FrameReader, signal, to_bytes};
use armor_sdk::wire::hello::{Hello, Purpose, Welcome};
use armor_sdk::wire::message::WireType;
use armor_sdk::wire::registry::{ComponentEntry, DataEntry, RegistryRequest};
use armor_sdk::wire::shared_memory::{
    MemoryOfferBody, SLOT_HEADER_LEN, SlotOfferBody, write_slot_header,
};
use armor_socket::{ComponentListeners, Stream, host_name, random_id};
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};

use crate::bench_system::{DEADLINE, Sample, System, data, sample};

/// Connections are accepted without waiting; between two looks the test waits so many milliseconds.
const LOOK_MS: u64 = 5;

/// Registers a process start that provides `out` of samples, and keeps its connection alive for as
/// long as the registry does.
fn register(system: &System, listeners: &ComponentListeners, instance: u64) {
    let name = system.name("source");
    let mut stream = TcpStream::connect(system.registry.address()).unwrap();
    let entry = ComponentEntry {
        name: name.clone(),
        kind: "probe".into(),
        instance,
        pid: std::process::id(),
        host: host_name(),
        endpoint: listeners.endpoint().unwrap(),
    };
    let hello = Hello::new(&name, instance, Purpose::Registry { entry: Some(entry) });
    stream.write_all(&to_bytes(FrameKind::Hello, &hello).unwrap()).unwrap();
    assert_eq!(read_kind(|buffer| stream.read(buffer)), FrameKind::Welcome);
    let entry = DataEntry {
        data: format!("{name}.out"),
        type_name: Sample::NAME.into(),
        schema: Sample::schema().to_string(),
        latched: false,
    };
    let request = RegistryRequest::Provide { request: 1, entry };
    stream.write_all(&to_bytes(FrameKind::Control, &request).unwrap()).unwrap();
    std::thread::spawn(move || {
        while stream.write_all(&signal(FrameKind::Beat)).is_ok() {
            std::thread::sleep(std::time::Duration::from_millis(300));
        }
    });
}

/// Returns the kind of the first frame.
fn read_kind(mut read: impl FnMut(&mut [u8]) -> std::io::Result<usize>) -> FrameKind {
    let mut reader = FrameReader::new();
    loop {
        if let Some(frame) = reader.next_frame().unwrap() {
            return frame.kind;
        }
        let len = read(reader.space()).unwrap();
        assert!(len > 0, "the connection has ended before a frame");
        reader.filled(len);
    }
}

fn accept(listeners: &ComponentListeners) -> Stream {
    let begin = Instant::now();
    loop {
        if let Some(stream) = listeners.accept().unwrap() {
            stream.set_nonblocking(false).unwrap();
            return stream;
        }
        assert!(begin.elapsed() < DEADLINE, "no subscriber connects");
        std::thread::sleep(std::time::Duration::from_millis(LOOK_MS));
    }
}

#[test]
fn memory_that_comes_in_the_same_write_as_the_welcome_is_taken() {
    let mut system = System::start();
    let instance = random_id();
    let listeners = ComponentListeners::open(instance).unwrap();
    register(&system, &listeners, instance);
    let link = system.link("in", "source", "out", "all");
    let probe = system.run("sink", &[&link], None, |_, _| Ok(Outcome::CarryOn));
    let stream = accept(&listeners);
    assert_eq!(read_kind(|buffer| stream.receive(buffer)), FrameKind::Hello);

    let layout = PageLayout { cells: 8, slots: 16 };
    let (page, page_file) = LinkPage::create(layout).unwrap();
    let payload = codec::encode(&sample(7, 1000)).unwrap();
    let len = SLOT_HEADER_LEN + payload.len();
    let mut slot = SlotMemory::create(len).unwrap();
    let header = DataHeader { sequence: 0, stamp_s: 1.0, instance, fresh: true };
    write_slot_header(slot.bytes_mut(), &header, payload.len());
    slot.bytes_mut()[SLOT_HEADER_LEN..].copy_from_slice(&payload);
    page.words().lend(0);
    RingWriter::default().push(page.words(), RingEntry { slot: 1, fresh: true });

    let schema = Sample::schema().to_string();
    let welcome = Welcome { name: system.name("source"), instance, schema };
    let memory = MemoryOfferBody { cells: layout.cells, slots: layout.slots, held: 10 };
    let offer = SlotOfferBody { slot: 1, index: 0, len: len as u32 };
    let bytes = [
        to_bytes(FrameKind::Welcome, &welcome).unwrap(),
        to_bytes(FrameKind::MemoryOffer, &memory).unwrap(),
        to_bytes(FrameKind::SlotOffer, &offer).unwrap(),
    ]
    .concat();
    let files = [page_file.as_fd(), slot.file()];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(2))];
    let mut control = SendAncillaryBuffer::new(&mut space);
    assert!(control.push(SendAncillaryMessage::ScmRights(&files)));
    let sent = sendmsg(&stream, &[IoSlice::new(&bytes)], &mut control, SendFlags::empty()).unwrap();
    assert_eq!(sent, bytes.len(), "in one write");

    assert_eq!(data(&probe), ("in".into(), 7, 0));
    let is_released = || !page.words().is_held(0);
    let begin = Instant::now();
    while !is_released() {
        assert!(begin.elapsed() < DEADLINE, "the slot is never given back");
        std::thread::yield_now();
    }
}
