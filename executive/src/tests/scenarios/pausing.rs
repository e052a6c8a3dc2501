//! Pauses: what stops, what keeps running, which tokens can be moved, and how the mission resumes.

use super::bench::{Bench, MS, SECOND, office};
use crate::event::ControllerEvent;
use crate::order::{MissionOrder, MovedTokens};
use crate::roster::Doing;
use crate::terms::ComponentReport;
use crate::tests::simulation::draft::Way;
use armor_marking::{FlightPhase, MarkingStage};
use armor_plan::OnResume;
use armor_robotfile::mission::Autonomy;

fn moves(them: &[(&str, &str, u32)]) -> MissionOrder {
    let one = |&(from, to, tokens): &(&str, &str, u32)| MovedTokens {
        from: from.to_owned(),
        to: to.to_owned(),
        tokens,
    };
    MissionOrder::Move(them.iter().map(one).collect())
}

#[test]
fn a_pause_stops_components_and_clocks_and_afterwards_all_continues_where_it_stood() {
    let office = office();
    let (explore, back) = (office.explore, office.back);
    let (explorer, driver) = (office.explorer, office.driver);
    let late =
        Way { from: vec![explore], to: vec![back], after: Some(5 * SECOND), ..Way::default() };
    let mut bench = Bench::begun(office.with("late", late));
    bench.pass(3 * SECOND);
    assert_eq!(bench.orders("ruth", MissionOrder::Resume), "refused: the mission is not paused");
    assert_eq!(bench.orders("ruth", MissionOrder::Pause), "accepted: the mission is paused");
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"]);
    let pause = bench.controller.marking(0.0).pause.unwrap();
    assert!(!pause.at_rest && pause.by == "ruth" && pause.since_at_s == 3.0);
    bench.obey();
    let shown = bench.controller.marking(0.0);
    assert!(
        shown.pause.unwrap().at_rest
            && shown.stage == MarkingStage::Paused
            && shown.enabled[0].held
    );
    bench.pass(60 * SECOND);
    assert_eq!((bench.wanted(), bench.marked()), (vec![], vec!["explore".into()]));
    let before = [explorer, driver].map(|component| bench.activation(component));
    assert_eq!(bench.orders("sam", MissionOrder::Resume), "accepted: the mission continues");
    assert_eq!(bench.wanted(), ["activate explorer", "activate driver"]);
    bench.obey();
    assert!(bench.activation(explorer) > before[0] && bench.activation(driver) > before[1]);
    bench.pass(1900 * MS);
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    bench.pass(200 * MS);
    assert_eq!(bench.wanted(), ["freeze explorer"], "five seconds without the pause");
}

#[test]
fn a_firing_in_flight_stays_where_it_is_and_starts_nothing_until_the_pause_is_over() {
    for phase in [FlightPhase::Stopping, FlightPhase::Starting] {
        let office = office();
        let (explorer, homing, explored) = (office.explorer, office.homing, office.explored());
        let mut bench = Bench::begun(office.with("explored", explored));
        bench.done(explorer);
        if phase == FlightPhase::Starting {
            bench.report_state(explorer, Doing::Frozen, bench.activation(explorer));
            assert_eq!(bench.wanted().last().map(String::as_str), Some("activate homing"));
        }
        bench.orders("ruth", MissionOrder::Pause);
        bench.obey();
        bench.pass(100 * SECOND);
        assert!(!bench.controller.roster().of(homing).may_be_active(), "{phase}");
        let shown = bench.controller.marking(0.0);
        assert_eq!((shown.in_flight.len(), shown.places.len()), (1, 0), "{phase}");
        assert_eq!(shown.in_flight[0].phase, phase);
        bench.orders("ruth", MissionOrder::Resume);
        bench.obey();
        assert_eq!(bench.marked(), ["return"], "{phase}");
    }
}

#[test]
fn safety_is_not_paused() {
    let mut office = office();
    let guard = office.plan.component("guard", true);
    let watch = office.plan.place("watch", 1, &[guard]);
    office.plan.places[watch.index()].safety = true;
    let (explore, hold) = (office.explore, office.plan.safe.unwrap());
    let alarm = Way {
        from: vec![watch, explore],
        to: vec![hold],
        on: Some((guard, "alarm")),
        safety: true,
        ..Way::default()
    };
    let mut bench = Bench::begun(office.with("alarm", alarm));
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"], "the guard runs on");
    bench.pass(60 * SECOND);
    let alarm = ComponentReport::Event { name: "alarm".into(), value: 1.0 };
    bench.reports(guard, bench.activation(guard), alarm);
    bench.obey();
    assert_eq!(bench.marked(), ["hold"]);
    assert_eq!(bench.wanted().last().map(String::as_str), Some("Safe"));
}

#[test]
fn what_safety_starts_again_in_a_pause_starts_when_the_pause_is_over() {
    let mut office = office();
    let (explorer, explore) = (office.explorer, office.explore);
    let note = office.plan.place("note", 0, &[]);
    office.plan.places[note.index()].safety = true;
    let guard = office.plan.component("guard", false);
    let on = Some((guard, "alarm"));
    let way =
        Way { from: vec![explore], to: vec![explore, note], on, safety: true, ..Way::default() };
    let mut bench = Bench::begun(office.with("note", way));
    bench.report_state(guard, Doing::Active, 0);
    bench.done(explorer);
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.wanted();
    bench.reports(guard, 0, ComponentReport::Event { name: "alarm".into(), value: 1.0 });
    bench.obey();
    assert_eq!((bench.marked(), bench.wanted()), (vec!["explore".into(), "note".into()], vec![]));
    bench.orders("ruth", MissionOrder::Resume);
    let wanted = bench.wanted();
    assert!(wanted.contains(&"activate explorer".to_owned()), "it had finished before: {wanted:?}");
}

#[test]
fn the_safe_place_is_reached_from_a_pause() {
    let mut bench = Bench::begun(office());
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.orders("sam", MissionOrder::Safe);
    bench.obey();
    assert_eq!((bench.marked(), bench.controller.ledger().pause()), (vec!["hold".into()], None));
}

#[test]
fn what_was_done_or_seen_before_the_pause_still_counts_after_it() {
    for report in ["done", "seen"] {
        let mut office = office();
        let (explorer, explore, back) = (office.explorer, office.explore, office.back);
        let token = office.plan.place("token", 0, &[]);
        let ticket = office.plan.place("ticket", 1, &[]);
        let on = Some((explorer, report));
        let way = Way { from: vec![explore, token], to: vec![back], on, ..Way::default() };
        let after = Some(9 * SECOND);
        let later = Way { from: vec![ticket], to: vec![token], after, ..Way::default() };
        let mut bench = Bench::begun(office.with("way", way).with("later", later));
        // An event counts only if a transition waits for it whose places are marked or about to be
        // marked; `done` counts in any case.
        bench.pass(if report == "seen" { 9 * SECOND } else { SECOND });
        bench.orders("ruth", MissionOrder::Pause);
        let sent = match report {
            "done" => ComponentReport::Done,
            _ => ComponentReport::Event { name: "seen".into(), value: 1.0 },
        };
        bench.reports(explorer, bench.activation(explorer), sent);
        bench.obey();
        bench.wanted();
        bench.orders("ruth", MissionOrder::Resume);
        let wanted = bench.wanted();
        let started = wanted.contains(&"activate explorer".to_owned());
        assert!(!(started && report == "done"), "it has nothing more to do: {wanted:?}");
        bench.obey();
        bench.pass(9 * SECOND);
        bench.obey();
        assert_eq!(bench.marked(), ["return"], "{report}");
    }
}

#[test]
fn tokens_are_moved_in_a_pause_and_only_where_that_is_right() {
    let mut office = office();
    let explore = office.explore;
    let brake = office.brake;
    let stop = office.plan.place("stop", 0, &[brake]);
    let stock = office.plan.place("stock", 3, &[]);
    assert_ne!(stop, stock);
    let away = Way { from: vec![explore], to: vec![stop], after: None, ..Way::default() };
    let away = Way { autonomy: Autonomy::Operator, ..away };
    let mut bench = Bench::begun(office.with("away", away));
    let unpaused = "refused: tokens are moved only while the mission is paused: pause it first";
    assert_eq!(bench.orders("ruth", moves(&[("explore", "return", 1)])), unpaused);
    let misspelt = "refused: the mission has no place called `explor`; did you mean explore?";
    assert_eq!(bench.orders("ruth", moves(&[("explor", "return", 1)])), misspelt);
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.wanted();
    for (them, wrong) in [
        (
            vec![("explore", "nowhere", 1)],
            "the mission has no place called `nowhere`; it has: explore, return, home, hold, stop, stock",
        ),
        (vec![("explore", "home", 2)], "`explore` holds 1 tokens, not 2"),
        (vec![("stock", "stock", 1)], "from `stock` to `stock` nothing would move"),
        (vec![("stock", "home", 0)], "from `stock` to `home` nothing would move"),
        (
            vec![("stock", "explore", 1)],
            "`explore` would hold 2 tokens; a place with components holds one",
        ),
        (
            vec![("stock", "return", 1)],
            "`explorer` of `explore` and `homing` of `return` exclude each other",
        ),
        (
            vec![("stock", "stop", 2), ("home", "stock", 1)],
            "`home` holds 0 tokens, not 1; `stop` would hold 2 tokens; a place with components \
             holds one; `explorer` of `explore` and `brake` of `stop` exclude each other",
        ),
    ] {
        assert_eq!(bench.orders("ruth", moves(&them)), format!("refused: {wrong}"));
        assert_eq!(bench.marked(), ["explore", "stock"]);
    }
    let both = moves(&[("explore", "home", 1), ("stock", "stop", 1)]);
    let moved =
        "accepted: 2 tokens are moved; what they activate starts when the mission continues";
    assert_eq!(bench.orders("ruth", both), moved);
    assert_eq!(bench.marked(), ["home", "stop", "stock"]);
    assert_eq!(bench.wanted(), [] as [&str; 0], "nothing starts, and the goal waits");
    bench.orders("ruth", moves(&[("home", "stock", 1)]));
    bench.orders("ruth", MissionOrder::Resume);
    assert_eq!(bench.wanted(), ["activate brake"]);
    bench.obey();
    assert_eq!(bench.marked(), ["stop", "stock"]);
}

#[test]
fn a_token_on_its_way_counts_when_others_are_moved() {
    let office = office();
    let (explorer, explored) = (office.explorer, office.explored());
    let mut office = office.with("explored", explored);
    office.plan.place("stock", 1, &[]);
    let mut bench = Bench::begun(office);
    bench.done(explorer);
    bench.orders("ruth", MissionOrder::Pause);
    let wrong = "refused: `return` would hold 2 tokens, some on their way; a place with components holds one";
    assert_eq!(bench.orders("ruth", moves(&[("stock", "return", 1)])), wrong);
}

#[test]
fn a_paused_mission_whose_executive_is_killed_stays_paused() {
    let mut bench = Bench::begun(office());
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.pass(SECOND);
    bench.restarts();
    bench.everybody_appears();
    bench.pass(60 * SECOND);
    assert_eq!(bench.wanted()[2..], [] as [&str; 0], "no component is started");
    assert_eq!(bench.controller.ledger().pause().map(|pause| pause.by.as_str()), Some("ruth"));
    bench.orders("sam", MissionOrder::Resume);
    bench.obey();
    assert!(bench.controller.marking(0.0).places[0].active);
}

#[test]
fn a_mission_that_resumes_on_hold_waits_for_an_operator_after_a_restart() {
    let mut office = office();
    office.plan.on_resume = OnResume::Hold;
    let (explorer, driver) = (office.explorer, office.driver);
    let mut bench = Bench::begun(office);
    assert_eq!(bench.controller.ledger().pause(), None, "a fresh start is no restart");
    let running = [explorer, driver].map(|c| (c, bench.activation(c)));
    bench.restarts();
    for (component, activation) in running {
        bench.appears(component, Doing::Active, activation);
    }
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"]);
    bench.obey();
    let pause = bench.controller.marking(0.0).pause.unwrap();
    assert_eq!(pause.by, "the executive");
    bench.restarts();
    assert_eq!(bench.records.iter().filter(|r| format!("{r:?}").contains("Held")).count(), 1);
    bench.everybody_appears();
    bench.orders("ruth", MissionOrder::Resume);
    bench.obey();
    assert!(bench.controller.marking(0.0).places[0].active);
}

#[test]
fn one_that_does_not_stop_for_a_pause_is_killed_and_put_back_afterwards() {
    let office = office();
    let driver = office.driver;
    let mut bench = Bench::begun(office);
    bench.orders("ruth", MissionOrder::Pause);
    bench.report_state(bench.plan.component_named("explorer").unwrap(), Doing::Frozen, 99);
    bench.pass(2100 * MS);
    assert_eq!(bench.wanted().last().map(String::as_str), Some("kill driver"));
    bench.gone(driver);
    bench.pass(60 * SECOND);
    bench.appears(driver, Doing::Frozen, 0);
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    assert_eq!(bench.controller.marking(0.0).stage, MarkingStage::Paused, "and nothing has failed");
    bench.orders("ruth", MissionOrder::Resume);
    bench.obey();
    assert!(bench.controller.marking(0.0).places[0].active);
}

#[test]
fn one_that_died_in_a_pause_has_its_whole_patience_from_the_end_of_it() {
    let office = office();
    let driver = office.driver;
    let mut bench = Bench::begun(office);
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.gone(driver);
    bench.pass(100 * SECOND);
    bench.orders("ruth", MissionOrder::Resume);
    bench.obey();
    bench.pass(14 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(2 * SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["hold"]);
}

#[test]
fn a_mission_stopped_while_paused_is_resumed_paused() {
    let mut bench = Bench::begun(office());
    bench.orders("ruth", MissionOrder::Pause);
    bench.tell(ControllerEvent::Stop);
    bench.obey();
    assert_eq!(bench.wanted().last().map(String::as_str), Some("Interrupted"));
    bench.restarts();
    assert_eq!(bench.controller.marking(0.0).stage, MarkingStage::Paused);
}

#[test]
fn a_pause_ordered_while_the_executive_is_being_stopped_applies_to_the_next_one() {
    let mut bench = Bench::begun(office());
    bench.tell(ControllerEvent::Stop);
    let refused = bench.orders("ruth", MissionOrder::Resume);
    assert!(refused.contains("is being stopped"), "{refused}");
    assert_eq!(bench.orders("ruth", MissionOrder::Pause), "accepted: the mission is paused");
    bench.obey();
    assert_eq!(bench.wanted().last().map(String::as_str), Some("Interrupted"));
    bench.restarts();
    assert_eq!(bench.controller.marking(0.0).stage, MarkingStage::Paused);
    assert_eq!(bench.marked(), ["explore"]);
}
