//! The state machine in memory, with time by hand.

mod names;
mod oracle;
mod readers;

use std::sync::LazyLock;

use armor_wire::WireType;
use armor_wire::peer::CloseReason;

use super::*;
use crate::limits::{MAX_SCHEMA_LEN, MAX_WAITING_PER_CONNECTION};

const ADDRESS: ([u8; 4], u16) = ([127, 0, 0, 1], 40_000);

/// That of a run.
static SECRET: LazyLock<RunSecret> = LazyLock::new(|| RunSecret::new([3; 16]));

/// A directory, its clock, and the next connection's id.
struct Bench {
    directory: RegistryDirectory,
    now: Duration,
    peers: u64,
}

impl Bench {
    fn new() -> Self {
        Self {
            directory: RegistryDirectory::new(99, 1000.0),
            now: Duration::from_secs(5),
            peers: 0,
        }
    }

    fn handle(&mut self, event: PeerEvent<RegistryRequest>) -> Actions {
        self.directory.handle(event, self.now)
    }

    fn hello(&mut self, purpose: Purpose) -> (PeerId, Actions) {
        self.peers += 1;
        let (peer, address) = (PeerId(self.peers), ADDRESS.into());
        let hello = Hello::new("tool-7", 1, purpose);
        (peer, self.handle(PeerEvent::Connected { peer, address, hello, preface: None }))
    }

    fn observer(&mut self) -> PeerId {
        self.hello(Purpose::Registry { entry: None }).0
    }

    /// As a process that the launcher has started, or the launcher itself.
    fn hello_proven(&mut self, from: &str, entry: Option<ComponentEntry>) -> (PeerId, Actions) {
        self.peers += 1;
        let (peer, address) = (PeerId(self.peers), ADDRESS.into());
        let mut hello = Hello::new(from, 1, Purpose::Registry { entry });
        SECRET.key_of(from).prove(&mut hello);
        (peer, self.handle(PeerEvent::Connected { peer, address, hello, preface: None }))
    }

    fn register(&mut self, entry: &ComponentEntry) -> (PeerId, Actions) {
        self.hello(Purpose::Registry { entry: Some(entry.clone()) })
    }

    fn component(&mut self, name: &str) -> PeerId {
        let (peer, actions) = self.register(&entry(name));
        assert!(matches!(actions[..], [PeerAction::Welcome { .. }, ..]), "{actions:?}");
        peer
    }

    fn refused(&mut self, entry: &ComponentEntry) -> Refusal {
        match self.register(entry).1.as_slice() {
            [PeerAction::Refuse { refusal, .. }] => refusal.clone(),
            other => panic!("not refused: {other:?}"),
        }
    }

    fn send_request(&mut self, peer: PeerId, message: RegistryRequest) -> Actions {
        self.handle(PeerEvent::Message { peer, arrived: self.now, message })
    }

    fn provide(&mut self, peer: PeerId, entry: DataEntry) -> Actions {
        self.send_request(peer, RegistryRequest::Provide { request: 1, entry })
    }

    fn lookup(&mut self, peer: PeerId, request: u64, data: &str, wait: bool) -> Actions {
        self.send_request(
            peer,
            RegistryRequest::Lookup { request, data: data.into(), schema: float(), wait },
        )
    }

    fn close(&mut self, peer: PeerId) -> Actions {
        self.handle(PeerEvent::Closed { peer, reason: CloseReason::Ended })
    }
}

fn entry(name: &str) -> ComponentEntry {
    ComponentEntry {
        name: name.into(),
        kind: "test".into(),
        instance: 7,
        pid: 4242,
        host: "robot".into(),
        endpoint: "127.0.0.1:4000".into(),
    }
}

fn float() -> String {
    f64::schema().to_string()
}

fn data(name: &str) -> DataEntry {
    DataEntry { data: name.into(), type_name: "Number".into(), schema: float(), latched: true }
}

fn found(peer: PeerId, request: u64, name: &str) -> PeerAction<RegistryReply> {
    let provider = entry(name.split('.').next().unwrap());
    PeerAction::Send {
        peer,
        message: RegistryReply::Found { request, entry: data(name), provider, key: None },
    }
}

fn refusal(actions: &[PeerAction<RegistryReply>]) -> &Refusal {
    match actions {
        [PeerAction::Send { message: RegistryReply::Refused { refusal, .. }, .. }] => refusal,
        other => panic!("not one refusal: {other:?}"),
    }
}

#[test]
fn a_lookup_finds_what_is_there_and_waits_for_what_is_not() {
    let mut bench = Bench::new();
    let (lidar, mapper) = (bench.component("lidar"), bench.component("mapper"));
    assert!(bench.lookup(mapper, 5, "lidar.scan", true).is_empty());
    let provided =
        PeerAction::Send { peer: lidar, message: RegistryReply::Provided { request: 1 } };
    let actions = bench.provide(lidar, data("lidar.scan"));
    assert_eq!(actions, [provided, found(mapper, 5, "lidar.scan")]);
    assert_eq!(bench.lookup(mapper, 6, "lidar.scan", false), [found(mapper, 6, "lidar.scan")]);
}

#[test]
fn a_cancelled_lookup_is_not_answered() {
    let mut bench = Bench::new();
    let (lidar, mapper) = (bench.component("lidar"), bench.component("mapper"));
    bench.lookup(mapper, 5, "lidar.scan", true);
    bench.send_request(mapper, RegistryRequest::Cancel { request: 5 });
    assert_eq!(bench.provide(lidar, data("lidar.scan")).len(), 1);
}

#[test]
fn a_lookup_of_nothing_names_what_is_near() {
    let mut bench = Bench::new();
    let (lidar, mapper) = (bench.component("lidar"), bench.component("mapper"));
    bench.provide(lidar, data("lidar.scan"));
    let actions = bench.lookup(mapper, 5, "lidar.scam", false);
    let refusal = refusal(&actions);
    assert_eq!(refusal.code, RefusalCode::UnknownData);
    assert!(refusal.text.contains("`lidar.scan`"), "{refusal}");
    assert!(refusal.text.contains("has no such output"), "{refusal}");
}

#[test]
fn a_mismatch_is_refused_immediately_or_after_waiting_and_names_both_sides() {
    let mut bench = Bench::new();
    let (lidar, mapper) = (bench.component("lidar"), bench.component("mapper"));
    let wanted = |request| RegistryRequest::Lookup {
        request,
        data: "lidar.scan".into(),
        schema: u8::schema().to_string(),
        wait: true,
    };
    assert!(bench.send_request(mapper, wanted(1)).is_empty());
    let late = bench.provide(lidar, data("lidar.scan"));
    let early = bench.send_request(mapper, wanted(2));
    for actions in [&late[1..], &early[..]] {
        let refusal = refusal(actions);
        assert_eq!(refusal.code, RefusalCode::TypeMismatch);
        let sides = ["mapper has u8", "lidar has f64", "127.0.0.1:4000"];
        assert!(sides.iter().all(|side| refusal.text.contains(side)), "{refusal}");
    }
}

#[test]
fn a_duplicate_is_refused_with_the_holders_whereabouts() {
    let mut bench = Bench::new();
    bench.component("lidar");
    let refusal = bench.refused(&ComponentEntry { instance: 8, ..entry("lidar") });
    assert_eq!(refusal.code, RefusalCode::DuplicateName);
    let whereabouts = ["`lidar`", "kind test", "process 4242 on robot", "127.0.0.1:4000"];
    assert!(whereabouts.iter().all(|part| refusal.text.contains(part)), "{refusal}");
}

#[test]
fn a_holder_gives_way_to_its_own_process_and_to_others_once_it_is_silent() {
    let mut bench = Bench::new();
    let watcher = bench.observer();
    bench.send_request(watcher, RegistryRequest::Watch);
    let first = bench.component("lidar");
    bench.provide(first, data("lidar.scan"));
    let (second, actions) = bench.register(&entry("lidar"));
    assert!(actions.iter().any(|a| matches!(a, PeerAction::Close { peer, .. } if *peer == first)));
    let sent: Vec<_> = actions.iter().filter(|a| matches!(a, PeerAction::Send { .. })).collect();
    assert!(matches!(
        sent[..],
        [
            PeerAction::Send { message: RegistryReply::Gone { .. }, .. },
            PeerAction::Send { message: RegistryReply::Appeared { .. }, .. }
        ]
    ));
    assert_eq!(bench.provide(second, data("lidar.scan")).len(), 1, "the old output is gone");

    let stranger = ComponentEntry { instance: 8, ..entry("lidar") };
    bench.now += GIVE_UP - Duration::from_millis(1);
    bench.refused(&stranger);
    bench.handle(PeerEvent::Beat { peer: second });
    bench.now += Duration::from_millis(1);
    bench.refused(&stranger);
    bench.now += GIVE_UP;
    let (_, actions) = bench.register(&stranger);
    assert!(actions.iter().any(|a| matches!(a, PeerAction::Close { peer, .. } if *peer == second)));
}

#[test]
fn all_of_a_connection_goes_with_it() {
    let mut bench = Bench::new();
    let (lidar, mapper, watcher) =
        (bench.component("lidar"), bench.component("mapper"), bench.observer());
    bench.provide(lidar, data("lidar.scan"));
    bench.lookup(lidar, 3, "mapper.map", true);
    bench.send_request(watcher, RegistryRequest::Watch);
    let gone =
        PeerAction::Send { peer: watcher, message: RegistryReply::Gone { entry: entry("lidar") } };
    assert_eq!(bench.close(lidar), [gone]);
    let unknown = bench.lookup(mapper, 4, "lidar.scan", false);
    assert_eq!(refusal(&unknown).code, RefusalCode::UnknownData);
    let provided =
        PeerAction::Send { peer: mapper, message: RegistryReply::Provided { request: 1 } };
    assert_eq!(bench.provide(mapper, data("mapper.map")), [provided], "no lookup waits any more");
    bench.component("lidar");
}

#[test]
fn a_watcher_is_notified_of_the_present_processes_first_and_once() {
    let mut bench = Bench::new();
    bench.component("lidar");
    let watcher = bench.observer();
    let appeared = |name| {
        let message = RegistryReply::Appeared { entry: entry(name) };
        [PeerAction::Send { peer: watcher, message }]
    };
    assert_eq!(bench.send_request(watcher, RegistryRequest::Watch), appeared("lidar"));
    assert!(bench.send_request(watcher, RegistryRequest::Watch).is_empty());
    assert_eq!(bench.register(&entry("mapper")).1[1..], appeared("mapper"));
}

#[test]
fn time_is_the_start_plus_what_has_passed() {
    let mut bench = Bench::new();
    let peer = bench.observer();
    let arrived = bench.now;
    bench.now += Duration::from_millis(500);
    let message = RegistryRequest::Time { asked_s: 3.0 };
    let actions = bench.handle(PeerEvent::Message { peer, arrived, message });
    let message = RegistryReply::Time { asked_s: 3.0, received_s: 1005.0, sent_s: 1005.5 };
    assert_eq!(actions, [PeerAction::Send { peer, message }]);
}

#[test]
fn only_what_is_well_formed_is_registered() {
    let mut bench = Bench::new();
    for bad in [
        entry("9lives"),
        entry(""),
        entry(&"x".repeat(65)),
        entry("configd"),
        ComponentEntry { kind: "a b".into(), ..entry("lidar") },
        ComponentEntry { endpoint: "robot".into(), ..entry("lidar") },
        ComponentEntry { host: "a\nb".into(), ..entry("lidar") },
        ComponentEntry { instance: 0, ..entry("lidar") },
    ] {
        assert_eq!(bench.refused(&bad).code, RefusalCode::Malformed, "{bad:?}");
    }
    let (_, actions) =
        bench.register(&ComponentEntry { kind: "configd".into(), ..entry("configd") });
    assert!(matches!(actions[..], [PeerAction::Welcome { .. }]));
    let (_, actions) = bench.hello(Purpose::Config);
    assert!(
        matches!(&actions[..], [PeerAction::Refuse { refusal, .. }] if refusal.code == RefusalCode::WrongPurpose)
    );
}

#[test]
fn only_own_well_formed_data_is_provided_and_once() {
    use RefusalCode::{DuplicateName, Limit, Malformed, WrongPurpose};
    let mut bench = Bench::new();
    let (lidar, tool) = (bench.component("lidar"), bench.observer());
    bench.provide(lidar, data("lidar.scan"));
    let long = " ".repeat(MAX_SCHEMA_LEN + 1);
    for (peer, bad, code) in [
        (lidar, data("lidar.scan"), DuplicateName),
        (lidar, data("lidar."), Malformed),
        (lidar, data("lidar2.scan"), Malformed),
        (lidar, data("mapper.map"), Malformed),
        (lidar, DataEntry { schema: "nonsense".into(), ..data("lidar.b") }, Malformed),
        (lidar, DataEntry { schema: long, ..data("lidar.b") }, Limit),
        (lidar, DataEntry { schema: "Any{}".into(), ..data("lidar.b") }, Malformed),
        (lidar, DataEntry { type_name: String::new(), ..data("lidar.b") }, Malformed),
        (tool, data("lidar.b"), WrongPurpose),
    ] {
        assert_eq!(refusal(&bench.provide(peer, bad)).code, code);
    }
    bench.send_request(tool, RegistryRequest::Withdraw { data: "lidar.scan".into() });
    assert_eq!(bench.lookup(tool, 1, "lidar.scan", false), [found(tool, 1, "lidar.scan")]);
    bench.send_request(lidar, RegistryRequest::Withdraw { data: "lidar.scan".into() });
    assert_eq!(refusal(&bench.lookup(tool, 1, "lidar.scan", false)).code, RefusalCode::UnknownData);
}

#[test]
fn a_process_is_looked_up_by_its_name_by_however_many() {
    let mut bench = Bench::new();
    let found = |actions: &Actions| match &actions[..] {
        [
            PeerAction::Send {
                peer,
                message: RegistryReply::Found { request, entry, provider, .. },
            },
        ] => {
            assert_eq!((entry.data.as_str(), entry.schema.as_str()), ("configd", ""));
            (*peer, *request, provider.name.clone())
        }
        other => panic!("not found: {other:?}"),
    };
    let askers: Vec<_> = (0..2 * MAX_WATCHERS).map(|_| bench.observer()).collect();
    for asker in &askers {
        assert!(bench.lookup(*asker, 5, "configd", true).is_empty());
    }
    assert_eq!(
        refusal(&bench.lookup(askers[0], 6, "configd", false)).code,
        RefusalCode::UnknownData
    );
    let configd = ComponentEntry { kind: "configd".into(), ..entry("configd") };
    let (peer, actions) = bench.register(&configd);
    assert_eq!(actions.len(), 1 + askers.len(), "a welcome and the answers");
    for (asker, answer) in askers.iter().zip(&actions[1..]) {
        assert_eq!(found(&vec![answer.clone()]), (*asker, 5, "configd".into()));
    }
    for wait in [false, true] {
        assert_eq!(found(&bench.lookup(askers[0], 7, "configd", wait)).1, 7, "immediately");
    }
    bench.close(peer);
    assert!(bench.lookup(askers[0], 8, "configd", true).is_empty(), "not the one that is gone");
    assert_eq!(refusal(&bench.lookup(askers[0], 9, "no name", true)).code, RefusalCode::Malformed);
}

#[test]
fn every_table_has_an_end() {
    let mut bench = Bench::new();
    let lidar = bench.component("lidar");
    for n in 0..MAX_DATA_PER_COMPONENT {
        let actions = bench.provide(lidar, data(&format!("lidar.d{n}")));
        assert!(matches!(
            actions[..],
            [PeerAction::Send { message: RegistryReply::Provided { .. }, .. }]
        ));
    }
    assert_eq!(refusal(&bench.provide(lidar, data("lidar.more"))).code, RefusalCode::Limit);

    for n in 0..MAX_WAITING_PER_CONNECTION {
        assert!(bench.lookup(lidar, n as u64, "unknown.nothing", true).is_empty());
    }
    let actions = bench.lookup(lidar, 100_000, "unknown.nothing", true);
    assert_eq!(refusal(&actions).code, RefusalCode::Limit);

    let watchers: Vec<_> = (0..=MAX_WATCHERS).map(|_| bench.observer()).collect();
    for (n, watcher) in watchers.into_iter().enumerate() {
        let actions = bench.send_request(watcher, RegistryRequest::Watch);
        let is_closed = matches!(actions[..], [PeerAction::Close { .. }]);
        assert_eq!(is_closed, n == MAX_WATCHERS);
    }

    for n in 1..MAX_COMPONENTS {
        bench.component(&format!("c{n}"));
    }
    assert_eq!(bench.refused(&entry("more")).code, RefusalCode::Limit);
}

#[test]
fn a_listing_too_long_for_a_frame_goes_without_schemas_or_not_at_all() {
    let mut bench = Bench::new();
    let fields: Vec<_> = (0..1000).map(|n| format!("x{n}:f64")).collect();
    let schema = format!("Wide{{{}}}", fields.join(","));
    let lidar = bench.component("lidar");
    let list = |bench: &mut Bench, outputs: usize| {
        for _ in 0..outputs {
            bench.peers += 1;
            let name = format!("lidar.d{}", bench.peers);
            bench.provide(lidar, DataEntry { schema: schema.clone(), ..data(&name) });
        }
        match bench.send_request(lidar, RegistryRequest::List { request: 1 }).pop() {
            Some(PeerAction::Send { message, .. }) => {
                assert!(encoded_len(&message).unwrap() <= MAX_LISTING_LEN);
                message
            }
            other => panic!("no answer: {other:?}"),
        }
    };
    let RegistryReply::Listing { data, .. } = list(&mut bench, 5) else { panic!("no listing") };
    assert!(data.len() == 5 && data.iter().all(|entry| entry.schema == schema));
    let RegistryReply::Listing { data, .. } = list(&mut bench, 95) else { panic!("no listing") };
    assert!(data.len() == 100 && data.iter().all(|entry| entry.schema.is_empty()));
    for n in 1..MAX_COMPONENTS {
        let (kind, host) = ("k".repeat(64), "h".repeat(255));
        bench.register(&ComponentEntry { kind, host, ..entry(&format!("c{n}")) });
    }
    let RegistryReply::Refused { refusal, .. } = list(&mut bench, 0) else { panic!("a listing") };
    assert_eq!(refusal.code, RefusalCode::Limit);
}
