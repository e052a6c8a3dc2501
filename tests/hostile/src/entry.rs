//! The decoders. What applies to any input is asserted here.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use armor_carmen_player::log::CarmenLog;
use armor_exchange::{PlanFormat, read_plan, write_plan};
use armor_executive::journal::verify_bytes;
use armor_grid_slam::state::decode_state;
use armor_keys::invitations::{Invitations, Secret};
use armor_keys::revoked::parse_revoked;
use armor_keys::{CertificateFacts, KeyFile};
use armor_memory::{PageLayout, PageWords, RingEntry, RingReader, RingWriter};
use armor_petri::file::{self, NetFile, pnml, tina};
use armor_recording::Recording;
use armor_recording::ros::RosMessage;
use armor_robotfile::claim::Claim;
use armor_robotfile::guard::{Guard, MAX_LEN};
use armor_simulator::pose::Pose2;
use armor_simulator::world::World;
use armor_tiles::{OpenError, Source};
use armor_wire::datagram::{DatagramReceiver, DatagramSender, MAX_DATAGRAM_MESSAGE};
use armor_wire::schema::parse;
use armor_wire::shared_memory::read_slot;

/// A decoder: its name, and what it does with bytes.
pub type FileDecoder = (&'static str, fn(&[u8]));

/// All of them.
pub const DECODERS: [FileDecoder; 13] = [
    ("guards", read_guard),
    ("pnml", read_pnml),
    ("tina", read_tina),
    ("worlds", read_world),
    ("logs", read_log),
    ("journals", read_journal),
    ("keys", read_keys),
    ("states", read_state),
    ("rings", read_ring),
    ("datagrams", read_datagrams),
    ("recordings", read_recording),
    ("plans", read_plans),
    ("pictures", read_picture),
];

/// Most messages of one input that are read: what is compressed may become much longer.
const MAX_MESSAGES: usize = 10_000;

/// Separates the two files of one input.
pub const SEPARATOR: u8 = 0;

/// A guard, and the same text as a claim. What is printed of a guard is that guard.
pub fn read_guard(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Guard::parse(text) {
        Ok(guard) => {
            assert_eq!(
                guard.holds(&vec![None; guard.names().len()]).is_some(),
                is_constant(&guard)
            );
            let printed = guard.to_string();
            // It may be longer by spaces.
            if printed.len() <= MAX_LEN {
                assert_eq!(Guard::parse(&printed).as_ref(), Ok(&guard), "{printed}");
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    match Claim::parse(text) {
        Ok(claim) => assert!(claim.names().iter().all(|(_, name)| !name.as_str().is_empty())),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Whether the value of a guard is known without data: it is then the same whatever is open.
fn is_constant(guard: &Guard) -> bool {
    let count = guard.names().len();
    guard.holds_whatever(&vec![None; count], &vec![false; count]).is_some()
}

/// A recording: its summary, its files, and its messages from the beginning and from its middle. A
/// message that is returned has the layout of its type, or a reason.
pub fn read_recording(bytes: &[u8]) {
    // A file without a name, in memory.
    let memory = rustix::fs::memfd_create("recording", rustix::fs::MemfdFlags::CLOEXEC);
    let mut file = File::from(memory.expect("memory for a file"));
    file.write_all(bytes).expect("memory for a file");
    let Ok(mut recording) = Recording::read(file) else { return };
    let summary = recording.summary().clone();
    for recorded in &summary.files {
        // The index may name a file whose record is damaged.
        let _ = recording.read_file(&recorded.name);
    }
    let middle_s = summary.span_s.map_or(0.0, |(from_s, to_s)| from_s.midpoint(to_s));
    for start_s in [f64::NEG_INFINITY, middle_s] {
        if recording.seek(start_s).is_err() {
            continue;
        }
        for _ in 0..MAX_MESSAGES {
            let Ok(Some(message)) = recording.next_message() else { break };
            if let Ok(payload) = &message.payload {
                let schema = parse(&message.output_type.schema).expect("of what was decoded");
                let is_of_it = RosMessage::new(&schema).encode(payload).is_ok();
                assert!(is_of_it, "{} is not of its type", message.data);
            }
        }
    }
}

/// The extensions of pictures for a map; the first byte of an input is the index of its own.
pub const PICTURES: [&str; 8] =
    ["png", "jpg", "pmtiles", "mbtiles", "tif", "yaml", "svg", "geojson"];

/// Opens a picture for a map, next to a world file and the grey picture of a grid map.
fn open_picture(bytes: &[u8]) -> Option<Result<Source, OpenError>> {
    let (&kind, content) = bytes.split_first()?;
    let folder = format!("armor-pictures-{}-{:?}", std::process::id(), std::thread::current().id());
    let folder = std::env::temp_dir().join(folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let write = |name: &str, content: &[u8]| std::fs::write(folder.join(name), content);
    let picture = format!("a.{}", PICTURES[usize::from(kind) % PICTURES.len()]);
    write(&picture, content).expect("it is written");
    write("a.wld", b"0.5\n0\n0\n-0.5\n100\n50\n").expect("it is written");
    write("map.pgm", b"P5\n2 2\n255\n\x00\x80\xff\xfe").expect("it is written");
    let opened = Source::open(&folder.join(picture));
    // What is open is read from there on; a picture that is read later may be gone.
    if let Ok(source) = &opened {
        look_at_tiles(source);
    }
    std::fs::remove_dir_all(&folder).expect("it is removed");
    Some(opened)
}

/// A few tiles of the finest level and of a coarse one. Each has the pixels that it states.
fn look_at_tiles(source: &Source) {
    let bounds = source.bounds();
    assert!(bounds.width() >= 0.0 && bounds.height() >= 0.0, "{bounds:?}");
    let fine = 1.0 / source.units_per_pixel();
    for scale in [fine, fine / 16.0] {
        for id in source.wanted(bounds, scale).into_iter().take(3) {
            if let Ok(Some(image)) = source.decode(id) {
                let pixels = image.width as usize * image.height as usize;
                assert_eq!(image.rgba.len(), 4 * pixels, "{id}");
            }
        }
    }
}

/// A picture for a map.
pub fn read_picture(bytes: &[u8]) {
    if let Some(Err(error)) = open_picture(bytes) {
        assert!(!error.to_string().is_empty());
    }
}

/// Whether an input is a picture that opens.
pub fn is_picture(bytes: &[u8]) -> bool {
    open_picture(bytes).is_some_and(|opened| opened.is_ok())
}

/// A net in PNML. What is written of it is the same net.
pub fn read_pnml(bytes: &[u8]) {
    let Ok(text) = file::decode_text(bytes) else { return };
    match pnml::read(&text) {
        Ok(net) => check_same(&net, &pnml::read(&pnml::write(&net)).expect("it was written")),
        Err(error) => assert!(error.line > 0 && error.column > 0 && !error.to_string().is_empty()),
    }
}

/// A net of TINA. What is written of it is the same net, if it can be expressed.
pub fn read_tina(bytes: &[u8]) {
    let Ok(text) = file::decode_text(bytes) else { return };
    match tina::read(&text) {
        Ok(net) => {
            if let Ok(written) = tina::write(&net) {
                check_same(&net, &tina::read(&written).expect("it was written"));
            }
        }
        Err(error) => assert!(error.line > 0 && error.column > 0 && !error.to_string().is_empty()),
    }
}

/// A plan of another planner, in any of the formats. What is read can be written in all formats,
/// unless it has several routes.
pub fn read_plans(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for format in PlanFormat::ALL {
        let Ok(plan) = read_plan(text, *format) else { continue };
        for to in PlanFormat::ALL {
            let written = write_plan(&plan, *to);
            assert!(written.is_ok() || plan.routes.len() > 1, "{written:?}");
        }
    }
}

/// Places may come in another order.
fn check_same(one: &NetFile, other: &NetFile) {
    assert_eq!(list_tokens(one), list_tokens(other));
    assert_eq!(one.net.transitions().len(), other.net.transitions().len());
}

fn list_tokens(file: &NetFile) -> BTreeMap<&str, u32> {
    let tokens = file.net.initial().iter().copied();
    file.net.places().iter().map(String::as_str).zip(tokens).collect()
}

/// A drawing of a world, in which a robot looks around.
pub fn read_world(bytes: &[u8]) {
    match World::parse("a.svg", bytes) {
        Ok(world) => {
            assert!(!world.segments().is_empty());
            for turn in [0.0, 1.0, 3.0] {
                let from = Pose2::new(0.0, 0.0, turn);
                assert!(world.range_m(from, 9.0).is_none_or(|range| (0.0..=9.0).contains(&range)));
            }
            assert!(world.clearance_m(0.0, 0.0) >= 0.0);
        }
        Err(error) => assert!(error.to_string().contains("a.svg")),
    }
}

/// A recorded log: every line is a record, a fault with its number, or skipped.
pub fn read_log(bytes: &[u8]) {
    let mut log = CarmenLog::new(bytes);
    let faults = log.by_ref().filter(Result::is_err).count() as u64;
    let tally = log.tally();
    assert!(log.has_ended() && tally.malformed == faults);
    assert!(tally.scans + tally.malformed + tally.unknown <= tally.lines);
}

/// The state of a mapper: what is read of it is whole, and what follows makes no difference.
pub fn read_state(bytes: &[u8]) {
    match decode_state(bytes) {
        Ok(state) => {
            assert!(state.len <= bytes.len() && state.poses.len() == state.keyframes.len());
            let again = decode_state(&bytes[..state.len]).expect("the same state");
            assert_eq!((again.len, again.track.len()), (state.len, state.track.len()));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// A journal, and its state file after a zero byte.
pub fn read_journal(bytes: &[u8]) {
    let split = bytes.iter().position(|byte| *byte == SEPARATOR);
    let (journal, state) = match split {
        Some(at) => (&bytes[..at], Some(&bytes[at + 1..])),
        None => (bytes, None),
    };
    let Ok(found) = verify_bytes(Some(journal), state) else { return };
    assert!(found.torn_len <= journal.len() as u64);
    if let Some(fault) = &found.fault {
        assert!(!fault.kind().is_empty() && !fault.to_string().is_empty());
    }
    // The end that was never committed makes no difference.
    let whole = &journal[..journal.len() - found.torn_len as usize];
    if found.fault.is_none() && state.is_some() {
        let again = verify_bytes(Some(whole), state).expect("the same format");
        assert_eq!((again.fault, again.torn_len), (None, 0));
        assert_eq!(again.story.records, found.story.records);
    }
}

/// The key of a person or a host, a certificate, a list of revoked keys, invitations to a page.
pub fn read_keys(bytes: &[u8]) {
    if let Err(why) = CertificateFacts::read(bytes) {
        assert!(!why.is_empty());
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match KeyFile::from_text(text) {
        Ok(key) => assert!(!format!("{key:?}").contains("PRIVATE")),
        Err(why) => assert!(!why.is_empty()),
    }
    if let Ok(invitations) = Invitations::from_text(text) {
        let again = Invitations::from_text(&invitations.to_text());
        assert!(again.is_ok_and(|it| it.list().len() == invitations.list().len()));
        let _ = invitations.find_visitor(&Secret::new([1; 20]), 0);
    }
    match parse_revoked(text) {
        Ok(serials) => assert!(serials.len() <= text.lines().count()),
        Err(why) => assert!(why.starts_with("line ") || why.starts_with("more than")),
    }
}

/// Memory that the other end of a link has written: a page, of which the first two bytes are the
/// sizes, and the same bytes as a slot. Neither end waits for it, or reads beyond it.
pub fn read_ring(bytes: &[u8]) {
    if let Some((_, payload)) = read_slot(bytes) {
        assert!(payload.len() < bytes.len());
    }
    let [cells, slots, content @ ..] = bytes else { return };
    let layout = PageLayout { cells: u32::from(*cells % 32) + 1, slots: u32::from(*slots) + 1 };
    assert!(layout.is_valid());
    let word = |chunk: &[u8]| chunk.iter().fold(0, |word, byte| word << 8 | u64::from(*byte));
    let mut words: Vec<_> = content.chunks(8).map(word).map(AtomicU64::new).collect();
    words.resize_with(layout.count_words(), || AtomicU64::new(0));
    let page = PageWords::of(&words, layout);
    let mut reader = RingReader::default();
    let taken = std::iter::from_fn(|| reader.take(page)).take(layout.cells as usize + 1);
    for entry in taken.collect::<Vec<_>>() {
        page.release(entry.slot);
    }
    assert_eq!(reader.take(page), None, "nothing is taken twice");
    let mut writer = RingWriter::default();
    for slot in 1..=2 * layout.cells {
        page.lend(slot);
        writer.push(page, RingEntry { slot, fresh: false });
    }
    assert_eq!(writer.count_waiting(page), u64::from(layout.cells));
    assert_eq!(writer.clear(page).count(), layout.cells as usize);
    assert!(page.count_held(0..layout.slots) <= layout.slots as usize);
}

/// Datagrams, each behind its length in two bytes: both ends take all of them. What a subscriber takes
/// is in order, and a publisher answers each datagram with one at most.
pub fn read_datagrams(mut bytes: &[u8]) {
    let mut receivers = [0, 3].map(|resent| DatagramReceiver::new(0, resent));
    let mut sender = DatagramSender::new(0, 3, Duration::ZERO);
    let mut last = [None; 2];
    while let Some((len, rest)) = bytes.split_first_chunk::<2>() {
        let len = usize::from(u16::from_le_bytes(*len)).min(rest.len());
        let (datagram, after) = rest.split_at(len);
        bytes = after;
        for (receiver, last) in receivers.iter_mut().zip(&mut last) {
            receiver.receive(datagram);
            while let Some(message) = receiver.take_message() {
                assert!(message.payload.len() <= MAX_DATAGRAM_MESSAGE);
                let sequence = message.sequence;
                assert!(last.replace(sequence).is_none_or(|last| last < sequence));
                if sequence == u64::MAX {
                    return;
                }
            }
            assert!(!receiver.write_receipt().is_empty());
        }
        let mut answers = 0;
        sender.receive(datagram, Duration::ZERO, |_| answers += 1);
        assert!(answers <= 1);
    }
}
