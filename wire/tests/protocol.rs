//! Keeps `docs/protocol.md` true: every schema, golden vector and limit in it is what this crate
//! produces, and none is missing.

use std::collections::BTreeMap;
use std::fmt::Debug;

use armor_wire::acting::{KeyRole, Preface};
use armor_wire::datagram::{DatagramOfferBody, DatagramSwitchBody};
use armor_wire::frame::{self, DataHeader, Frame, FrameKind, FrameReader};
use armor_wire::hello::{Hello, LinkRequest, Purpose, Refusal, RefusalCode, VERSION, Welcome};
use armor_wire::keep::{Keep, Wake};
use armor_wire::registry::{ComponentEntry, DataEntry};
use armor_wire::shared_memory::{MemoryOfferBody, MemoryUse, SlotEndBody, SlotOfferBody};
use armor_wire::{
    Array, Message, WireType, codec, config, control, gate, registry, remote_process, schema,
};

const DOCUMENT: &str = include_str!("../../docs/protocol.md");

/// The fenced blocks whose info string is `KIND NAME`, by name, without white space.
fn blocks(kind: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut lines = DOCUMENT.lines();
    while let Some(line) = lines.next() {
        let Some(info) = line.strip_prefix("```").filter(|info| !info.is_empty()) else { continue };
        let body: String = lines.by_ref().take_while(|line| *line != "```").collect();
        if let Some((_, name)) = info.split_once(' ').filter(|(first, _)| *first == kind) {
            found.insert(name.to_owned(), body.split_whitespace().collect());
        }
    }
    found
}

fn check<'a>(kind: &str, expected: impl IntoIterator<Item = (&'a str, String)>) {
    let expected: BTreeMap<_, _> =
        expected.into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
    let found = blocks(kind);
    for (name, text) in &expected {
        assert_eq!(found.get(name), Some(text), "{kind} {name} in docs/protocol.md");
    }
    assert_eq!(found.len(), expected.len(), "{kind}s in docs/protocol.md: {:?}", found.keys());
}

fn text<T: WireType>() -> String {
    T::schema().to_string()
}

/// A schema that changes without a new version would be read wrongly by an older process, which then
/// only breaks the connection.
#[test]
fn the_schemas_belong_to_the_version() {
    let texts: Vec<String> = blocks("schema").into_values().collect();
    let hash = format!("{:016x}", schema::hash_text(&texts.join("\n")));
    let (row, cell) = (format!("| {VERSION} |"), format!("`{hash}`"));
    let known = DOCUMENT.lines().any(|line| line.starts_with(&row) && line.contains(&cell));
    assert!(
        known,
        "the schemas are not those of version {VERSION}; if it was released, count VERSION up and add \
         a row to the table in docs/protocol.md, otherwise correct the hash there: {hash}"
    );
}

#[test]
fn the_schemas_are_those_of_the_types() {
    check(
        "schema",
        [
            ("Hello", text::<Hello>()),
            ("Welcome", text::<Welcome>()),
            ("Refusal", text::<Refusal>()),
            ("registry::Request", text::<registry::RegistryRequest>()),
            ("registry::Reply", text::<registry::RegistryReply>()),
            ("config::Request", text::<config::ConfigRequest>()),
            ("config::Reply", text::<config::ConfigReply>()),
            ("ConfigurationState", text::<config::ConfigurationState>()),
            ("control::Command", text::<control::Command>()),
            ("control::Answer", text::<control::Answer>()),
            ("MemoryOffer", text::<MemoryOfferBody>()),
            ("SlotOffer", text::<SlotOfferBody>()),
            ("SlotEnd", text::<SlotEndBody>()),
            ("DatagramOffer", text::<DatagramOfferBody>()),
            ("DatagramSwitch", text::<DatagramSwitchBody>()),
            ("Preface", text::<Preface>()),
            ("gate::Request", text::<gate::GateRequest>()),
            ("gate::Reply", text::<gate::GateReply>()),
            ("RemoteOrder", text::<remote_process::RemoteOrder>()),
            ("RemoteEvent", text::<remote_process::RemoteEvent>()),
        ],
    );
}

/// Every kind of value once.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
struct Sample {
    flag: bool,
    #[message(unit = "m/s")]
    speed: f32,
    text: String,
    maybe: Option<u16>,
    none: Option<u16>,
    bytes: Array<u8>,
    pair: [i16; 2],
    levels: Vec<Level>,
}

#[derive(Clone, Debug, PartialEq, Message)]
#[message(wire = "armor_wire")]
enum Level {
    Low,
    High { margin: f64 },
}

fn sample() -> Sample {
    Sample {
        flag: true,
        speed: 0.5,
        text: "é!".into(),
        maybe: Some(258),
        none: None,
        bytes: Array::from(vec![0, 127, 255]),
        pair: [-1, 1],
        levels: vec![Level::High { margin: -2.0 }, Level::Low],
    }
}

fn entry() -> ComponentEntry {
    ComponentEntry {
        name: "laser".into(),
        kind: "simulator".into(),
        instance: 0x0123_4567_89ab_cdef,
        pid: 4711,
        host: "robot".into(),
        endpoint: "127.0.0.1:20001".into(),
    }
}

fn hello() -> Hello {
    let link = LinkRequest {
        data: "laser.scan".into(),
        instance: 0x0123_4567_89ab_cdef,
        schema: String::new(),
        schema_hash: 0,
        keep: Keep::Last { count: 50 },
        wake: Wake::Sleep,
        paused: false,
        history: 1,
        memory: MemoryUse::Never,
        datagrams: false,
    };
    Hello::new("echo-12", 7, Purpose::Link { link })
}

fn preface() -> Preface {
    Preface::of_person("alice", KeyRole::Operator)
}

fn lookup() -> registry::RegistryRequest {
    registry::RegistryRequest::Lookup {
        request: 1,
        data: "laser.scan".into(),
        schema: String::new(),
        wait: true,
    }
}

fn found() -> registry::RegistryReply {
    let entry_of_data = DataEntry {
        data: "laser.scan".into(),
        type_name: "Count".into(),
        schema: "Count{count:u64}".into(),
        latched: false,
    };
    registry::RegistryReply::Found {
        request: 1,
        entry: entry_of_data,
        provider: entry(),
        key: None,
    }
}

fn welcome() -> Welcome {
    Welcome { name: "laser".into(), instance: 0x0123_4567_89ab_cdef, schema: "u8".into() }
}

fn refusal() -> Refusal {
    Refusal::new(RefusalCode::UnknownData, "no laser.scan here")
}

fn header() -> DataHeader {
    DataHeader { sequence: 3, stamp_s: 1.5, instance: 0x0123_4567_89ab_cdef, fresh: true }
}

fn parameter() -> config::ConfigReply {
    let assigned = config::Assigned {
        text: "10Hz".into(),
        base: "/srv".into(),
        origin: "rover.xml:4:7".into(),
    };
    config::ConfigReply::Parameter { request: 2, name: "rate".into(), assigned: Some(assigned) }
}

fn set() -> config::ConfigRequest {
    config::ConfigRequest::Set {
        request: 3,
        component: "driver".into(),
        parameter: "speed".into(),
        value: Some("1m/s".into()),
    }
}

fn was_set() -> config::ConfigReply {
    let change = config::ChangeRecord {
        subject: config::ChangeSubject::Parameter,
        name: "driver.speed".into(),
        change: config::ChangeKind::Changed,
        aspect: String::new(),
        before: "2m/s".into(),
        after: "1m/s".into(),
        text: "slower".into(),
        effect: "now".into(),
    };
    config::ConfigReply::Set { request: 3, version: 2, changes: vec![change], findings: vec![] }
}

fn report() -> control::Answer {
    let outcome = control::ReportKind::Event { name: "seen".into(), value: 0.25 };
    control::Answer::Report { report: 1, activation: 2, outcome }
}

fn activate() -> control::Command {
    let assigned = config::Assigned {
        text: "north".into(),
        base: "/srv".into(),
        origin: "rover.xml:9:59".into(),
    };
    let given = control::GivenParameter { name: "area".into(), assigned };
    control::Command::Activate { activation: 3, parameters: vec![given] }
}

fn order() -> control::Command {
    let order = control::Order::Fire { transition: "recall".into() };
    control::Command::Order { request: 9, author: "ruth@station".into(), take: false, order }
}

fn ordered() -> control::Answer {
    control::Answer::Ordered { request: 9, accepted: true, text: "recall fires".into() }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn framed<T: WireType>(kind: FrameKind, value: &T) -> String {
    hex(&frame::to_bytes(kind, value).expect("short"))
}

#[test]
fn the_golden_vectors_are_what_we_write() {
    let payload = codec::encode(&sample()).expect("short");
    let data = [&header().to_bytes(payload.len())[..], &payload].concat();
    check(
        "vector",
        [
            ("sample", hex(&payload)),
            ("beat", hex(&frame::signal(FrameKind::Beat))),
            ("data", hex(&data)),
            ("hello", framed(FrameKind::Hello, &hello())),
            ("welcome", framed(FrameKind::Welcome, &welcome())),
            ("refusal", framed(FrameKind::Refusal, &refusal())),
            ("preface", framed(FrameKind::Preface, &preface())),
            ("lookup", framed(FrameKind::Control, &lookup())),
            ("found", framed(FrameKind::Control, &found())),
            ("parameter", framed(FrameKind::Control, &parameter())),
            ("set", framed(FrameKind::Control, &set())),
            ("was-set", framed(FrameKind::Control, &was_set())),
            ("activate", framed(FrameKind::Control, &activate())),
            ("report", framed(FrameKind::Control, &report())),
            ("order", framed(FrameKind::Control, &order())),
            ("ordered", framed(FrameKind::Control, &ordered())),
        ],
    );
}

fn bytes_of(vector: &str) -> Vec<u8> {
    let text = &blocks("vector")[vector];
    let digits = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).expect("hexadecimal");
    (0..text.len()).step_by(2).map(digits).collect()
}

fn check_read<T>(vector: &str, kind: FrameKind, read: impl Fn(&Frame<'_>) -> T, expected: &T)
where
    T: PartialEq + Debug,
{
    let bytes = bytes_of(vector);
    let mut reader = FrameReader::new();
    reader.space()[..bytes.len()].copy_from_slice(&bytes);
    reader.filled(bytes.len());
    let frame = reader.next_frame().expect("well-formed").expect("whole");
    assert_eq!(frame.kind, kind);
    assert_eq!(read(&frame), *expected, "{vector}");
    assert!(!reader.is_mid_frame());
}

#[test]
fn the_golden_vectors_are_read_as_what_they_are() {
    fn body<T: WireType>(frame: &Frame<'_>) -> T {
        codec::decode_control(frame.body).expect("a value")
    }
    check_read("hello", FrameKind::Hello, |frame| Hello::read(frame).expect("a hello"), &hello());
    check_read("welcome", FrameKind::Welcome, body, &welcome());
    check_read("refusal", FrameKind::Refusal, body, &refusal());
    check_read("preface", FrameKind::Preface, body, &preface());
    check_read("lookup", FrameKind::Control, body, &lookup());
    check_read("found", FrameKind::Control, body, &found());
    check_read("parameter", FrameKind::Control, body, &parameter());
    check_read("set", FrameKind::Control, body, &set());
    check_read("was-set", FrameKind::Control, body, &was_set());
    check_read("activate", FrameKind::Control, body, &activate());
    check_read("report", FrameKind::Control, body, &report());
    check_read("order", FrameKind::Control, body, &order());
    check_read("ordered", FrameKind::Control, body, &ordered());
    let data = |frame: &Frame<'_>| {
        let (header, payload) = frame.data().expect("data");
        (header, codec::decode::<Sample>(payload).expect("a sample"))
    };
    check_read("data", FrameKind::Data, data, &(header(), sample()));
    check_read("beat", FrameKind::Beat, |frame| frame.body.len(), &0);
}

#[test]
fn the_sample_has_the_schema_hash_and_json_of_the_document() {
    let sample_schema = Sample::schema();
    let json = schema::to_json(&sample_schema, &bytes_of("sample")).expect("a sample");
    assert_eq!(blocks("text")["sample-schema"], sample_schema.to_string());
    assert_eq!(blocks("text")["sample-hash"], format!("{:016x}", sample_schema.hash()));
    let written: serde_json::Value =
        serde_json::from_str(&blocks("json")["sample"]).expect("JSON in docs/protocol.md");
    assert_eq!(written, json);
}

#[test]
fn the_limits_are_the_constants() {
    let limits = [
        ("MAX_HELLO_LEN", codec::MAX_HELLO_LEN),
        ("MAX_PREFACE_LEN", codec::MAX_PREFACE_LEN),
        ("MAX_CONTROL_LEN", codec::MAX_CONTROL_LEN),
        ("MAX_DATA_LEN", codec::MAX_DATA_LEN),
        ("DATAGRAM_LEN", armor_wire::datagram::DATAGRAM_LEN),
        ("MAX_DATAGRAM_MESSAGE", armor_wire::datagram::MAX_DATAGRAM_MESSAGE),
        ("MAX_RESENT", armor_wire::datagram::MAX_RESENT as usize),
        ("MAX_FROM_LEN", armor_wire::hello::MAX_FROM_LEN),
        ("MAX_NAME_LEN", armor_wire::name::MAX_NAME_LEN),
        ("MAX_TEXT_LEN", schema::MAX_TEXT_LEN),
        ("MAX_DEPTH", schema::MAX_DEPTH),
        ("MAX_LABEL_LEN", schema::MAX_LABEL_LEN),
        ("MAX_UNIT_LEN", schema::MAX_UNIT_LEN),
        ("MAX_FIXED_COUNT", armor_wire::message::MAX_FIXED_COUNT),
        ("MAX_AUTHOR_LEN", control::MAX_AUTHOR_LEN),
        ("MAX_ORDER_NAME_LEN", control::MAX_ORDER_NAME_LEN),
        ("MAX_MOVES", control::MAX_MOVES),
        ("MAX_RECORDS", config::MAX_RECORDS),
        ("MAX_RECORD_TEXT_LEN", config::MAX_RECORD_TEXT_LEN),
        ("MAX_KEEP", armor_wire::keep::MAX_KEEP as usize),
        ("BEAT", armor_wire::liveness::BEAT.as_millis() as usize),
        ("MISSED_BEATS", armor_wire::liveness::MISSED_BEATS as usize),
        ("SILENCE", armor_wire::liveness::SILENCE.as_millis() as usize),
        ("VERSION", VERSION.into()),
        ("DEFAULT_PORT", registry::DEFAULT_PORT.into()),
        ("GATE_PORT", gate::GATE_PORT.into()),
    ];
    let rows: BTreeMap<_, _> = DOCUMENT
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` | "))
        .filter(|(name, _)| name.bytes().all(|b| b.is_ascii_uppercase() || b == b'_'))
        .map(|(name, rest)| (name, rest.split(' ').next().unwrap_or_default().replace(',', "")))
        .collect();
    for (name, value) in limits {
        assert_eq!(rows.get(name), Some(&value.to_string()), "{name} in docs/protocol.md");
    }
    assert_eq!(rows.len(), limits.len(), "{:?}", rows.keys());
}
