//! Blocked starts: a component cannot start while one that it excludes may be running.

use super::bench::{Bench, MS, SECOND};
use crate::roster::Doing;
use crate::tests::simulation::draft::{DraftPlan, Way};
use armor_petri::PlaceId;
use armor_plan::{ComponentId, PlanBuilder};

/// `a` is marked and runs x. After 2 s `u` leads from `c` to `b`, which runs y; x excludes y. The
/// transition to `over` takes from both `a` and `b`.
struct Meeting {
    plan: PlanBuilder,
    x: ComponentId,
    a: PlaceId,
    over: PlaceId,
}

fn meeting(on_start_fail: bool) -> Meeting {
    let mut plan = PlanBuilder { mission: "meeting".to_owned(), ..PlanBuilder::default() };
    let [x, y] = ["x", "y"].map(|name| plan.component(name, true));
    plan.exclusives.push(vec![x, y]);
    let (a, b) = (plan.place("a", 1, &[x]), plan.place("b", 0, &[y]));
    let c = plan.place("c", 1, &[]);
    let [over, hold, aside] = ["over", "hold", "aside"].map(|name| plan.place(name, 0, &[]));
    (plan.goal, plan.safe) = (Some(over), Some(hold));
    let on_start_fail = on_start_fail.then_some(aside);
    let (after, way) = (Some(2 * SECOND), Way::default());
    plan.way("u", Way { from: vec![c], to: vec![b], after, on_start_fail, ..way.clone() });
    plan.way("v", Way { from: vec![a, b], to: vec![over], after, ..way });
    Meeting { plan, x, a, over }
}

fn begun(meeting: Meeting) -> Bench {
    let mut bench = Bench::playing(meeting.plan.build().unwrap());
    bench.everybody_appears();
    bench.obey();
    bench.wanted();
    bench
}

#[test]
fn a_start_that_nothing_will_let_begin_fails_after_a_while() {
    let mut bench = begun(meeting(false));
    bench.pass(2 * SECOND);
    let waits = |bench: &Bench| {
        bench
            .controller
            .marking(0.0)
            .in_flight
            .iter()
            .map(|it| it.waits_for.concat())
            .collect::<Vec<_>>()
    };
    assert_eq!(waits(&bench), ["y"]);
    bench.pass(10 * SECOND - MS);
    assert_eq!((bench.wanted(), waits(&bench)), (vec![], vec!["y".to_owned()]));
    bench.pass(MS);
    bench.obey();
    assert_eq!(bench.wanted(), ["freeze x", "Safe"]);
    let why = bench.controller.ledger().why();
    assert!(why.contains("`y` cannot start: `x` runs, which excludes it"), "{why}");
}

#[test]
fn where_the_file_specifies_it_its_tokens_go_elsewhere() {
    let mut bench = begun(meeting(true));
    bench.pass(12 * SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["a", "aside"]);
}

#[test]
fn one_that_something_may_still_let_begin_waits_for_as_long_as_it_takes() {
    let mut meeting = meeting(false);
    let (x, a, over) = (meeting.x, meeting.a, meeting.over);
    let way = Way { from: vec![a], on: Some((x, "done")), ..Way::default() };
    meeting.plan.way("w", way);
    let mut bench = begun(meeting);
    bench.pass(600 * SECOND);
    assert_eq!((bench.wanted(), bench.marked()), (vec![], vec!["a".to_owned()]));
    bench.done(x);
    bench.obey();
    assert_eq!(bench.marked(), ["b"], "x has stopped and y has started");
    assert_eq!(bench.wanted(), ["freeze x", "activate y"]);
    assert_eq!(bench.controller.ledger().state().tokens(over), 0);
}

#[test]
fn it_is_given_its_time_to_start_once_no_component_blocks_it() {
    let mut meeting = meeting(false);
    let (x, a) = (meeting.x, meeting.a);
    meeting.plan.way("w", Way { from: vec![a], on: Some((x, "done")), ..Way::default() });
    let mut bench = begun(meeting);
    bench.pass(600 * SECOND);
    bench.done(x);
    // x stops only at the second request.
    bench.pass(1500 * MS);
    bench.obey();
    assert_eq!(bench.marked(), ["b"]);
}

#[test]
fn a_component_that_no_mission_may_control_ends_it_at_its_start() {
    let meeting = meeting(false);
    let x = meeting.x;
    let mut bench = Bench::playing(meeting.plan.build().unwrap());
    for component in bench.plan.component_ids() {
        bench.appears(component, Doing::Frozen, 0);
        if component == x {
            bench.refuses_control(component, Doing::Active);
        }
    }
    bench.obey();
    assert_eq!(bench.wanted(), ["Safe"], "it is neither killed nor waited for");
    let why = bench.controller.ledger().why();
    assert!(why.contains("`x` lets no mission control it"), "{why}");
    assert!(why.ends_with("name it in no place"), "{why}");
}

#[test]
fn a_component_that_starts_by_itself_excludes_all_others() {
    let meeting = meeting(false);
    let x = meeting.x;
    let mut bench = Bench::playing(meeting.plan.build().unwrap());
    bench.everybody_appears();
    bench.wanted();
    bench.refuses_control(x, Doing::Active);
    bench.pass(60 * SECOND);
    let wanted = bench.wanted();
    assert!(
        !wanted.iter().any(|it| it.contains('y')),
        "y was started while x is active: {wanted:?}"
    );
}
