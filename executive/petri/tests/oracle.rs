//! Random nets with random firings, compared with an oracle that recomputes everything each time.

use armor_petri::{FiringClass, FiringInterval, Net, NetState, PlaceId, TransitionId};
use proptest::prelude::*;
use std::sync::Arc;
use std::time::Duration;

const PLACES: u32 = 5;

#[derive(Clone, Debug)]
struct Sketch {
    arcs: Vec<(u8, u32, u32)>,
    safety: bool,
    priority: i32,
    earliest_s: u64,
    slack_s: Option<u64>,
    gated: bool,
}

#[derive(Clone, Debug)]
enum Deed {
    Fire(usize),
    FirstReady,
    Pass(u64),
    Gate(usize, bool),
    Add(u32),
    Remove(u32),
    TakeThenPutAfter(usize, u64),
    Clear,
    Hold,
    Release,
}

fn sketch() -> impl Strategy<Value = Sketch> {
    let arcs = prop::collection::vec((0u8..6, 0..PLACES, 1u32..3), 0..6);
    (arcs, any::<bool>(), -1i32..2, 0u64..3, prop::option::of(0u64..3), prop::bool::weighted(0.2))
        .prop_map(|(arcs, safety, priority, earliest_s, slack_s, gated)| Sketch {
            arcs,
            safety,
            priority,
            earliest_s,
            slack_s,
            gated,
        })
}

fn deed() -> impl Strategy<Value = Deed> {
    prop_oneof![
        3 => (0usize..8).prop_map(Deed::Fire),
        4 => Just(Deed::FirstReady),
        3 => (0u64..3).prop_map(Deed::Pass),
        2 => ((0usize..8), any::<bool>()).prop_map(|(t, open)| Deed::Gate(t, open)),
        2 => (0..PLACES).prop_map(Deed::Add),
        1 => (0..PLACES).prop_map(Deed::Remove),
        2 => (0usize..8, 0u64..3).prop_map(|(t, s)| Deed::TakeThenPutAfter(t, s)),
        1 => Just(Deed::Clear),
        1 => Just(Deed::Hold),
        1 => Just(Deed::Release),
    ]
}

fn net_of(sketches: &[Sketch], tokens: &[u32]) -> Net {
    let mut net = Net::builder();
    for (index, tokens) in tokens.iter().enumerate() {
        net.place(format!("p{index}"), *tokens);
    }
    for (index, sketch) in sketches.iter().enumerate() {
        let earliest = Duration::from_secs(sketch.earliest_s);
        let latest = sketch.slack_s.map(|slack| earliest + Duration::from_secs(slack));
        let mut t = net
            .transition(format!("t{index}"))
            .priority(sketch.priority)
            .class(if sketch.safety { FiringClass::Safety } else { FiringClass::Ordinary })
            .interval(FiringInterval { earliest, latest });
        for &(kind, place, weight) in &sketch.arcs {
            let place = PlaceId(place);
            t = match kind {
                0 | 1 => t.input(place, weight),
                2 => t.output(place, weight),
                3 => t.read(place, weight),
                4 => t.inhibitor(place, weight + 1),
                _ => t.reset(place),
            };
        }
        if sketch.gated {
            t.gated();
        }
    }
    net.build().expect("arcs within the net")
}

/// The rules written down once more, with no memory but marking, gates and clocks.
struct Oracle {
    net: Arc<Net>,
    now: Duration,
    marking: Vec<u32>,
    open: Vec<bool>,
    since: Vec<Option<Duration>>,
    held: Option<Duration>,
}

impl Oracle {
    fn new(net: Arc<Net>) -> Self {
        let mut oracle = Self {
            now: Duration::ZERO,
            marking: net.initial().to_vec(),
            open: vec![false; net.transitions().len()],
            since: vec![None; net.transitions().len()],
            held: None,
            net,
        };
        oracle.look();
        oracle
    }

    fn has_concession(&self, id: TransitionId) -> bool {
        let t = self.net.transition(id);
        let tokens = |place: PlaceId| self.marking[place.index()];
        t.inputs.iter().all(|&(p, w)| tokens(p) >= w)
            && t.reads.iter().all(|&(p, w)| tokens(p) >= w)
            && t.inhibitors.iter().all(|&(p, w)| tokens(p) < w)
            && (!t.gated || self.open[id.index()])
    }

    fn look(&mut self) {
        for id in self.net.transition_ids() {
            let clock = self.since[id.index()];
            let start = self.held.filter(|_| !self.runs(id)).unwrap_or(self.now);
            self.since[id.index()] = self.has_concession(id).then(|| clock.unwrap_or(start));
        }
    }

    /// Whether its clock runs if it is enabled.
    fn runs(&self, id: TransitionId) -> bool {
        self.held.is_none() || self.net.transition(id).class == FiringClass::Safety
    }

    fn release(&mut self) {
        for id in self.net.transition_ids().filter(|id| !self.runs(*id)).collect::<Vec<_>>() {
            let stood = self.now - self.held.expect("a clock that stands is held");
            self.since[id.index()] = self.since[id.index()].map(|since| since + stood);
        }
        self.held = None;
    }

    fn ready(&self) -> Vec<TransitionId> {
        let terms = |id: &TransitionId| {
            let since = self.since[id.index()]?;
            let t = self.net.transition(*id);
            let deadline = t.interval.latest.map_or(Duration::MAX, |latest| since + latest);
            let may = self.runs(*id) && since + t.interval.earliest <= self.now;
            may.then_some((t.class, std::cmp::Reverse(t.priority), deadline, *id))
        };
        let mut ready: Vec<_> = self.net.transition_ids().filter_map(|id| terms(&id)).collect();
        ready.sort();
        ready.into_iter().map(|turn| turn.3).collect()
    }

    fn set(&mut self, place: PlaceId, tokens: u32) {
        self.marking[place.index()] = tokens;
        self.look();
    }

    fn take(&mut self, id: TransitionId) {
        let net = Arc::clone(&self.net);
        for &(place, weight) in &net.transition(id).inputs {
            self.marking[place.index()] -= weight;
        }
        for &place in &net.transition(id).resets {
            self.marking[place.index()] = 0;
        }
        self.since[id.index()] = None;
        self.look();
    }

    fn put(&mut self, id: TransitionId) {
        let net = Arc::clone(&self.net);
        for &(place, weight) in &net.transition(id).outputs {
            self.set(place, self.marking[place.index()] + weight);
        }
    }
}

fn play(state: &mut NetState, oracle: &mut Oracle, deed: &Deed) {
    let count = oracle.net.transitions().len();
    let id = |t: usize| TransitionId((t % count) as u32);
    match *deed {
        Deed::Fire(t) => {
            let fired = state.fire(id(t)).is_ok();
            assert_eq!(fired, oracle.ready().contains(&id(t)));
            if fired {
                oracle.take(id(t));
                oracle.put(id(t));
            }
        }
        Deed::FirstReady => {
            if let Some(t) = state.first_ready() {
                play(state, oracle, &Deed::Fire(t.index()));
            }
        }
        Deed::Pass(seconds) => {
            oracle.now += Duration::from_secs(seconds);
            state.advance(oracle.now);
        }
        Deed::Gate(t, open) => {
            oracle.open[t % count] = open && oracle.net.transition(id(t)).gated;
            state.set_gate(id(t), open);
            oracle.look();
        }
        Deed::Add(place) => {
            state.add(PlaceId(place), 1).expect("few tokens");
            oracle.set(PlaceId(place), oracle.marking[place as usize] + 1);
        }
        Deed::Remove(place) => {
            let removed = state.remove(PlaceId(place), 1).is_ok();
            assert_eq!(removed, oracle.marking[place as usize] > 0);
            if removed {
                oracle.set(PlaceId(place), oracle.marking[place as usize] - 1);
            }
        }
        Deed::TakeThenPutAfter(t, seconds) => {
            if state.take(id(t)).is_ok() {
                oracle.take(id(t));
                play(state, oracle, &Deed::Pass(seconds));
                for &(place, weight) in &Arc::clone(state.net()).transition(id(t)).outputs {
                    state.add(place, weight).expect("few tokens");
                }
                oracle.put(id(t));
            }
        }
        Deed::Clear => {
            state.clear();
            oracle.marking.fill(0);
            oracle.look();
        }
        Deed::Hold => {
            state.hold();
            oracle.held = oracle.held.or(Some(oracle.now));
        }
        Deed::Release => {
            state.release();
            oracle.release();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn the_incremental_state_equals_the_oracles(
        sketches in prop::collection::vec(sketch(), 1..8),
        tokens in prop::collection::vec(0u32..3, PLACES as usize),
        deeds in prop::collection::vec(deed(), 0..60),
    ) {
        let net = Arc::new(net_of(&sketches, &tokens));
        let mut state = NetState::new(Arc::clone(&net), Duration::ZERO);
        let mut oracle = Oracle::new(Arc::clone(&net));
        for deed in &deeds {
            play(&mut state, &mut oracle, deed);
            prop_assert_eq!(state.marking(), &oracle.marking[..]);
            prop_assert_eq!(state.ready().collect::<Vec<_>>(), oracle.ready());
            let since: Vec<_> = net.transition_ids().map(|id| state.enabled_since(id)).collect();
            prop_assert_eq!(&since, &oracle.since);
            let next = oracle.ready().first().map(|_| oracle.now).or_else(|| {
                let at = |id: TransitionId| {
                    Some(oracle.since[id.index()]? + net.transition(id).interval.earliest)
                };
                net.transition_ids().filter(|id| oracle.runs(*id)).filter_map(at).min()
            });
            prop_assert_eq!(state.next_firing(), next);
            prop_assert_eq!(state.held_since(), oracle.held);
        }
    }
}
