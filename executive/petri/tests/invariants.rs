//! Semiflows: those of known nets, and that each found for a random net is one.

use crate::data;
use armor_petri::analysis::invariants::{
    PlaceBounds, excluding_sum, place_semiflows, transition_semiflows,
};
use armor_petri::file::tina;
use armor_petri::{Net, PlaceId};
use proptest::prelude::*;

fn never() -> bool {
    false
}

#[test]
fn semiflows_of_kanban_are_its_four_sums() {
    let Some(file) = data::net("Kanban-PT-02000.pnml") else { return };
    let found = place_semiflows(&file.net, &never);
    assert!(found.complete);
    // Each of the four cells holds 2000, and cells 2 and 3 are filled and emptied together.
    let mut sums: Vec<Vec<&str>> = found
        .semiflows
        .iter()
        .map(|flow| {
            assert!(flow.weights.iter().all(|(_, weight)| *weight == 1));
            let mut names: Vec<_> = flow.weights.iter().map(|w| file.net.place(w.0)).collect();
            names.sort_unstable();
            names
        })
        .collect();
    sums.sort_unstable();
    let cell = |i: u8| [format!("P{i}"), format!("Pback{i}"), format!("Pm{i}"), format!("Pout{i}")];
    for i in 1..=4 {
        assert!(sums.iter().any(|sum| *sum == cell(i)), "cell {i} in {sums:?}");
    }
    let transitions = transition_semiflows(&file.net, &never);
    assert!(transitions.complete);
    assert_eq!(transitions.semiflows.len(), 5, "four ways to redo and one through");
}

#[test]
fn a_sum_proves_exclusion_only_where_it_holds() {
    let check = |text: &str, expected: bool| {
        let net = tina::read(text).expect("a net").net;
        let flows = place_semiflows(&net, &never);
        let found = excluding_sum(&flows, &net, PlaceId(0), PlaceId(1)).is_some();
        assert_eq!(found, expected, "{text}");
    };
    check("tr a p -> q\npl p (1)", true);
    check("tr a p -> q\npl p (2)", false);
    check("tr a p*2 -> q\npl p (2)", true);
    check("tr a p*2 -> q\npl p (3)", false);
    check("tr a p -> q r\ntr b q r -> p\npl p (1)", true);
    check("pl p\npl q\ntr a r -> p q\npl r (1)", false);
}

#[test]
fn a_reset_breaks_a_sum_but_not_a_bound() {
    let mut net = Net::builder();
    let (p, q) = (net.place("p", 3), net.place("q", 0));
    net.transition("go").input(p, 1).output(q, 1);
    net.transition("empty").input(p, 1).output(p, 1).reset(q);
    let net = net.build().expect("two places");
    assert!(place_semiflows(&net, &never).semiflows.is_empty());
    let bounds = PlaceBounds::of_net(&net, &never);
    assert_eq!((bounds.of(0), bounds.of(1)), (Some(3), Some(3)));
}

prop_compose! {
    fn any_net()(
        tokens in prop::collection::vec(0u32..4, 1..7),
        sketches in prop::collection::vec(
            prop::collection::vec((any::<bool>(), 0usize..7, 1u32..4), 1..6), 0..7),
    ) -> Net {
        let mut net = Net::builder();
        let places: Vec<_> =
            tokens.iter().enumerate().map(|(i, n)| net.place(format!("p{i}"), *n)).collect();
        for (index, arcs) in sketches.iter().enumerate() {
            let mut t = net.transition(format!("t{index}"));
            for &(takes, place, weight) in arcs {
                let place = places[place % places.len()];
                t = if takes { t.input(place, weight) } else { t.output(place, weight) };
            }
        }
        net.build().expect("arcs within the net")
    }
}

fn change(net: &Net, transition: usize, place: usize) -> i128 {
    let t = &net.transitions()[transition];
    let sum = |arcs: &[(PlaceId, u32)]| -> i128 {
        arcs.iter().filter(|arc| arc.0.index() == place).map(|arc| i128::from(arc.1)).sum()
    };
    sum(&t.outputs) - sum(&t.inputs)
}

/// Whether numbers 0 to 2 for each place can make a sum that the transitions keep.
fn small_sums(net: &Net) -> Vec<Vec<i128>> {
    let places = net.places().len();
    (1..3usize.pow(places as u32))
        .map(|code| (0..places).map(|p| (code / 3usize.pow(p as u32) % 3) as i128).collect())
        .filter(|sum: &Vec<i128>| {
            (0..net.transitions().len())
                .all(|t| (0..places).map(|p| sum[p] * change(net, t, p)).sum::<i128>() == 0)
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn semiflows_are_kept_by_every_firing_and_none_of_minimal_support_is_missing(net in any_net()) {
        let found = place_semiflows(&net, &never);
        prop_assert!(found.complete);
        for flow in &found.semiflows {
            for t in 0..net.transitions().len() {
                let terms = flow.weights.iter();
                let sum: i128 = terms.map(|(p, w)| i128::from(*w) * change(&net, t, p.index())).sum();
                prop_assert_eq!(sum, 0);
            }
        }
        let supports: Vec<Vec<usize>> = found
            .semiflows
            .iter()
            .map(|flow| flow.weights.iter().map(|(p, _)| p.index()).collect())
            .collect();
        for (i, one) in supports.iter().enumerate() {
            for (j, other) in supports.iter().enumerate() {
                prop_assert!(i == j || !one.iter().all(|p| other.contains(p)));
            }
        }
        // The support of any other sum contains the support of one of them.
        for sum in small_sums(&net) {
            prop_assert!(supports.iter().any(|s| s.iter().all(|p| sum[*p] > 0)), "{sum:?}");
        }
        for flow in &transition_semiflows(&net, &never).semiflows {
            for p in 0..net.places().len() {
                let terms = flow.weights.iter();
                let sum: i128 = terms.map(|(t, w)| i128::from(*w) * change(&net, t.index(), p)).sum();
                prop_assert_eq!(sum, 0);
            }
        }
    }
}

/// Philosophers who take the left fork, then the right one, then put both back.
fn philosophers(count: usize) -> Net {
    let mut net = Net::builder();
    let mut place = |stem: &str, i: usize, tokens| net.place(format!("{stem}{i}"), tokens);
    let places: Vec<_> = (0..count)
        .map(|i| {
            (place("think", i, 1), place("wait", i, 0), place("eat", i, 0), place("fork", i, 1))
        })
        .collect();
    for (i, &(think, wait, eat, fork)) in places.iter().enumerate() {
        let other = places[(i + 1) % count].3;
        net.transition(format!("left{i}")).input(think, 1).input(fork, 1).output(wait, 1);
        net.transition(format!("right{i}")).input(wait, 1).input(other, 1).output(eat, 1);
        let done = net.transition(format!("done{i}")).input(eat, 1).output(think, 1);
        done.output(fork, 1).output(other, 1);
    }
    net.build().expect("philosophers and forks")
}

#[test]
fn thousands_of_places_are_bounded_quickly() {
    let net = philosophers(3000);
    let bounds = PlaceBounds::of_net(&net, &never);
    assert!((0..12_000).all(|place| bounds.of(place) == Some(1)));
    assert_eq!(place_semiflows(&net, &never).semiflows.len(), 6000);
}
