//! enough to know them.

use armor_petri::analysis::classes::{StateClasses, find_state_classes};
use armor_petri::analysis::durations::{Latest, longest_time, shortest_time};
use armor_petri::analysis::{AnalysisBudget, Exhausted};
use armor_petri::file::tina;
use armor_petri::{FiringInterval, Net, NetState, TransitionId};
use proptest::prelude::*;
use std::fmt::Write;
use std::sync::Arc;
use std::time::Duration;

fn net(text: &str) -> Net {
    tina::read(text).expect("a net").net
}

fn all(net: &Net) -> StateClasses {
    let budget = AnalysisBudget { states: 1_000_000, ..AnalysisBudget::UNLIMITED };
    let (classes, exhausted) = find_state_classes(net, &budget);
    assert_eq!(exhausted, None);
    classes
}

#[test]
fn the_example_of_berthomieu_and_menasche_has_its_12_classes() {
    // Berthomieu and Menasche, IFIP 1983; distributed with TINA as ifip.net. 12 classes and 29
    // edges: Berthomieu, Ribet, Vernadat, "The tool TINA", IJPR 42(14), 2004.
    let net = net("tr t1 [4,9] p1 p2*2 -> p3 p4 p5\ntr t2 [0,2] p4 -> p2\ntr t3 [1,3] p5 -> p2\n\
                   tr t4 [0,2] p3 -> p3\ntr t5 [0,3] p3 -> p1\npl p1 (1)\npl p2 (2)");
    let classes = all(&net);
    assert_eq!((classes.classes(), classes.edges()), (12, 29));
}

#[test]
fn the_alternating_bit_protocol_has_its_16_classes() {
    // Berthomieu and Diaz, IEEE TSE 17(3), 1991, section V; distributed with TINA as abp.net.
    let net = net("tr t1 p1 -> p2 p9\ntr t2 [5,6] p2 -> p2 p9\ntr t3 [0,1] p2 p10 -> p3\n\
                   tr t4 p3 -> p4 p11\ntr t5 [5,6] p4 -> p4 p11\ntr t6 [0,1] p4 p12 -> p1\n\
                   tr t7 [0,1] p5 p9 -> p6\ntr t8 [0,2] p6 -> p7 p10\ntr t9 [0,1] p7 p9 -> p6\n\
                   tr t10 [0,1] p7 p11 -> p8\ntr t11 [0,2] p8 -> p5 p12\n\
                   tr t12 [0,1] p5 p11 -> p8\ntr t13 [0,1] p9 ->\ntr t14 [0,1] p10 ->\n\
                   tr t15 [0,1] p11 ->\ntr t16 [0,1] p12 ->\npl p1 (1)\npl p5 (1)");
    assert_eq!(all(&net).classes(), 16);
}

/// The level crossing with its controller and barrier, for two trains or more.
fn level_crossing(trains: u32) -> Net {
    let (n, d) = (trains, trains - 1);
    let mut text = format!(
        "tr down1 [0,0] coming up -> lowering\ntr down2 [0,0] coming raising -> lowering\n\
         tr l [1,2] lowering -> down\ntr r [1,2] raising -> up\ntr u [0,0] leaving down -> raising\n\
         pl up (1)\npl far ({n})\n"
    );
    for i in 1..=n {
        let _ = write!(
            text,
            "tr first{i} far{i} far*{n} -> close{i} coming far*{d} in\n\
             tr next{i} far{i} far in -> close{i} in*2\n\
             tr in{i} [3,5] close{i} -> on{i}\ntr ex{i} [2,4] on{i} -> left{i}\n\
             tr last{i} [0,0] left{i} far*{d} in -> far{i} leaving far*{n}\n\
             tr one{i} [0,0] left{i} in*2 -> far{i} far in\npl far{i} (1)\n"
        );
    }
    net(&text)
}

#[test]
fn the_level_crossing_has_its_published_classes() {
    // Berthomieu and Vernadat, "State class constructions for branching analysis of time Petri
    // nets", TACAS 2003, table 1, linear state classes.
    let mut table = vec![(2, 123, 218), (3, 3_101, 7_754)];
    if std::env::var_os("ARMOR_FULL").is_some() {
        table.push((4, 134_501, 436_896));
    }
    for (trains, expected, edges) in table {
        let found = all(&level_crossing(trains));
        assert_eq!((found.classes(), found.edges()), (expected, edges), "{trains} trains");
        // The crossing is shut whenever a train is on it.
        let net = level_crossing(trains);
        let place =
            |name: &str| net.places().iter().position(|place| place == name).expect("there");
        let safe = (0..found.classes() as u32).all(|class| {
            let marking = found.marking(class);
            let on = (1..=trains).any(|i| marking[place(&format!("on{i}"))] > 0);
            !on || marking[place("down")] > 0
        });
        assert!(safe, "{trains} trains");
    }
}

/// Shortest and longest time, in seconds, until the place called `goal` is marked.
fn durations(text: &str) -> (Option<f64>, Result<f64, Latest>) {
    let net = net(text);
    let goal = net.places().iter().position(|place| place == "goal").expect("a goal");
    let classes = all(&net);
    let asked = |marking: &[u32]| marking[goal] > 0;
    let shortest =
        shortest_time(&net, &classes, asked, &AnalysisBudget::UNLIMITED).expect("no budget");
    let longest =
        longest_time(&net, &classes, asked, &AnalysisBudget::UNLIMITED).expect("no budget");
    let longest = match longest {
        Latest::At(timed) => Ok(timed.time.as_secs_f64()),
        other => Err(other),
    };
    (shortest.map(|timed| timed.time.as_secs_f64()), longest)
}

#[test]
fn durations_are_those_of_the_firing_sequences() {
    let sequence = "tr a [1,2] p -> q\ntr b [0.5,4] q -> goal\npl p (1)";
    assert_eq!(durations(sequence), (Some(1.5), Ok(6.0)));
    // The sequence through b: at least 3 after p; c would take the token at 5 at the latest.
    let choice = "tr b [3,9] p -> goal\ntr c [0,5] p -> q\ntr d [10,10] q -> goal\npl p (1)";
    assert_eq!(durations(choice), (Some(3.0), Ok(15.0)));
    // Both in parallel, and then together.
    let both = "tr a [1,2] p -> x\ntr b [3,4] q -> y\ntr c [0,1] x y -> goal\npl p (1)\npl q (1)";
    assert_eq!(durations(both), (Some(3.0), Ok(5.0)));
    // A timeout cannot come before what must come first.
    let timeout = "tr early [0,2] p -> goal\ntr late [3,3] p -> q\npl p (1)";
    assert_eq!(durations(timeout), (Some(0.0), Ok(2.0)));
    // Around as often as one likes, but each time takes two.
    let around = "tr loop [2,3] p -> p\ntr out [7,7] q -> goal\npl p (1)\npl q (1)";
    assert_eq!(durations(around).0, Some(7.0));
    assert_eq!(durations("tr a p -> q\npl p (1)\npl goal").0, None);
    assert_eq!(durations("tr a p -> q\npl goal (1)"), (Some(0.0), Ok(0.0)));
}

#[test]
fn an_avoidable_marking_is_reported_with_a_run_that_avoids_it() {
    let id = TransitionId;
    let late = durations("tr a [1,2] p -> q\ntr b [1,w[ q -> goal\npl p (1)").1;
    assert_eq!(late, Err(Latest::WithoutEnd(vec![id(0), id(1)])));
    let circle =
        durations("tr a [1,2] p -> q\ntr b [1,1] q -> p\ntr c [0,1] q -> goal\npl p (1)").1;
    assert_eq!(circle, Err(Latest::Circle(vec![], vec![id(0), id(1)])));
    let end = durations("tr a [1,2] p -> q\ntr b [1,1] q -> r\ntr c [0,1] q -> goal\npl p (1)").1;
    assert_eq!(end, Err(Latest::DeadEnd(vec![id(0), id(1)])));
}

#[test]
fn read_inhibitor_and_reset_arcs_affect_clocks() {
    // Taking a token and putting it back starts the clock of whom it was missing to; reading it
    // does not. So b, at 3, comes in spite of c at 2 only where c reads.
    let taking = "tr b [3,3] p -> goal\ntr c [2,2] p q -> p\npl p (1)\npl q (1)";
    let reading = "tr b [3,3] p -> goal\ntr c [2,2] p?1 q ->\npl p (1)\npl q (1)";
    assert_eq!(durations(taking), (Some(5.0), Ok(5.0)));
    assert_eq!(durations(reading), (Some(3.0), Ok(3.0)));
    let held = "tr b [3,3] p h?-1 -> goal\ntr c [2,2] h ->\npl p (1)\npl h (1)";
    assert_eq!(durations(held), (Some(5.0), Ok(5.0)));
}

#[test]
fn an_unbounded_net_ends_with_its_budget() {
    let net = net("tr a [1,1] p -> p q\npl p (1)");
    let budget = AnalysisBudget { states: 1000, ..AnalysisBudget::UNLIMITED };
    let (found, exhausted) = find_state_classes(&net, &budget);
    assert_eq!((found.classes(), exhausted), (1000, Some(Exhausted::States)));
    let memory = AnalysisBudget { memory_bytes: 100_000, ..AnalysisBudget::UNLIMITED };
    assert_eq!(find_state_classes(&net, &memory).1, Some(Exhausted::Memory));
}

prop_compose! {
    fn timed_net()(
        tokens in prop::collection::vec(0u32..3, 4),
        sketches in prop::collection::vec((
            prop::collection::vec((0u8..7, 0usize..4, 1u32..3), 1..5), 0u64..4, prop::option::of(0u64..3),
        ), 1..5),
    ) -> Net {
        let mut net = Net::builder();
        let places: Vec<_> =
            tokens.iter().enumerate().map(|(i, n)| net.place(format!("p{i}"), *n)).collect();
        for (index, (arcs, earliest, slack)) in sketches.iter().enumerate() {
            let earliest = Duration::from_secs(*earliest);
            let latest = slack.map(|slack| earliest + Duration::from_secs(slack));
            let mut t = net.transition(format!("t{index}")).interval(FiringInterval { earliest, latest });
            for &(kind, place, weight) in arcs {
                t = match kind {
                    0..=2 => t.input(places[place], weight),
                    3 => t.output(places[place], weight),
                    4 => t.read(places[place], weight),
                    5 => t.inhibitor(places[place], weight),
                    _ => t.reset(places[place]),
                };
            }
        }
        net.build().expect("arcs within the net")
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Any run that keeps to the deadlines is a path of the class graph, and meets a marking no
    /// sooner than the shortest and no later than the longest time.
    #[test]
    fn runs_are_among_the_analysed_ones(
        net in timed_net(),
        choices in prop::collection::vec((0usize..8, 0u64..5), 1..12),
    ) {
        let budget = AnalysisBudget { states: 2000, ..AnalysisBudget::UNLIMITED };
        let (found, exhausted) = find_state_classes(&net, &budget);
        if exhausted.is_some() {
            return Ok(());
        }
        let mut state = NetState::new(Arc::new(net.clone()), Duration::ZERO);
        let (mut class, mut visited) = (0, vec![(Duration::ZERO, net.initial().to_vec())]);
        for (which, half_seconds) in choices {
            // As late as asked, but not past a deadline.
            let deadline = state.enabled().filter_map(|id| state.deadline(id)).min();
            let wish = state.now() + Duration::from_millis(500) * half_seconds as u32;
            state.advance(deadline.map_or(wish, |deadline| wish.min(deadline)));
            let ready: Vec<_> = state.ready().collect();
            let Some(&transition) = ready.get(which % ready.len().max(1)) else { continue };
            state.fire(transition).expect("it is ready");
            let next = found.successors(class).iter().find(|(id, _)| *id == transition);
            prop_assert!(next.is_some(), "{transition:?} cannot fire in class {class}");
            class = next.expect("asserted").1;
            prop_assert_eq!(found.marking(class), state.marking());
            visited.push((state.now(), state.marking().to_vec()));
        }
        let (_, last) = visited.last().expect("the initial one").clone();
        let (first, _) = *visited.iter().find(|(_, marking)| *marking == last).as_ref().expect("itself");
        let asked = |marking: &[u32]| marking == last;
        let budget = AnalysisBudget { states: 20_000, ..AnalysisBudget::UNLIMITED };
        if let Ok(shortest) = shortest_time(&net, &found, asked, &budget) {
            prop_assert!(shortest.expect("it was reached").time <= *first);
        }
        if let Ok(Latest::At(latest)) = longest_time(&net, &found, asked, &budget) {
            prop_assert!(latest.time >= *first);
        }
    }
}
