//! The reduced search finds every deadlock that the full one finds.

mod data;

use armor_petri::analysis::invariants::Bounds;
use armor_petri::analysis::rules::Rules;
use armor_petri::analysis::stubborn::deadlocks;
use armor_petri::analysis::{Budget, Ending, explore};
use armor_petri::{Net, PlaceId};
use proptest::prelude::*;

fn agrees(net: &Net) -> Option<(u64, u64)> {
    let bounds = Bounds::of_net(net, &|| false);
    let budget = Budget { states: 20_000, ..Budget::UNLIMITED };
    let full = explore(net, &bounds, false, &budget);
    let reduced = deadlocks(net, &bounds, &budget).ok()??;
    if full.ending != Ending::Complete {
        return None;
    }
    assert_eq!(reduced.deadlocks, full.space.deadlocks());
    assert!(reduced.states <= full.space.states());
    if let Some((way, marking)) = &reduced.first {
        assert_eq!(Rules::new(net).play(net.initial(), way).as_ref(), Some(marking));
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
    let bounds = Bounds::of_net(&net, &|| false);
    let found = deadlocks(&net, &bounds, &Budget::UNLIMITED).expect("no budget").expect("plain");
    assert_eq!((found.deadlocks, found.states), (1, 41), "of a trillion");
}

#[test]
fn firings_that_do_not_commute_are_left_to_the_full_search() {
    let mut net = Net::builder();
    let p = net.place("p", 1);
    net.transition("t").input(p, 1).inhibitor(p, 2);
    let net = net.build().expect("one place");
    let bounds = Bounds::of_net(&net, &|| false);
    assert_eq!(deadlocks(&net, &bounds, &Budget::UNLIMITED), Ok(None));
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
