//! Hundreds of thousands of random and damaged inputs, from a fixed seed, on everything that reads
//! a stranger's bytes: nothing panics, and a short input takes little memory.
//!
//! `HOSTILE_SEED` and `HOSTILE_INPUTS` choose others; `fuzz/` runs for hours. The inputs that it keeps run
//! first.

mod entry;
#[path = "../../../fuzz/kept_corpus.rs"]
mod kept_corpus;

use std::alloc::System;

use armor_wire::acting::{KeyRole, Preface};
use armor_wire::control::{Answer, Command, ReportKind};
use armor_wire::frame::{DataHeader, FrameKind, signal, to_bytes};
use armor_wire::gate::GateRequest;
use armor_wire::hello::{Hello, LinkRequest, Purpose, Refusal, RefusalCode};
use armor_wire::keep::{Keep, Wake};
use armor_wire::message::WireType;
use armor_wire::registry::{ComponentEntry, DataEntry, RegistryReply, RegistryRequest};
use armor_wire::remote_process::{
    CutOff, HostAddress, OutputStream, ProcessResources, RemoteEvent, RemoteStart, Takeover,
    VariableSetting,
};
use armor_wire::shared_memory::MemoryUse;
use armor_wire::transport::Transport;
use armor_wire::{codec, config};
use cap::Cap;

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// Memory that a stream of frames may take whatever its length: the first buffers of two readers.
const FRAMES_LEN: usize = 3 << 20;
/// Memory that anything else may take whatever the input: a buffer for the longest hello.
const FIXED_LEN: usize = 80 << 10;
/// Memory per byte of input, over all that is read from it; JSON takes most: an object of a name
/// and a value for a byte that may be a field of its own.
const LEN_PER_BYTE: usize = 2 << 10;
/// Memory per byte of input when it is decoded as each of ten types.
const LEN_PER_CONTROL_BYTE: usize = 16;

fn component() -> ComponentEntry {
    let endpoint = "127.0.0.1:20001".into();
    let (name, kind, host) = ("laser".into(), "simulator".into(), "robot".into());
    ComponentEntry { name, kind, instance: 9, pid: 4711, host, endpoint }
}

/// Well-formed inputs to damage, each with the reader that it is for: values, frames, schema texts, and
/// payloads with their schema.
fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    type Seeds = Vec<(&'static str, Vec<u8>)>;
    fn add<T: WireType>(seeds: &mut Seeds, kind: FrameKind, value: &T) {
        let body = codec::encode(value).expect("short");
        let schema = T::schema().to_string();
        seeds.push(("json", [schema.as_bytes(), &[0], &body].concat()));
        seeds.push(("schema", schema.into()));
        let frame = to_bytes(kind, value).expect("short");
        let stream = [&[3], &frame[..], &signal(FrameKind::Beat), &frame].concat();
        seeds.push(("frames", stream));
        seeds.push(("hello", frame));
        seeds.push(("control", body));
    }
    let link = LinkRequest {
        data: "laser.scan".into(),
        instance: 9,
        schema: "[f32]".into(),
        schema_hash: 5,
        keep: Keep::Last { count: 50 },
        wake: Wake::Spin,
        paused: true,
        history: 5,
        memory: MemoryUse::Large,
        datagrams: true,
    };
    let schema = "Count{count:u64}".into();
    let entry = DataEntry { data: "a.b".into(), type_name: "Count".into(), schema, latched: true };
    let listing = RegistryReply::Listing {
        request: 1,
        components: vec![component(); 3],
        data: vec![entry.clone(); 4],
    };
    let refusal = Refusal::new(RefusalCode::Limit, "too many");
    let settings = config::ComponentSettings {
        rate_hz: Some(10.0),
        inputs: vec![config::InputSettings {
            id: "scan".into(),
            data: "laser.scan".into(),
            keep: Keep::ALL,
            wake: Wake::Sleep,
            transport: Transport::Tcp,
            history: 10,
        }],
        ..Default::default()
    };
    let outcome = ReportKind::Failed { reason: "no".into() };
    let mut seeds = Seeds::new();
    let registered = Purpose::Registry { entry: Some(component()) };
    add(&mut seeds, FrameKind::Hello, &Hello::new("a", 1, Purpose::Link { link }));
    add(&mut seeds, FrameKind::Hello, &Hello::new("laser", 9, registered));
    add(&mut seeds, FrameKind::Refusal, &refusal);
    add(&mut seeds, FrameKind::Control, &listing);
    add(&mut seeds, FrameKind::Control, &RegistryRequest::Provide { request: 1, entry });
    add(&mut seeds, FrameKind::Control, &config::ConfigReply::Settings { request: 1, settings });
    add(&mut seeds, FrameKind::Control, &Command::Status { request: 8 });
    add(&mut seeds, FrameKind::Control, &Answer::Report { report: 1, activation: 2, outcome });
    let preface = Preface::of_person("alice", KeyRole::Operator);
    add(&mut seeds, FrameKind::Preface, &preface);
    let observer = Hello::new("tool-1", 1, Purpose::Registry { entry: None });
    let frames = [
        to_bytes(FrameKind::Preface, &preface).expect("short"),
        to_bytes(FrameKind::Hello, &observer).expect("short"),
    ];
    seeds.push(("opening", frames.concat()));
    let address = "127.0.0.1:20001".into();
    add(&mut seeds, FrameKind::Control, &GateRequest::Connect { address, acts_for: Some(preface) });
    add(&mut seeds, FrameKind::Control, &remote_start());
    add(&mut seeds, FrameKind::Control, &GateRequest::Clock);
    let event = RemoteEvent::Output { stream: OutputStream::Error, bytes: b"line\n".to_vec() };
    add(&mut seeds, FrameKind::Control, &event);
    let header = DataHeader { sequence: 1, stamp_s: 2.0, instance: 3, fresh: true };
    seeds.push(("frames", [&[200], &header.to_bytes(4)[..], b"data"].concat()));
    for text in ["[[[?u8]]]", "S{a:[E<A,B{x:[string]}>],b:[[f64;3];3]}", "2.5m/s", "10min"] {
        seeds.push(("schema", text.into()));
        seeds.push(("json", [text.as_bytes(), &[0; 40]].concat()));
    }
    seeds
}

fn remote_start() -> GateRequest {
    let setting = VariableSetting { name: "ARMOR_HEADLESS".into(), value: "1".into() };
    let host = HostAddress { host: "base".into(), addresses: vec!["10.0.0.3:7410".into()] };
    let resources = ProcessResources { nice: Some(-5), cpus: vec![0, 3], ..Default::default() };
    let start = RemoteStart {
        system: "rover".into(),
        run: 7,
        component: "gripper".into(),
        kind: "arm".into(),
        components: vec!["gripper".into()],
        manifest: 8,
        build: "00".repeat(32),
        executable_len: 9,
        variables: vec!["MAP_TOKEN".into()],
        settings: vec![setting],
        resources,
        cut_off: CutOff::Stop,
        is_commanded: true,
        hosts: vec![host],
        gate_port: 7410,
        takeover: Takeover::Only { process: 3 },
    };
    GateRequest::Run { start }
}

/// Damages `input` in one to eight places: bytes, lengths, cuts, repetitions, splices.
fn damage(input: &mut Vec<u8>, seeds: &[Vec<u8>], random: &mut fastrand::Rng) {
    for _ in 0..=random.usize(..8) {
        let at = random.usize(..=input.len());
        match random.usize(..8) {
            0 => input.truncate(at),
            1 => input.insert(at, random.u8(..)),
            2 if at < input.len() => drop(input.remove(at)),
            3 => {
                let piece: Vec<_> = input[at..].iter().copied().take(random.usize(..40)).collect();
                input.splice(at..at, piece.iter().copied().cycle().take(piece.len() * 5));
            }
            4 => {
                let other = &seeds[random.usize(..seeds.len())];
                input.truncate(at);
                input.extend(&other[random.usize(..other.len().max(1))..]);
            }
            5 if at + 8 <= input.len() => {
                let lie = [u64::MAX, 1 << 40, 1 << 20, 255, 0][random.usize(..5)];
                input[at..at + 8].copy_from_slice(&lie.to_le_bytes());
            }
            6 if at < input.len() => input[at] = b"[]{}<>?;,:()0aEu8\n"[random.usize(..18)],
            _ if at < input.len() => input[at] ^= 1 << random.usize(..8),
            _ => {}
        }
    }
    input.truncate(4096);
}

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Damaged inputs that are kept of each reader, next to the well-formed ones.
const KEPT_DAMAGED: usize = 24;
/// Longest of these, in bytes: a short one shows a fault better.
const KEPT_LEN: usize = 200;

/// What `fuzz/corpus` keeps of a reader.
fn make_corpus(reader: &str) -> Vec<Vec<u8>> {
    let all: Vec<Vec<u8>> = seeds().into_iter().map(|(_, seed)| seed).collect();
    let own = seeds().into_iter().filter(|(own, _)| *own == reader);
    let mut corpus: Vec<Vec<u8>> = own.map(|(_, seed)| seed).collect();
    let (mut random, well_formed) = (fastrand::Rng::with_seed(0x5eed), corpus.clone());
    let mut tries = 0;
    while corpus.len() < well_formed.len() + KEPT_DAMAGED && tries < 10_000 {
        tries += 1;
        let mut input = well_formed[random.usize(..well_formed.len())].clone();
        damage(&mut input, &all, &mut random);
        if input.len() <= KEPT_LEN {
            corpus.push(input);
        }
    }
    corpus
}

// One test, so that the memory of no other test is counted.
#[test]
fn damaged_input_neither_panics_nor_takes_much_memory() {
    let seed = from_environment("HOSTILE_SEED", 0x5eed);
    let inputs = from_environment("HOSTILE_INPUTS", 100_000);
    println!(
        "HOSTILE_SEED={seed} HOSTILE_INPUTS={inputs}, each to {} readers",
        entry::ENTRIES.len()
    );
    for (name, run) in entry::ENTRIES {
        kept_corpus::run_corpus(name, run, || make_corpus(name));
    }
    let seeds: Vec<Vec<u8>> = seeds().into_iter().map(|(_, seed)| seed).collect();
    let mut random = fastrand::Rng::with_seed(seed);
    let (mut worst, mut most) = (0, 0);
    for round in 0..inputs {
        let mut input = seeds[random.usize(..seeds.len())].clone();
        // The undamaged ones first: they show that the bounds are not met by refusing everything.
        match usize::try_from(round).ok().and_then(|round| seeds.get(round)) {
            Some(seed) => input.clone_from(seed),
            None if round % 16 == 0 => {
                input = (0..random.usize(..300)).map(|_| random.u8(..)).collect();
            }
            None => damage(&mut input, &seeds, &mut random),
        }
        for (name, run) in entry::ENTRIES {
            let before = MEMORY.total_allocated();
            run(&input);
            let taken = MEMORY.total_allocated() - before;
            let fixed = if name == "frames" { FRAMES_LEN } else { FIXED_LEN };
            let allowed = fixed + LEN_PER_BYTE * input.len();
            assert!(taken <= allowed, "{name}: {taken} bytes for {input:?}");
            most = most.max(taken);
        }
        let before = MEMORY.total_allocated();
        decode_all(&input);
        let taken = MEMORY.total_allocated() - before;
        assert!(taken <= LEN_PER_CONTROL_BYTE * (input.len() + 100), "{taken} bytes for {input:?}");
        worst = worst.max(taken / (input.len() + 100));
    }
    println!("most memory for one input {most} bytes; to decode it as ten types {worst} per byte");
}

/// Decodes only: without JSON the bound is tight.
fn decode_all(bytes: &[u8]) {
    let _ = codec::decode_control::<Hello>(bytes);
    let _ = codec::decode_control::<armor_wire::hello::Welcome>(bytes);
    let _ = codec::decode_control::<Refusal>(bytes);
    let _ = codec::decode_control::<RegistryRequest>(bytes);
    let _ = codec::decode_control::<RegistryReply>(bytes);
    let _ = codec::decode_control::<config::ConfigRequest>(bytes);
    let _ = codec::decode_control::<config::ConfigReply>(bytes);
    let _ = codec::decode_control::<Command>(bytes);
    let _ = codec::decode_control::<Answer>(bytes);
    // Lists in lists, and items far larger in memory than on the wire.
    let _ = codec::decode::<Vec<Vec<Vec<String>>>>(bytes);
}
