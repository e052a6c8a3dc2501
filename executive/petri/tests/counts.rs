//! State spaces counted exactly: against the counts that the Model Checking Contest and TAPAAL
//! publish, and against plain enumeration on random nets.

use crate::data;
use armor_petri::analysis::boundedness::pumping_on_walks;
use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::rules::FiringRules;
use armor_petri::analysis::{
    AnalysisBudget, Exhausted, ExplorationEnd, StateExploration, explore_states,
};
use armor_petri::file::tina;
use armor_petri::{Net, PlaceId, TransitionId};
use proptest::prelude::*;
use std::collections::{HashMap, VecDeque};

fn explored(net: &Net) -> StateExploration {
    explore_states(net, &PlaceBounds::of_net(net, &|| false), true, &AnalysisBudget::UNLIMITED)
}

/// File, states, edges, most tokens in a place and in a marking, deadlocks.
type Published = (&'static str, u64, u64, u32, u64, Option<u64>);

fn check(&(name, states, edges, in_place, in_marking, deadlocks): &Published) {
    let Some(file) = data::net(name) else { return };
    let bounds = PlaceBounds::of_net(&file.net, &|| false);
    let StateExploration { space, ending } =
        explore_states(&file.net, &bounds, false, &AnalysisBudget::UNLIMITED);
    assert_eq!(ending, ExplorationEnd::Complete, "{name}");
    assert_eq!((space.states(), space.edges()), (states, edges), "{name}");
    assert_eq!(space.max_tokens_in_place(), in_place, "{name}");
    assert_eq!(space.max_tokens_per_marking(), in_marking, "{name}");
    assert_eq!(space.deadlocks(), deadlocks.unwrap_or(space.deadlocks()), "{name}");
}

#[test]
fn published_counts_are_met_exactly() {
    [
        ("untimed-test007-swimming-pool.pnml", 21, 34, 3, 5, Some(1)),
        ("untimed-test006-philosophers.pnml", 729, 3_402, 1, 12, Some(2)),
        ("HouseConstruction-00002.net", 1_501, 4_780, 2, 12, Some(1)),
        ("FMS2-untimed.pnml", 3_444, 16_311, 3, 12, Some(0)),
        ("Kanban2-test001.pnml", 4_600, 28_120, 2, 8, Some(0)),
        ("AirplaneLD-0010.net", 43_463, 183_664, 1, 38, Some(6_112)),
    ]
    .iter()
    .for_each(check);
}

#[test]
fn published_counts_of_millions_are_met_exactly() {
    if std::env::var_os("ARMOR_FULL").is_none() {
        eprintln!("skipped: ARMOR_FULL is not set");
        return;
    }
    check(&("Kanban-00005.net", 2_546_432, 24_460_016, 5, 20, Some(0)));
    check(&("Referendum-PT-0015.pnml", 14_348_908, 143_489_071, 1, 15, None));
}

/// The contest's FMS nets differ in their pallets alone.
fn fms(pallets: u32) -> Option<Net> {
    let mut text = tina::write(&data::net("FMS2-untimed.pnml")?).expect("a plain net");
    for place in ["P1", "P2", "P3"] {
        let two = format!("pl {place} (2)");
        assert!(text.contains(&two), "{text}");
        text = text.replace(&two, &format!("pl {place} ({pallets})"));
    }
    Some(tina::read(&text).expect("what was written").net)
}

#[test]
fn fms_with_more_pallets_has_its_published_states() {
    // 48,590 for three: Ciardo, Trivedi, 1993; the rest: the contest.
    let sizes = if std::env::var_os("ARMOR_FULL").is_some() { &[3, 5][..] } else { &[3] };
    for &pallets in sizes {
        let Some(net) = fms(pallets) else { return };
        let StateExploration { space, ending } = explored(&net);
        assert_eq!(ending, ExplorationEnd::Complete);
        match pallets {
            3 => assert_eq!(space.states(), 48_590),
            _ => assert_eq!(
                (
                    space.states(),
                    space.edges(),
                    space.max_tokens_in_place(),
                    space.max_tokens_per_marking()
                ),
                (2_895_018, 23_527_185, 5, 21)
            ),
        }
    }
}

/// The contest's Philosophers: each takes the fork at either hand first, then the other.
fn philosophers(count: usize) -> Net {
    let mut text = String::new();
    for own in 0..count {
        let other = (own + 1) % count;
        text += &format!(
            "pl Think{own} (1)\npl Fork{own} (1)\n\
             tr a{own} Think{own} Fork{own} -> First{own}\n\
             tr b{own} Think{own} Fork{other} -> Second{own}\n\
             tr c{own} First{own} Fork{other} -> Eat{own}\n\
             tr d{own} Second{own} Fork{own} -> Eat{own}\n\
             tr e{own} Eat{own} -> Think{own} Fork{own} Fork{other}\n"
        );
    }
    tina::read(&text).expect("a net").net
}

/// The contest's TokenRing: Dijkstra's self-stabilising ring, begun with all processes apart.
fn token_ring(count: usize) -> Net {
    let mut text = String::new();
    for value in 0..=count {
        let next = (value + 1) % (count + 1);
        text += &format!(
            "pl s{value}_{value} (1)\n\
             tr m{value} s0_{value} s{count}_{value} -> s0_{next} s{count}_{value}\n"
        );
    }
    for process in 1..=count {
        let left = process - 1;
        for (value, before) in (0..=count).flat_map(|v| (0..=count).map(move |b| (v, b))) {
            if value != before {
                text += &format!(
                    "tr t{process}_{value}_{before} s{process}_{value} s{left}_{before} \
                     -> s{process}_{before} s{left}_{before}\n"
                );
            }
        }
    }
    tina::read(&text).expect("a net").net
}

#[test]
fn models_of_the_contest_have_their_published_counts() {
    for (net, states, edges, tokens) in [
        (philosophers(5), 243, 945, 10),
        (token_ring(5), 166, 365, 6),
        (philosophers(10), 59_049, 459_270, 20),
        (token_ring(10), 58_905, 294_050, 11),
    ] {
        let StateExploration { space, ending } = explored(&net);
        assert_eq!(ending, ExplorationEnd::Complete);
        assert_eq!((space.states(), space.edges()), (states, edges));
        assert_eq!((space.max_tokens_in_place(), space.max_tokens_per_marking()), (1, tokens));
    }
}

#[test]
fn a_net_too_large_to_count_is_undecided_but_known_to_be_bounded() {
    let Some(file) = data::net("Kanban-PT-02000.pnml") else { return };
    let bounds = PlaceBounds::of_net(&file.net, &|| false);
    assert!((0..16).all(|place| bounds.of(place) == Some(2000)));
    let ended = |budget| explore_states(&file.net, &bounds, false, &budget).ending;
    let states = AnalysisBudget { states: 10_000, ..AnalysisBudget::UNLIMITED };
    assert_eq!(ended(states), ExplorationEnd::Undecided(Exhausted::States));
    let memory = AnalysisBudget { memory_bytes: 4 << 20, ..AnalysisBudget::UNLIMITED };
    assert_eq!(ended(memory), ExplorationEnd::Undecided(Exhausted::Memory));
    let asked = std::cell::Cell::new(0);
    let stop = || asked.replace(asked.get() + 1) >= 3;
    let time = AnalysisBudget { stop: &stop, ..AnalysisBudget::UNLIMITED };
    assert_eq!(ended(time), ExplorationEnd::Undecided(Exhausted::Time));
}

#[test]
fn a_budget_of_just_enough_states_is_enough() {
    let Some(file) = data::net("untimed-test006-philosophers.pnml") else { return };
    let bounds = PlaceBounds::of_net(&file.net, &|| false);
    let ended = |states| {
        explore_states(
            &file.net,
            &bounds,
            false,
            &AnalysisBudget { states, ..AnalysisBudget::UNLIMITED },
        )
        .ending
    };
    assert_eq!(ended(729), ExplorationEnd::Complete);
    assert_eq!(ended(728), ExplorationEnd::Undecided(Exhausted::States));
}

/// One place and one transition with the given arcs: tokens, and (kind, weight) of each arc.
fn small(tokens: u32, arcs: &[(char, u32)]) -> Net {
    let mut net = Net::builder();
    let p = net.place("p", tokens);
    let mut t = net.transition("t");
    for &(kind, weight) in arcs {
        t = match kind {
            'i' => t.input(p, weight),
            'o' => t.output(p, weight),
            'r' => t.read(p, weight),
            'h' => t.inhibitor(p, weight),
            _ => t.reset(p),
        };
    }
    net.build().expect("arcs within the net")
}

#[test]
fn every_kind_of_arc_affects_enabling() {
    let check = |tokens, arcs: &[(char, u32)], states, edges, most, deadlocks| {
        let StateExploration { space, ending } = explored(&small(tokens, arcs));
        assert_eq!(ending, ExplorationEnd::Complete, "{arcs:?}");
        let counts =
            (space.states(), space.edges(), space.max_tokens_in_place(), space.deadlocks());
        assert_eq!(counts, (states, edges, most, deadlocks), "{arcs:?}");
    };
    check(7, &[('i', 2)], 4, 3, 7, 1);
    check(7, &[('i', 2), ('r', 4)], 3, 2, 7, 1);
    check(7, &[('i', 1), ('o', 1)], 1, 1, 7, 0);
    check(1, &[('o', 1), ('h', 5)], 5, 4, 5, 1);
    check(1, &[('o', 1000), ('h', 5)], 2, 1, 1001, 1);
    check(3, &[('h', 3), ('o', 1)], 1, 0, 3, 1);
    check(7, &[('i', 2), ('x', 0)], 2, 1, 7, 1);
    check(7, &[('i', 2), ('x', 0), ('o', 3)], 2, 2, 7, 0);
    check(1, &[('i', 1), ('x', 0), ('o', 900)], 2, 2, 900, 0);
    check(u32::MAX, &[('i', u32::MAX)], 2, 1, u32::MAX, 1);
    check(0, &[], 1, 1, 0, 0);
}

#[test]
fn an_empty_net_is_a_net() {
    let empty = Net::builder().build().expect("nothing to be wrong");
    let StateExploration { space, ending } = explored(&empty);
    assert_eq!((ending, space.states(), space.edges()), (ExplorationEnd::Complete, 1, 0));
    assert_eq!((space.deadlocks(), space.max_tokens_in_place()), (1, 0));
    let mut net = Net::builder();
    net.place("p", 3);
    let net = net.build().expect("one place");
    let StateExploration { space, .. } = explored(&net);
    assert_eq!((space.states(), space.max_tokens_per_marking()), (1, 3));
}

#[test]
fn unbounded_growth_is_found_with_a_sequence_that_shows_it() {
    for arcs in
        [&[('o', 1)][..], &[('i', 1), ('o', 2)], &[('r', 1), ('o', 1)], &[('i', 2), ('o', 3)]]
    {
        let net = small(2, arcs);
        let pumping = pumping_on_walks(&net).expect("it grows immediately");
        assert_eq!((pumping.prefix.len(), pumping.cycle.len()), (0, 1), "{arcs:?}");
        assert!(matches!(explored(&net).ending, ExplorationEnd::Unbounded(_)), "{arcs:?}");
    }
    // A place that is emptied again and again does not grow, however often it is filled.
    assert_eq!(pumping_on_walks(&small(1, &[('x', 0), ('o', 5)])), None);
    // Nor does one whose own tokens hold its filling back.
    assert_eq!(pumping_on_walks(&small(1, &[('o', 1), ('h', 9)])), None);
}

#[test]
fn more_tokens_than_can_be_counted_are_undecided() {
    let net = small(4_000_000_000, &[('o', 1_000_000_000), ('h', 4_100_000_000)]);
    assert_eq!(explored(&net).ending, ExplorationEnd::Undecided(Exhausted::Tokens));
}

prop_compose! {
    fn any_net()(
        tokens in prop::collection::vec(0u32..4, 1..6),
        sketches in prop::collection::vec(prop::collection::vec((0u8..8, 0usize..6, 1u32..4), 1..6), 0..6),
    ) -> Net {
        let mut net = Net::builder();
        let places: Vec<_> =
            tokens.iter().enumerate().map(|(i, n)| net.place(format!("p{i}"), *n)).collect();
        for (index, arcs) in sketches.iter().enumerate() {
            let mut t = net.transition(format!("t{index}"));
            for &(kind, place, weight) in arcs {
                let place = places[place % places.len()];
                t = match kind {
                    0..=2 => t.input(place, weight),
                    3 | 4 => t.output(place, weight),
                    5 => t.read(place, weight),
                    6 => t.inhibitor(place, weight),
                    _ => t.reset(place),
                };
            }
        }
        net.build().expect("arcs within the net")
    }
}

/// States, edges, deadlocks, most in a place, most in a marking; `None` beyond so many states.
fn enumerated(net: &Net, limit: usize) -> Option<(u64, u64, u64, u32, u64)> {
    let mut known = HashMap::from([(net.initial().to_vec(), ())]);
    let mut waiting = VecDeque::from([net.initial().to_vec()]);
    let (mut edges, mut deadlocks, mut in_place, mut in_marking) = (0, 0, 0, 0);
    while let Some(marking) = waiting.pop_front() {
        in_place = in_place.max(marking.iter().copied().max().unwrap_or(0));
        in_marking = in_marking.max(marking.iter().map(|n| u64::from(*n)).sum());
        let mut firings = 0;
        for t in net.transitions() {
            let holds = |p: PlaceId| marking[p.index()];
            let enabled = t.inputs.iter().chain(&t.reads).all(|&(p, w)| holds(p) >= w)
                && t.inhibitors.iter().all(|&(p, w)| holds(p) < w);
            if !enabled {
                continue;
            }
            firings += 1;
            let mut after = marking.clone();
            t.inputs.iter().for_each(|&(p, w)| after[p.index()] -= w);
            t.resets.iter().for_each(|p| after[p.index()] = 0);
            t.outputs.iter().for_each(|&(p, w)| after[p.index()] += w);
            if known.insert(after.clone(), ()).is_none() {
                waiting.push_back(after);
            }
        }
        edges += firings;
        deadlocks += u64::from(firings == 0);
        if known.len() > limit {
            return None;
        }
    }
    Some((known.len() as u64, edges, deadlocks, in_place, in_marking))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_net_has_the_states_that_plain_enumeration_finds(net in any_net()) {
        const LIMIT: usize = 3000;
        let budget = AnalysisBudget { states: 2 * LIMIT as u64, ..AnalysisBudget::UNLIMITED };
        let bounds = PlaceBounds::of_net(&net, &|| false);
        let StateExploration { space, ending } = explore_states(&net, &bounds, true, &budget);
        let rules = FiringRules::new(&net);
        match (enumerated(&net, LIMIT), ending) {
            (Some(expected), ExplorationEnd::Complete) => {
                let counts = (space.states(), space.edges(), space.deadlocks(),
                    space.max_tokens_in_place(), space.max_tokens_per_marking());
                prop_assert_eq!(counts, expected);
                for place in 0..net.places().len() {
                    let most = u64::from(space.most_in(PlaceId(place as u32)));
                    prop_assert!(bounds.of(place).is_none_or(|bound| most <= bound));
                }
                let last = space.states() as u32 - 1;
                let path = space.path_to(last).expect("paths were requested");
                prop_assert_eq!(rules.play(net.initial(), &path), Some(space.marking(last)));
            }
            (Some(_), ending) => prop_assert!(false, "finite, and {ending:?}"),
            (None, ExplorationEnd::Complete) => prop_assert!(space.states() > LIMIT as u64),
            (None, ExplorationEnd::Unbounded(pumping)) => {
                let mut before = rules.play(net.initial(), &pumping.prefix).expect("firable");
                for _ in 0..50 {
                    let after = rules.play(&before, &pumping.cycle).expect("firable for ever");
                    for place in &pumping.growing {
                        prop_assert!(after[place.index()] > before[place.index()]);
                    }
                    before = after;
                }
            }
            (None, ExplorationEnd::Undecided(_)) => {}
        }
    }
}

#[test]
fn a_plain_net_that_grows_deep_inside_is_found_by_enumeration() {
    // A counter of 2^n firings before the growth begins hides it from short walks.
    let mut net = Net::builder();
    let bits: Vec<_> = (0..9)
        .map(|i| (net.place(format!("zero{i}"), 1), net.place(format!("one{i}"), 0)))
        .collect();
    for i in 0..bits.len() {
        let mut t = net.transition(format!("carry{i}"));
        for (zero, one) in &bits[..i] {
            t = t.input(*one, 1).output(*zero, 1);
        }
        t.input(bits[i].0, 1).output(bits[i].1, 1);
    }
    let heap = net.place("heap", 0);
    let mut t = net.transition("grow");
    for (_, one) in &bits {
        t = t.read(*one, 1);
    }
    let grow: TransitionId = t.output(heap, 1).id();
    let net = net.build().expect("a counter");
    let ExplorationEnd::Unbounded(pumping) = explored(&net).ending else { panic!("it grows") };
    assert_eq!((pumping.prefix.len(), &pumping.cycle[..]), (511, &[grow][..]));
}
