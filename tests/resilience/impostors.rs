//! A peer that is not the intended one receives no data, and its data is not accepted: another
//! process start on the same port, or a process with another type under the same name.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use armor_wire::codec::decode_control;
use armor_wire::frame::{DataHeader, FrameKind, FrameReader, signal, to_bytes};
use armor_wire::hello::{Hello, LinkRequest, Purpose, Refusal, RefusalCode, Welcome};
use armor_wire::keep::{Keep, Wake};
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryRequest};
use armor_wire::schema;
use armor_wire::shared_memory::MemoryUse;

use super::system::Draft;
use crate::fixture::{DEADLINE, Folder, free_port, wait_for};

const ANSWER_WITHIN: Duration = Duration::from_secs(10);
/// Schema of the type `Numbered` in another build.
const OTHER: &str = "Numbered{count:f64,bulk:[u8]}";
/// The process start that registers as the ghost.
const GHOST: u64 = 0x6057;

/// Connects with a hello and reads the first answer.
fn answer(address: SocketAddr, purpose: Purpose) -> (TcpStream, FrameKind, Vec<u8>) {
    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    let hello = to_bytes(FrameKind::Hello, &Hello::new("stranger", GHOST, purpose));
    stream.write_all(&hello.expect("it fits")).expect("it listens");
    let (kind, body) = read_frame(&mut stream).expect("an answer");
    (stream, kind, body)
}

fn read_frame(stream: &mut TcpStream) -> Option<(FrameKind, Vec<u8>)> {
    let mut reader = FrameReader::new();
    loop {
        if let Some(frame) = reader.next_frame().expect("frames") {
            return Some((frame.kind, frame.body.to_vec()));
        }
        let len = stream.read(reader.space()).ok().filter(|len| *len > 0)?;
        reader.filled(len);
    }
}

fn request(data: &str, instance: u64, schema: &str) -> Purpose {
    let (schema_hash, schema) = (schema::hash_text(schema), schema.to_owned());
    let (keep, wake, data) = (Keep::Latest, Wake::Sleep, data.into());
    let link = LinkRequest {
        data,
        instance,
        schema,
        schema_hash,
        keep,
        wake,
        paused: false,
        history: 1,
        memory: MemoryUse::Large,
        datagrams: false,
    };
    Purpose::Link { link }
}

#[test]
fn a_request_for_another_process_start_or_type_gets_no_data() {
    let system = Draft::default().probe("source", "rate='100Hz'", "").run(Folder::new("asking"));
    let found = wait_for("the source", || {
        system.directory.find_provider("source.numbers", ANSWER_WITHIN).ok()
    });
    let (instance, ours) = (found.provider.instance, found.entry.schema.as_str());
    let address = found.provider.endpoint.parse().expect("an address");
    let refused = [
        (request("source.numbers", instance ^ 1, ours), RefusalCode::WrongInstance),
        (request("source.numbers", instance, OTHER), RefusalCode::TypeMismatch),
        (request("ghost.numbers", instance, ours), RefusalCode::UnknownData),
    ];
    for (purpose, code) in refused {
        let (mut stream, kind, body) = answer(address, purpose);
        assert_eq!(kind, FrameKind::Refusal, "{code:?}");
        let refusal: Refusal = decode_control(&body).expect("a refusal");
        assert_eq!(refusal.code, code, "{refusal}");
        if code == RefusalCode::TypeMismatch {
            let text = refusal.text;
            assert!(["count", "u64", "f64"].iter().all(|part| text.contains(part)), "{text}");
        }
        assert_eq!(read_frame(&mut stream), None, "closed, without a byte of data");
    }
    let (mut stream, kind, _) = answer(address, request("source.numbers", instance, ours));
    assert_eq!(kind, FrameKind::Welcome, "who asks rightly is served");
    assert_eq!(read_frame(&mut stream).map(|(kind, _)| kind), Some(FrameKind::Data));
}

#[test]
fn a_stranger_that_asks_for_everything_is_not_waited_for() {
    let system = Draft::default().probe("source", "rate='100Hz'", "").run(Folder::new("greedy"));
    let found = wait_for("the source", || {
        system.directory.find_provider("source.numbers", ANSWER_WITHIN).ok()
    });
    let address = found.provider.endpoint.parse().expect("an address");
    let everything = || {
        let asked = request("source.numbers", found.provider.instance, &found.entry.schema);
        let Purpose::Link { link } = asked else { unreachable!("it asks for a link") };
        Purpose::Link { link: LinkRequest { keep: Keep::ALL, ..link } }
    };
    // The registry does not know it. Once the source has been connected to the registry for some
    // seconds, that ends its link, and the next one gets the newest few.
    wait_for("a link with the newest few", || {
        let (mut link, kind, _) = answer(address, everything());
        assert_eq!(kind, FrameKind::Welcome);
        let keep = wait_for("the link", || {
            let status = system.status("source");
            let link = status.outputs[0].links.iter().find(|link| link.to == "stranger");
            link.map(|link| link.keep)
        });
        if keep == (Keep::Last { count: 16 }) {
            return Some(());
        }
        while read_frame(&mut link).is_some() {}
        None
    });
}

/// The ghost's answer to a subscriber. The counts that it sends start at the discriminant, so that
/// received data shows its origin.
#[derive(Clone, Copy)]
enum Answer {
    OtherInstance = 1000,
    OtherType = 2000,
    AsMeant = 3000,
}

/// A listener that answers for the component `ghost`, as other software on a reused port would.
struct Ghost {
    answer: Arc<Mutex<Answer>>,
    subscribers: Arc<AtomicUsize>,
    address: SocketAddr,
}

impl Ghost {
    /// Listens on a port below the ephemeral range, so that no connecting socket takes it.
    fn haunt(schema: String) -> Self {
        let bound = || TcpListener::bind(("127.0.0.1", free_port())).ok();
        let listener = wait_for("a free port", bound);
        let ghost = Self {
            answer: Arc::new(Mutex::new(Answer::OtherInstance)),
            subscribers: Arc::default(),
            address: listener.local_addr().expect("it listens"),
        };
        let (answer, subscribers) = (ghost.answer.clone(), ghost.subscribers.clone());
        std::thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let answer = *answer.lock().unwrap_or_else(PoisonError::into_inner);
                let schema = schema.clone();
                std::thread::spawn(move || deceive(stream, answer, schema));
                subscribers.fetch_add(1, Ordering::SeqCst);
            }
        });
        ghost
    }

    fn change(&self, answer: Answer) {
        *self.answer.lock().unwrap_or_else(PoisonError::into_inner) = answer;
        self.subscribers.store(0, Ordering::SeqCst);
    }

    fn is_tried(&self, times: usize) {
        wait_for("subscribers", || {
            (self.subscribers.load(Ordering::SeqCst) >= times).then_some(())
        });
    }
}

/// Welcomes one subscriber and sends it data until it leaves.
fn deceive(mut stream: TcpStream, answer: Answer, schema: String) {
    if !matches!(read_frame(&mut stream), Some((FrameKind::Hello, _))) {
        return;
    }
    let (instance, schema) = match answer {
        Answer::OtherInstance => (GHOST ^ 1, schema),
        Answer::OtherType => (GHOST, OTHER.to_owned()),
        Answer::AsMeant => (GHOST, schema),
    };
    let welcome = Welcome { name: "ghost".into(), instance, schema };
    let mut bytes = to_bytes(FrameKind::Welcome, &welcome).expect("it fits");
    for sequence in 0.. {
        let header = DataHeader { sequence, stamp_s: 0.0, instance, fresh: false };
        bytes.extend(header.to_bytes(16));
        bytes.extend((answer as u64 + sequence).to_le_bytes());
        bytes.extend([0; 8]);
        if stream.write_all(&bytes).is_err() {
            return;
        }
        bytes.clear();
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Registers the ghost as the provider of `ghost.numbers` at `address`, and keeps the connection
/// alive.
fn register(registry: SocketAddr, address: SocketAddr, schema: &str) {
    let entry = ComponentEntry {
        name: "ghost".into(),
        kind: "probe".into(),
        instance: GHOST,
        pid: std::process::id(),
        host: "here".into(),
        endpoint: address.to_string(),
    };
    let (mut stream, kind, _) = answer(registry, Purpose::Registry { entry: Some(entry) });
    assert_eq!(kind, FrameKind::Welcome);
    let entry = DataEntry {
        data: "ghost.numbers".into(),
        type_name: "Numbered".into(),
        schema: schema.into(),
        latched: false,
    };
    let provide = to_bytes(FrameKind::Control, &RegistryRequest::Provide { request: 1, entry });
    stream.write_all(&provide.expect("it fits")).expect("it listens");
    std::thread::spawn(move || {
        while stream.write_all(&signal(FrameKind::Beat)).is_ok() {
            std::thread::sleep(Duration::from_millis(300));
        }
    });
}

#[test]
fn an_answer_of_another_process_start_or_type_gives_no_data() {
    let system = Draft::default().probe("source", "", "").run(Folder::new("answering"));
    let found = wait_for("the source", || {
        system.directory.find_provider("source.numbers", ANSWER_WITHIN).ok()
    });
    let schema = found.entry.schema;
    let ghost = Ghost::haunt(schema.clone());
    register(system.registry, ghost.address, &schema);
    let _sink = system.by_hand(&[
        "--name",
        "sink",
        "--alone",
        "--link",
        "a=ghost.numbers",
        "--set",
        "trace=sink.trace",
    ]);
    for answer in [Answer::OtherInstance, Answer::OtherType] {
        ghost.change(answer);
        // The sink connects again, so it has closed the previous connections.
        ghost.is_tried(4);
        assert_eq!(system.trace("sink").got("a"), [], "taken from {}", answer as u64);
        let status = system.status("sink");
        println!("{}", status.inputs[0].problem);
        assert!(!status.inputs[0].problem.is_empty(), "and it reports the reason");
    }
    ghost.change(Answer::AsMeant);
    let got = system.traced("sink", "data", |trace| trace.got("a").into_iter().next());
    assert!(got.count >= Answer::AsMeant as u64, "{got:?}");
}
