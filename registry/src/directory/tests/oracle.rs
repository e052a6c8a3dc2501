//! Random conversations against a model that is simple because it is slow: no answer is lost or
//! given twice, none goes to a connection that has ended, and watchers see exactly the registered
//! processes, and nothing is left of those that went.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;

use super::*;

const NAMES: [&str; 3] = ["a", "b", "c"];

#[derive(Clone, Debug)]
enum Op {
    /// As which name and instance; an observer without.
    Connect(Option<(usize, u64)>),
    Close(usize),
    /// Output of which component, from which connection, with which schema.
    Provide(usize, usize, bool),
    Withdraw(usize, usize),
    Lookup {
        who: usize,
        name: usize,
        float: Option<bool>,
        wait: bool,
    },
    Cancel(usize, u64),
    Watch(usize),
    List(usize),
    Pass(u64),
}

fn op() -> impl Strategy<Value = Op> {
    let who = 0..6_usize;
    let name = 0..NAMES.len();
    prop_oneof![
        4 => proptest::option::of((name.clone(), 1..4_u64)).prop_map(Op::Connect),
        2 => who.clone().prop_map(Op::Close),
        4 => (name.clone(), who.clone(), any::<bool>()).prop_map(|(n, w, f)| Op::Provide(n, w, f)),
        1 => (name.clone(), who.clone()).prop_map(|(n, w)| Op::Withdraw(n, w)),
        6 => (who.clone(), name, any::<Option<bool>>(), any::<bool>())
            .prop_map(|(who, name, float, wait)| Op::Lookup { who, name, float, wait }),
        1 => (who.clone(), 0..40_u64).prop_map(|(w, r)| Op::Cancel(w, r)),
        1 => who.clone().prop_map(Op::Watch),
        1 => who.prop_map(Op::List),
        1 => (1..2000_u64).prop_map(Op::Pass),
    ]
}

fn schema(float: bool) -> String {
    if float { f64::schema().to_string() } else { u8::schema().to_string() }
}

/// What the answer to a lookup must be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Answer {
    Found,
    Mismatch,
    Unknown,
}

struct Peer {
    id: PeerId,
    entry: Option<(String, u64)>,
    heard: Duration,
    /// What it knows from watching; `None` if it does not watch.
    sees: Option<BTreeSet<String>>,
}

#[derive(Default)]
struct Model {
    /// Open connections, in the order in which they came.
    peers: Vec<Peer>,
    /// Who provides it, and as a float or not.
    data: BTreeMap<String, (PeerId, bool)>,
    pending: Vec<(PeerId, u64, String, Option<bool>)>,
    next_request: u64,
}

impl Model {
    fn peer(&self, who: usize) -> Option<&Peer> {
        (!self.peers.is_empty()).then(|| &self.peers[who % self.peers.len()])
    }

    fn drop_peer(&mut self, id: PeerId) {
        self.peers.retain(|peer| peer.id != id);
        self.data.retain(|_, (holder, _)| *holder != id);
        self.pending.retain(|(asker, ..)| *asker != id);
    }

    fn answer(&self, data: &str, float: Option<bool>) -> Option<Answer> {
        let (_, is_float) = self.data.get(data)?;
        Some(if float.is_none_or(|f| f == *is_float) { Answer::Found } else { Answer::Mismatch })
    }

    /// Checks actions against the model's answers, and follows the watchers.
    fn check(
        &mut self,
        actions: &[PeerAction<RegistryReply>],
        mut due: Vec<(PeerId, u64, Answer)>,
    ) {
        for action in actions {
            let PeerAction::Send { peer, message } = action else { continue };
            let Some(known) = self.peers.iter_mut().find(|known| known.id == *peer) else {
                panic!("{message:?} goes to {peer:?}, which is not there")
            };
            let answered = match message {
                RegistryReply::Found { request, .. } => (*peer, *request, Answer::Found),
                RegistryReply::Refused { request, refusal } => match refusal.code {
                    RefusalCode::TypeMismatch => (*peer, *request, Answer::Mismatch),
                    RefusalCode::UnknownData => (*peer, *request, Answer::Unknown),
                    _ => continue,
                },
                RegistryReply::Appeared { entry } => {
                    let seen = known.sees.as_mut().expect("it watches");
                    assert!(seen.insert(entry.name.clone()), "{entry:?} appears twice");
                    continue;
                }
                RegistryReply::Gone { entry } => {
                    let seen = known.sees.as_mut().expect("it watches");
                    assert!(seen.remove(&entry.name), "{entry:?} goes but was not there");
                    continue;
                }
                _ => continue,
            };
            let at = due.iter().position(|one| *one == answered);
            due.remove(at.unwrap_or_else(|| panic!("{answered:?} was not to be answered")));
        }
        assert!(due.is_empty(), "not answered: {due:?}");
        let present: BTreeSet<_> =
            self.peers.iter().filter_map(|peer| Some(peer.entry.clone()?.0)).collect();
        for sees in self.peers.iter().filter_map(|peer| peer.sees.as_ref()) {
            assert_eq!(*sees, present);
        }
    }
}

/// Plays one step on both; the directory must do what the model does.
fn step(bench: &mut Bench, model: &mut Model, op: Op) {
    let model_client = |model: &mut Model, who: usize, now: Duration| {
        let len = model.peers.len();
        (len > 0).then(|| {
            let peer = &mut model.peers[who % len];
            peer.heard = now;
            peer.id
        })
    };
    match op {
        Op::Connect(None) => {
            let id = bench.observer();
            model.peers.push(Peer { id, entry: None, heard: bench.now, sees: None });
        }
        Op::Connect(Some((name, instance))) => connect(bench, model, NAMES[name], instance),
        Op::Close(who) => {
            let Some(id) = model.peer(who).map(|peer| peer.id) else { return };
            let actions = bench.close(id);
            model.drop_peer(id);
            model.check(&actions, Vec::new());
        }
        Op::Provide(name, who, float) => {
            let Some(id) = model_client(model, who, bench.now) else { return };
            let data = format!("{}.x", NAMES[name]);
            let is_own = model
                .peers
                .iter()
                .any(|p| p.id == id && p.entry.as_ref().is_some_and(|e| e.0 == NAMES[name]));
            let is_new = is_own && !model.data.contains_key(&data);
            let mut due = Vec::new();
            if is_new {
                model.data.insert(data.clone(), (id, float));
                let (waited, rest) = std::mem::take(&mut model.pending)
                    .into_iter()
                    .partition::<Vec<_>, _>(|(_, _, wanted, _)| *wanted == data);
                model.pending = rest;
                due.extend(waited.into_iter().map(|(asker, request, wanted, float)| {
                    (asker, request, model.answer(&wanted, float).expect("it is there now"))
                }));
            }
            let entry = DataEntry { schema: schema(float), ..super::data(&data) };
            let actions = bench.provide(id, entry);
            let provided =
                PeerAction::Send { peer: id, message: RegistryReply::Provided { request: 1 } };
            assert_eq!(actions.contains(&provided), is_new);
            model.check(&actions, due);
        }
        Op::Withdraw(name, who) => {
            let Some(id) = model_client(model, who, bench.now) else { return };
            let data = format!("{}.x", NAMES[name]);
            if model.data.get(&data).is_some_and(|(holder, _)| *holder == id) {
                model.data.remove(&data);
            }
            let actions = bench.send_request(id, RegistryRequest::Withdraw { data });
            model.check(&actions, Vec::new());
        }
        Op::Lookup { who, name, float, wait } => {
            let Some(id) = model_client(model, who, bench.now) else { return };
            let data = format!("{}.x", NAMES[name]);
            model.next_request += 1;
            let request = model.next_request;
            let due = match model.answer(&data, float) {
                Some(answer) => vec![(id, request, answer)],
                None if wait => {
                    model.pending.push((id, request, data.clone(), float));
                    Vec::new()
                }
                None => vec![(id, request, Answer::Unknown)],
            };
            let schema = float.map(schema).unwrap_or_default();
            let actions =
                bench.send_request(id, RegistryRequest::Lookup { request, data, schema, wait });
            model.check(&actions, due);
        }
        Op::Cancel(who, request) => {
            let Some(id) = model_client(model, who, bench.now) else { return };
            model.pending.retain(|(asker, r, ..)| (*asker, *r) != (id, request));
            let actions = bench.send_request(id, RegistryRequest::Cancel { request });
            model.check(&actions, Vec::new());
        }
        Op::Watch(who) => {
            let Some(id) = model_client(model, who, bench.now) else { return };
            let peer = model.peers.iter_mut().find(|peer| peer.id == id).expect("just found");
            peer.sees.get_or_insert_default();
            let actions = bench.send_request(id, RegistryRequest::Watch);
            model.check(&actions, Vec::new());
        }
        Op::List(who) => {
            let Some(id) = model_client(model, who, bench.now) else { return };
            let mut present: Vec<_> =
                model.peers.iter().filter_map(|peer| Some(peer.entry.clone()?.0)).collect();
            present.sort();
            let actions = bench.send_request(id, RegistryRequest::List { request: 1 });
            let [
                PeerAction::Send {
                    message: RegistryReply::Listing { components, data, .. }, ..
                },
            ] = &actions[..]
            else {
                panic!("no listing: {actions:?}")
            };
            assert!(components.iter().map(|c| &c.name).eq(&present));
            assert!(data.iter().map(|d| &d.data).eq(model.data.keys()));
        }
        Op::Pass(ms) => bench.now += Duration::from_millis(ms),
    }
}

fn connect(bench: &mut Bench, model: &mut Model, name: &str, instance: u64) {
    let (id, actions) = bench.register(&ComponentEntry { instance, ..entry(name) });
    let holder = model.peers.iter().find(|p| p.entry.as_ref().is_some_and(|e| e.0 == name));
    let gives_way = |holder: &Peer| {
        holder.entry.as_ref().is_some_and(|e| e.1 == instance)
            || bench.now - holder.heard >= GIVE_UP
    };
    let is_admitted = holder.is_none_or(gives_way);
    let is_welcome =
        actions.iter().any(|a| matches!(a, PeerAction::Welcome { peer, .. } if *peer == id));
    assert_eq!(is_welcome, is_admitted);
    if is_admitted {
        if let Some(old) = holder.map(|holder| holder.id) {
            model.drop_peer(old);
            assert!(
                actions.iter().any(|a| matches!(a, PeerAction::Close { peer, .. } if *peer == old))
            );
        }
        let entry = Some((name.to_owned(), instance));
        model.peers.push(Peer { id, entry, heard: bench.now, sees: None });
    }
    model.check(&actions, Vec::new());
}

proptest! {
    #[test]
    fn the_directory_is_the_model(ops in proptest::collection::vec(op(), 1..120)) {
        let mut bench = Bench::new();
        let mut model = Model::default();
        for op in ops {
            step(&mut bench, &mut model, op);
        }
        while !model.peers.is_empty() {
            step(&mut bench, &mut model, Op::Close(0));
        }
        let RegistryDirectory { clients, holders, data, lookups, .. } = &bench.directory;
        prop_assert!(clients.is_empty() && holders.is_empty());
        prop_assert!(data.is_empty() && lookups.is_empty());
    }
}
