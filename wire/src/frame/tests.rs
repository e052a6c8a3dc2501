//! Frames at their edges: cut at every byte, at the limits, and malformed.

use super::*;

/// All frames of `bytes`, fed in pieces of the given lengths, the last one repeated.
fn frames(reader: &mut FrameReader, bytes: &[u8], pieces: &[usize]) -> Vec<(FrameKind, Vec<u8>)> {
    let mut found = Vec::new();
    let (mut left, mut turn) = (bytes, 0);
    while !left.is_empty() {
        let space = reader.space();
        assert!(!space.is_empty(), "no space after all frames were taken");
        let len = pieces[turn.min(pieces.len() - 1)].min(left.len()).min(space.len());
        space[..len].copy_from_slice(&left[..len]);
        reader.filled(len);
        (left, turn) = (&left[len..], turn + 1);
        while let Some(frame) = reader.next_frame().expect("well-formed") {
            found.push((frame.kind, frame.body.to_vec()));
        }
    }
    found
}

fn data_frame(len: usize, fill: u8) -> Vec<u8> {
    let header = DataHeader { sequence: 7, stamp_s: 1.5, instance: 9, fresh: true };
    let mut bytes = header.to_bytes(len).to_vec();
    bytes.resize(DATA_HEADER_LEN + len, fill);
    bytes
}

fn first_error(bytes: &[u8]) -> FrameError {
    let mut reader = FrameReader::new();
    reader.space()[..bytes.len()].copy_from_slice(bytes);
    reader.filled(bytes.len());
    reader.next_frame().expect_err("malformed")
}

#[test]
fn frames_cut_at_every_byte_are_the_same() {
    let mut bytes = signal(FrameKind::Beat).to_vec();
    append(FrameKind::Control, &String::from("ja"), &mut bytes).expect("short");
    bytes.extend(data_frame(3, 5));
    bytes.extend(signal(FrameKind::Resume));
    let whole = frames(&mut FrameReader::new(), &bytes, &[bytes.len()]);
    assert_eq!(whole.len(), 4);
    for cut in 1..bytes.len() {
        assert_eq!(frames(&mut FrameReader::new(), &bytes, &[cut, bytes.len()]), whole);
    }
    assert_eq!(frames(&mut FrameReader::new(), &bytes, &[1]), whole);
}

#[test]
fn lengths_around_the_buffer_sizes_arrive_whole() {
    let edges = [0, READ_LEN - DATA_HEADER_LEN, (1 << 20) - DATA_HEADER_LEN, 5 << 20, 20 << 20];
    let mut reader = FrameReader::new();
    for len in edges.into_iter().flat_map(|len| [len.saturating_sub(1), len, len + 1]) {
        let mut bytes = data_frame(len, len as u8);
        bytes.extend(signal(FrameKind::Beat));
        let found = frames(&mut reader, &bytes, &[11, 100_000]);
        assert_eq!(found.len(), 2, "{len} bytes of payload");
        assert_eq!(found[0].1, &bytes[PREFIX_LEN..DATA_HEADER_LEN + len]);
        assert!(!reader.is_mid_frame());
    }
}

#[test]
fn an_announced_length_alone_takes_little_memory() {
    let mut reader = FrameReader::new();
    let start = &data_frame(MAX_DATA_LEN, 0)[..100];
    assert_eq!(frames(&mut reader, start, &[100]), []);
    assert!(reader.is_mid_frame());
    assert_eq!(reader.space().len(), (16 << 10) - 100);
    // Afterwards the buffer is at most twice as long as what has arrived.
    let mut arrived = 100;
    while arrived < 1 << 20 {
        let room = reader.space().len();
        assert!(arrived + room <= 2 * arrived.max(8 << 10), "{room} after {arrived}");
        reader.filled(room);
        assert!(reader.next_frame().unwrap().is_none());
        arrived += room;
    }
}

#[test]
fn what_is_not_ours_is_refused_by_the_prefix_alone() {
    let prefix = |len: u32, rest: [u8; 4]| {
        let [a, b, c, d] = len.to_le_bytes();
        first_error(&[a, b, c, d, rest[0], rest[1], rest[2], rest[3]])
    };
    assert_eq!(first_error(b"GET / HT"), FrameError::UnknownKind(b'/'));
    assert_eq!(prefix(0, [0, 0, 0, 0]), FrameError::UnknownKind(0));
    assert_eq!(prefix(0, [200, 0, 0, 0]), FrameError::UnknownKind(200));
    for kind in [FrameKind::Hello, FrameKind::Control, FrameKind::Data, FrameKind::Beat] {
        let len = kind.max_body_len() + 1;
        let error = prefix(len as u32, [kind as u8, 0, 0, 0]);
        assert_eq!(error, FrameError::TooLong { kind, len });
    }
    let flags = [
        (FrameKind::Beat, 1, 0, 0),
        (FrameKind::Data, 2, 0, 0),
        (FrameKind::Data, 0, 1, 0),
        (FrameKind::Sync, 1, 0, 0),
        (FrameKind::Synced, 2, 0, 0),
    ];
    for (kind, a, b, c) in flags {
        assert_eq!(prefix(0, [kind as u8, a, b, c]), FrameError::Malformed(kind));
    }
}

#[test]
fn a_stranger_gets_less_room_until_the_limit_is_lifted() {
    let bytes = to_bytes(FrameKind::Control, &vec![1_u8; 100]).expect("short");
    let mut reader = FrameReader::with_limit(64);
    reader.space()[..bytes.len()].copy_from_slice(&bytes);
    reader.filled(bytes.len());
    let error = FrameError::TooLong { kind: FrameKind::Control, len: 108 };
    assert_eq!(reader.next_frame(), Err(error));
    reader.lift_limit();
    assert!(reader.next_frame().is_ok_and(|frame| frame.is_some()));
}

#[test]
fn a_body_that_is_too_long_is_not_written() {
    let mut bytes = vec![1, 2, 3];
    for len in [MAX_HELLO_LEN, MAX_DATA_LEN] {
        let result = append(FrameKind::Hello, &vec![0_u8; len], &mut bytes);
        assert!(matches!(result, Err(FrameError::TooLong { len, .. }) if len > MAX_HELLO_LEN));
        assert_eq!(bytes, [1, 2, 3]);
    }
}

#[test]
fn a_data_header_comes_back_as_it_was() {
    let header = DataHeader { sequence: u64::MAX, stamp_s: -0.25, instance: 3, fresh: true };
    let bytes = [&header.to_bytes(2)[..], b"ab"].concat();
    let body = &bytes[PREFIX_LEN..];
    let frame = Frame { kind: FrameKind::Data, flags: bytes[5], body };
    assert_eq!(frame.data(), Ok((header, &b"ab"[..])));
    let short = Frame { body: &body[..23], ..frame };
    assert_eq!(short.data(), Err(FrameError::Malformed(FrameKind::Data)));
    let beat = Frame { kind: FrameKind::Beat, ..frame };
    assert!(matches!(beat.data(), Err(FrameError::Unexpected { .. })));
}

#[test]
fn a_frame_is_superseded_when_a_whole_data_frame_follows_it() {
    let cases: [(&[Vec<u8>], bool); 5] = [
        (&[], false),
        (&[data_frame(5, 1)[..30].to_vec()], false),
        (&[signal(FrameKind::Beat).to_vec()], false),
        (&[data_frame(0, 1)], true),
        (&[data_frame(5, 1), data_frame(5, 2)], true),
    ];
    for (following, expected) in cases {
        let bytes = [data_frame(5, 0), following.concat()].concat();
        let mut reader = FrameReader::new();
        assert!(!reader.is_superseded());
        reader.space()[..bytes.len()].copy_from_slice(&bytes);
        reader.filled(bytes.len());
        assert_eq!(reader.is_superseded(), expected, "{} bytes follow", bytes.len() - 37);
        assert!(reader.next_frame().is_ok_and(|frame| frame.is_some()));
    }
}
