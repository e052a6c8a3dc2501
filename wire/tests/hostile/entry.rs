//! Everything that reads a stranger's bytes, one function each. Shared by the test next to this
//! file and by the fuzz targets in `fuzz/`; what must hold of any input is asserted here.

use armor_wire::acting::{Opening, Preface};
use armor_wire::frame::{FrameReader, PREFIX_LEN};
use armor_wire::hello::{Hello, Refusal, Welcome, read_answer};
use armor_wire::message::WireType;
use armor_wire::schema::{self, Schema};
use armor_wire::{codec, config, control, gate, quantity, registry, remote_process};

/// A name, and what it does with bytes.
pub type Entry = (&'static str, fn(&[u8]));

/// All of them.
pub const ENTRIES: [Entry; 6] = [
    ("frames", frames),
    ("hello", hello),
    ("opening", opening),
    ("control", control_values),
    ("schema", schema_text),
    ("json", json),
];

/// A stream of frames. The first byte sets the sizes of the pieces in which it arrives; they must
/// make no difference.
pub fn frames(bytes: &[u8]) {
    let Some((piece, stream)) = bytes.split_first() else { return };
    let pieces = read_in_pieces(stream, usize::from(*piece) + 1);
    assert_eq!(pieces, read_in_pieces(stream, usize::MAX), "pieces of {} bytes", *piece);
}

/// Kind and body of each frame, and whether they ended in an error.
fn read_in_pieces(mut stream: &[u8], piece: usize) -> (Vec<(u8, Vec<u8>)>, bool) {
    let (mut reader, mut found) = (FrameReader::new(), Vec::new());
    while !stream.is_empty() {
        let space = reader.space();
        assert!(!space.is_empty());
        let len = piece.min(stream.len()).min(space.len());
        space[..len].copy_from_slice(&stream[..len]);
        reader.filled(len);
        stream = &stream[len..];
        loop {
            match reader.next_frame() {
                Ok(Some(frame)) => {
                    let _ = (Hello::read(&frame), read_answer(&frame), frame.data());
                    found.push((frame.kind as u8, frame.body.to_vec()));
                }
                Ok(None) => break,
                Err(_) => return (found, true),
            }
        }
    }
    (found, false)
}

/// A connection's first frame.
pub fn hello(bytes: &[u8]) {
    let mut reader = FrameReader::with_limit(codec::MAX_HELLO_LEN);
    let space = reader.space();
    let len = bytes.len().min(space.len());
    space[..len].copy_from_slice(&bytes[..len]);
    reader.filled(len);
    if let Ok(Some(frame)) = reader.next_frame()
        && let Ok(hello) = Hello::read(&frame)
    {
        assert_eq!(codec::encode(&hello).expect("short"), frame.body);
        assert_eq!(bytes[..4], ((len_of(&hello) as u32).to_le_bytes()));
        assert!(len >= PREFIX_LEN);
    }
}

/// A connection's first frames, of which one may be a preface: it only takes rights away, so a
/// purpose that is accepted after it is accepted without it.
pub fn opening(bytes: &[u8]) {
    let mut reader = FrameReader::with_limit(codec::MAX_HELLO_LEN);
    let space = reader.space();
    let len = bytes.len().min(space.len());
    space[..len].copy_from_slice(&bytes[..len]);
    reader.filled(len);
    let mut opening = Opening::default();
    for _ in 0..3 {
        let Ok(Some(frame)) = reader.next_frame() else { return };
        match opening.read_frame(&frame) {
            Ok(None) => assert!(opening.preface().is_some()),
            Ok(Some(hello)) => {
                assert_eq!(Hello::read(&frame).expect("a hello by itself"), hello);
                return;
            }
            Err(_) => return,
        }
    }
    panic!("a second preface was accepted");
}

fn len_of<T: WireType>(value: &T) -> usize {
    codec::encoded_len(value).expect("short")
}

/// Every value that travels in a handshake or control frame.
pub fn control_values(bytes: &[u8]) {
    value::<Hello>(bytes);
    value::<Welcome>(bytes);
    value::<Refusal>(bytes);
    value::<registry::RegistryRequest>(bytes);
    value::<registry::RegistryReply>(bytes);
    value::<config::ConfigRequest>(bytes);
    value::<config::ConfigReply>(bytes);
    value::<control::Command>(bytes);
    value::<control::Answer>(bytes);
    value::<Preface>(bytes);
    value::<gate::GateRequest>(bytes);
    value::<gate::GateReply>(bytes);
    value::<remote_process::RemoteOrder>(bytes);
    value::<remote_process::RemoteEvent>(bytes);
}

/// A value has one encoding, and the typed and the untyped reader agree on what is one.
fn value<T: WireType>(bytes: &[u8]) {
    let typed = codec::decode_control::<T>(bytes);
    if let Ok(value) = &typed {
        // Not a NaN's: floats are compared as bytes.
        assert_eq!(codec::encode(value).expect("short"), bytes);
    }
    let untyped = schema::to_json(&T::schema(), bytes);
    assert_eq!(typed.is_ok(), untyped.is_ok(), "{:?} {untyped:?}", typed.err());
}

/// Text from a peer: a schema, and the quantities and names that are read in the same manner.
pub fn schema_text(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(schema) = schema::parse(text) {
        assert_eq!(schema.to_string(), text);
        assert!(schema.min_len() <= codec::MAX_DATA_LEN);
    }
    let (ours, theirs) = text.split_at(text.floor_char_boundary(text.len() / 2));
    let difference = schema::difference(("ours", ours), ("theirs", theirs));
    assert_eq!(difference.is_empty(), ours == theirs);
    if let Ok(quantity) = quantity::parse(text) {
        assert!(quantity.si.is_finite());
    }
    let _ = (quantity::seconds(text), quantity::hertz(text), armor_wire::name::split_data(text));
}

/// A payload of a schema that came with it: the text, a zero byte, the payload.
pub fn json(bytes: &[u8]) {
    let Some(end) = bytes.iter().position(|byte| *byte == 0) else { return };
    let Ok(text) = std::str::from_utf8(&bytes[..end]) else { return };
    let payload = &bytes[end + 1..];
    let Ok(schema) = schema::parse(text) else { return };
    if schema::to_json(&schema, payload).is_ok() {
        assert!(payload.len() >= schema.min_len());
        assert!(schema != Schema::Bool || payload.len() == 1);
    }
}
