//! The reduced search finds every deadlock that the full one finds.

use crate::data;
use armor_petri::analysis::invariants::PlaceBounds;
use armor_petri::analysis::rules::FiringRules;
use armor_petri::analysis::stubborn::find_deadlocks;
use armor_petri::analysis::{AnalysisBudget, ExplorationEnd, explore_states};
use armor_petri::{Net, PlaceId};
use proptest::prelude::*;

fn agrees(net: &Net) -> Option<(u64, u64)> {
    let bounds = PlaceBounds::of_net(net, &|| false);
    let budget = AnalysisBudget { states: 20_000, ..AnalysisBudget::UNLIMITED };
    let full = explore_states(net, &bounds, false, &budget);
    let reduced = find_deadlocks(net, &bounds, &budget).ok()??;
    if full.ending != ExplorationEnd::Complete {
        return None;
    }
    assert_eq!(reduced.deadlocks, full.space.deadlocks());
    assert!(reduced.states <= full.space.states());
    if let Some((path, marking)) = &reduced.first {
        assert_eq!(FiringRules::new(net).play(net.initial(), path).as_ref(), Some(marking));
    }
    Some((reduced.states, full.space.states()))
}

#[test]
fn philosophers_starve_after_a_part_of_their_states() {
    let Some(file) = data::net("untimed-test006-philosophers.pnml") else { return };
    let (reduced, full) = agrees(&file.net).expect("its bounds are known");
    assert!(reduced < full, "{reduced} of {full}");
}

#[test]
fn independent_transitions_fire_in_one_order_only() {
    let mut net = Net::builder();
    for i in 0..40 {
        let (p, q) = (net.place(format!("p{i}"), 1), net.place(format!("q{i}"), 0));
        net.transition(format!("t{i}")).input(p, 1).output(q, 1);
    }
    let net = net.build().expect("forty walkers");
    let bounds = PlaceBounds::of_net(&net, &|| false);
    let found = find_deadlocks(&net, &bounds, &AnalysisBudget::UNLIMITED)
        .expect("no budget")
        .expect("plain");
    assert_eq!((found.deadlocks, found.states), (1, 41), "of a trillion");
}

#[test]
fn firings_that_do_not_commute_are_left_to_the_full_search() {
    let mut net = Net::builder();
    let p = net.place("p", 1);
    net.transition("t").input(p, 1).inhibitor(p, 2);
    let net = net.build().expect("one place");
    let bounds = PlaceBounds::of_net(&net, &|| false);
    assert_eq!(find_deadlocks(&net, &bounds, &AnalysisBudget::UNLIMITED), Ok(None));
}

prop_compose! {
    /// Mostly conservative, so that bounds are known: each transition puts about what it takes.
    fn any_net()(
        tokens in prop::collection::vec(0u32..3, 2..7),
        sketches in prop::collection::vec((
            prop::collection::vec((0usize..7, 0usize..7, 1u32..3), 1..3),
            prop::option::of((0usize..7, 1u32..3)),
        ), 1..8),
    ) -> Net {
        let mut net = Net::builder();
        let places: Vec<_> =
            tokens.iter().enumerate().map(|(i, n)| net.place(format!("p{i}"), *n)).collect();
        let place = |index: usize| -> PlaceId { places[index % places.len()] };
        for (index, (moves, read)) in sketches.iter().enumerate() {
            let mut t = net.transition(format!("t{index}"));
            for &(from, to, weight) in moves {
                t = t.input(place(from), weight).output(place(to), weight);
            }
            if let Some((at, weight)) = read {
                t.read(place(*at), *weight);
            }
        }
        net.build().expect("arcs within the net")
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn every_deadlock_is_found(net in any_net()) {
        agrees(&net);
    }
}
