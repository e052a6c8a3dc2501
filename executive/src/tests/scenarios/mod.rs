//! The controller receives events one by one, and the tests check the actions that it returns.

mod bench;
mod changing;
mod changing_values;
mod commanding;
mod counting;
mod dating;
mod guarding;
mod pausing;
mod simulated;
mod valuing;
mod waiting;

use crate::controller::Controller;
use crate::event::ControllerEvent;
use crate::roster::Doing;
use crate::terms::{ComponentReport, MissionOutcome};
use crate::tests::simulation::draft::Way;
use bench::{Bench, MS, SECOND, office};
use std::sync::Arc;
use std::time::Duration;

#[test]
fn the_mission_begins_once_everybody_is_known_to_be_off() {
    let office = office();
    let (explorer, brake) = (office.explorer, office.brake);
    let mut bench = Bench::of(office);
    bench.appears(explorer, Doing::Frozen, 0);
    assert_eq!(bench.wanted(), [] as [&str; 0], "the others may be running");
    bench.everybody_appears();
    assert_eq!(bench.wanted(), ["activate explorer", "activate driver"]);
    assert_eq!(bench.marked(), [] as [&str; 0], "not before they confirm");
    bench.obey();
    assert_eq!(bench.marked(), ["explore"]);
    assert!(!bench.controller.roster().of(brake).may_be_active());
}

#[test]
fn what_one_finds_running_at_the_beginning_is_stopped_first() {
    let office = office();
    let homing = office.homing;
    let mut bench = Bench::of(office);
    for component in bench.plan.component_ids() {
        let doing = if component == homing { Doing::Active } else { Doing::Frozen };
        bench.appears(component, doing, 7);
    }
    assert_eq!(bench.wanted(), ["freeze homing"]);
    bench.report_state(homing, Doing::Frozen, 7);
    assert_eq!(bench.wanted(), ["activate explorer", "activate driver"]);
}

#[test]
fn a_mission_whose_journal_is_lost_does_not_begin_again() {
    let office = office();
    let (explorer, brake) = (office.explorer, office.brake);
    let mut bench = Bench::of(office);
    let (controller, actions) =
        Controller::after_loss(Arc::clone(&bench.plan), "its journal is gone", Duration::ZERO);
    bench.controller = controller;
    bench.note(actions);
    bench.wanted();
    for component in bench.plan.component_ids() {
        let doing = if component == explorer { Doing::Active } else { Doing::Frozen };
        bench.appears(component, doing, 7);
    }
    assert_eq!(bench.wanted(), ["freeze explorer"], "it continues from the life before");
    bench.report_state(explorer, Doing::Frozen, 7);
    assert_eq!(bench.wanted(), ["activate brake"]);
    bench.report_state(brake, Doing::Active, bench.activation(brake));
    assert_eq!(bench.wanted(), ["Safe"]);
}

#[test]
fn nothing_starts_before_what_stops_has_confirmed_it() {
    let office = office();
    let (explorer, homing, explored) = (office.explorer, office.homing, office.explored());
    let mut bench = Bench::begun(office.with("explored", explored));
    bench.done(explorer);
    assert_eq!(bench.wanted(), ["freeze explorer"], "the driver continues undisturbed");
    assert_eq!(bench.marked(), [] as [&str; 0]);
    bench.pass(900 * MS);
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    bench.report_state(explorer, Doing::Frozen, bench.activation(explorer));
    assert_eq!(bench.wanted(), ["activate homing"]);
    assert_eq!(bench.marked(), [] as [&str; 0]);
    bench.report_state(homing, Doing::Active, bench.activation(homing));
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn one_that_does_not_stop_is_asked_again_and_killed_and_the_mission_retreats() {
    let office = office();
    let (explorer, brake, explored) = (office.explorer, office.brake, office.explored());
    let mut bench = Bench::begun(office.with("explored", explored));
    bench.done(explorer);
    bench.pass(1100 * MS);
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze explorer"]);
    bench.pass(SECOND);
    assert_eq!(bench.wanted(), ["kill explorer"]);
    bench.gone(explorer);
    assert_eq!(bench.wanted(), ["freeze driver", "activate brake"], "homing is never started");
    bench.report_state(brake, Doing::Active, bench.activation(brake));
    assert_eq!(bench.wanted(), [] as [&str; 0], "not over while the driver runs");
    bench.obey();
    assert_eq!(bench.wanted(), ["Safe"]);
    assert!(bench.controller.ledger().why().contains("`explorer` did not stop"));
}

#[test]
fn where_the_file_specifies_it_the_tokens_go_elsewhere_after_a_failed_stop_or_start() {
    for stop in [true, false] {
        let office = office();
        let (explorer, homing, home) = (office.explorer, office.homing, office.home);
        let mut way = office.explored();
        (way.on_stop_fail, way.on_start_fail) = (stop.then_some(home), (!stop).then_some(home));
        let mut bench = Bench::begun(office.with("explored", way));
        bench.done(explorer);
        if stop {
            bench.pass(2100 * MS);
            bench.gone(explorer);
        } else {
            bench.report_state(explorer, Doing::Frozen, bench.activation(explorer));
            bench.reports(
                homing,
                bench.activation(homing),
                ComponentReport::Failed { reason: "no".into() },
            );
        }
        bench.obey();
        assert_eq!(bench.wanted().last().map(String::as_str), Some("Goal"), "stop: {stop}");
    }
}

#[test]
fn one_that_is_not_started_again_is_not_waited_for() {
    let mut office = office();
    let (driver, brake) = (office.driver, office.brake);
    office.plan.components[driver.index()].returns = false;
    let mut bench = Bench::begun(office);
    bench.gone(driver);
    assert_eq!(bench.wanted(), ["freeze explorer"], "immediately");
    bench.obey();
    assert!(bench.wanted().starts_with(&["activate brake".to_owned()]));
    assert!(!bench.controller.roster().of(brake).unstoppable);
    let why = bench.controller.ledger().why().to_owned();
    assert!(why.contains("`driver` failed: its process has ended, and restart=\"never\""), "{why}");
}

#[test]
fn one_on_a_host_with_patience_is_waited_for_as_long() {
    for (within, waits) in [(15, 14), (60, 59)] {
        let mut office = office();
        let driver = office.driver;
        office.plan.components[driver.index()].return_within = within * SECOND;
        let mut bench = Bench::begun(office);
        bench.gone(driver);
        bench.pass(waits * SECOND);
        assert_eq!(bench.wanted(), [] as [&str; 0], "after {waits} s of {within}");
        bench.pass(2 * SECOND);
        assert_eq!(bench.wanted()[0], "freeze explorer", "after {within} s");
        let expected = format!("`driver` failed: it did not come back within {within}s");
        assert_eq!(bench.controller.ledger().why(), expected);
    }
}

#[test]
fn a_component_that_is_given_up_fails_its_place_with_the_reason() {
    let why = "driver was given up after 5 starts in 1.6 s: ended with code 7";
    let given_up = |bench: &mut Bench, component| {
        bench.tell(ControllerEvent::GivenUp { component, why: Some(why.to_owned()) });
    };
    for connection_ends_first in [true, false] {
        let office = office();
        let driver = office.driver;
        let mut bench = Bench::begun(office);
        if connection_ends_first {
            bench.gone(driver);
            given_up(&mut bench, driver);
        } else {
            given_up(&mut bench, driver);
            assert_eq!(bench.wanted(), [] as [&str; 0], "its last process may not have ended");
            bench.gone(driver);
        }
        assert_eq!(bench.wanted(), ["freeze explorer"], "immediately");
        assert_eq!(bench.controller.ledger().why(), format!("`driver` failed: {why}"));
    }

    // One that has never appeared cannot run either.
    let office = office();
    let driver = office.driver;
    let mut bench = Bench::of(office);
    given_up(&mut bench, driver);
    for component in bench.plan.component_ids().filter(|component| *component != driver) {
        bench.appears(component, Doing::Frozen, 0);
    }
    assert!(bench.controller.ledger().why().contains(why), "{}", bench.controller.ledger().why());
}

#[test]
fn one_that_is_given_up_while_it_is_not_needed_fails_the_start_that_needs_it() {
    let office = office();
    let (explorer, homing, explored) = (office.explorer, office.homing, office.explored());
    for comes_back in [false, true] {
        let mut bench = Bench::begun(self::office().with("explored", explored.clone()));
        bench.gone(homing);
        let why = Some("homing was given up".to_owned());
        bench.tell(ControllerEvent::GivenUp { component: homing, why });
        bench.pass(60 * SECOND);
        assert_eq!(bench.wanted(), [] as [&str; 0]);
        if comes_back {
            bench.tell(ControllerEvent::GivenUp { component: homing, why: None });
            bench.appears(homing, Doing::Frozen, 0);
        }
        bench.done(explorer);
        bench.obey();
        let why = bench.controller.ledger().why().to_owned();
        let expected = if comes_back { "" } else { "`homing` did not start: homing was given up" };
        assert_eq!(why, expected);
    }
}

#[test]
fn a_command_that_the_journal_delays_has_its_whole_time() {
    let office = office();
    let (explorer, explored) = (office.explorer, office.explored());
    let mut bench = Bench::begun(office.with("explored", explored));
    bench.done(explorer);
    assert_eq!(bench.wanted(), ["freeze explorer"]);
    // The disk stands still for longer than it may take to stop.
    for next in ["freeze explorer", "kill explorer"] {
        bench.now += 3 * SECOND;
        bench.controller.note_sent(explorer, bench.now);
        bench.pass(900 * MS);
        assert_eq!(bench.wanted(), [] as [&str; 0]);
        bench.pass(200 * MS);
        assert_eq!(bench.wanted(), [next]);
    }
}

#[test]
fn a_killed_component_that_may_still_run_keeps_those_it_excludes_off() {
    let office = office();
    let (explorer, explored) = (office.explorer, office.explored());
    let mut bench = Bench::begun(office.with("explored", explored));
    bench.done(explorer);
    bench.pass(2100 * MS);
    assert_eq!(bench.wanted()[2..], ["kill explorer"]);
    bench.pass(60 * SECOND);
    let wanted = bench.wanted();
    assert!(!wanted.contains(&"activate brake".to_owned()), "{wanted:?}");
    assert_eq!(wanted.last().map(String::as_str), Some("Failed"));
}

#[test]
fn reports_of_an_activation_that_is_over_are_dropped_and_counted() {
    let office = office();
    let (explorer, explored) = (office.explorer, office.explored());
    let mut bench = Bench::begun(office.with("explored", explored));
    let activation = bench.activation(explorer);
    bench.done(explorer);
    bench.obey();
    bench.reports(explorer, activation, ComponentReport::Done);
    bench.reports(explorer, activation + 40, ComponentReport::Done);
    let dropped = bench.controller.dropped();
    assert_eq!((dropped.late, dropped.unheard), (2, 0));
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn a_component_that_dies_and_returns_is_put_back_before_its_place_counts_as_active() {
    let office = office();
    let driver = office.driver;
    let mut bench = Bench::begun(office);
    let before = bench.activation(driver);
    bench.gone(driver);
    let active = |bench: &Bench| bench.controller.marking(0.0).places[0].active;
    assert!(!active(&bench));
    bench.pass(5 * SECOND);
    bench.appears(driver, Doing::Starting, 0);
    assert_eq!(bench.wanted(), [] as [&str; 0], "it is not ready");
    bench.report_state(driver, Doing::Frozen, 0);
    assert_eq!(bench.wanted(), ["activate driver"]);
    assert!(!active(&bench) && bench.activation(driver) > before);
    bench.obey();
    assert!(active(&bench));
    assert_eq!(bench.marked(), ["explore"]);
}

#[test]
fn one_that_stays_away_fails_its_place() {
    let mut office = office();
    let (driver, home) = (office.driver, office.home);
    office.plan.places[office.explore.index()].on_failure = Some(home);
    let mut bench = Bench::begun(office);
    bench.gone(driver);
    bench.pass(14 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(1100 * MS);
    assert_eq!(bench.wanted(), ["freeze explorer"]);
    bench.obey();
    assert_eq!((bench.marked(), bench.wanted()), (vec!["home".into()], vec!["Goal".into()]));
}

#[test]
fn a_failure_that_a_transition_waits_for_is_its_business_alone() {
    let office = office();
    let (explorer, explore, home) = (office.explorer, office.explore, office.home);
    let failed = Way {
        from: vec![explore],
        to: vec![home],
        on: Some((explorer, "failed")),
        ..Way::default()
    };
    let mut bench = Bench::begun(office.with("failed", failed));
    let reason = "the door is shut".to_owned();
    bench.reports(explorer, bench.activation(explorer), ComponentReport::Failed { reason });
    bench.obey();
    assert_eq!(bench.wanted().last().map(String::as_str), Some("Goal"));
}

#[test]
fn a_component_of_two_marked_places_runs_while_either_is_marked() {
    let mut office = office();
    let (driver, explored) = (office.driver, office.explored());
    let watch = office.plan.place("watch", 1, &[driver]);
    let home = office.home;
    let leave = Way { from: vec![watch], to: vec![home], after: Some(SECOND), ..Way::default() };
    office.plan.goal = None;
    let mut bench = Bench::begun(office.with("explored", explored).with("leave", leave));
    bench.pass(2 * SECOND);
    assert_eq!((bench.wanted(), bench.marked()), (vec![], vec!["explore".into(), "home".into()]));
}

#[test]
fn one_that_has_finished_is_started_again_where_it_is_needed_again() {
    let office = office();
    let (explorer, explore) = (office.explorer, office.explore);
    let again = Way {
        from: vec![explore],
        to: vec![explore],
        on: Some((explorer, "done")),
        ..Way::default()
    };
    let mut bench = Bench::begun(office.with("again", again));
    bench.done(explorer);
    assert_eq!(bench.wanted(), ["freeze explorer"]);
    bench.obey();
    assert_eq!(
        (bench.wanted(), bench.marked()),
        (vec!["activate explorer".into()], vec!["explore".into()])
    );
}

#[test]
fn a_repeated_confirmation_does_not_confirm_what_was_ordered_since() {
    let office = office();
    let (explorer, explore) = (office.explorer, office.explore);
    let on = Some((explorer, "done"));
    let again = Way { from: vec![explore], to: vec![explore], on, ..Way::default() };
    let mut bench = Bench::begun(office.with("again", again));
    let first = bench.activation(explorer);
    bench.done(explorer);
    bench.pass(1100 * MS);
    bench.report_state(explorer, Doing::Frozen, first);
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze explorer", "activate explorer"]);
    bench.report_state(explorer, Doing::Frozen, first);
    assert!(bench.controller.roster().of(explorer).may_be_active(), "activated since");
}

#[test]
fn a_loop_without_end_is_named_and_left_for_the_safe_place() {
    let mut office = office();
    let (one, two) = (office.plan.place("one", 1, &[]), office.plan.place("two", 0, &[]));
    let way = |from, to| Way { from: vec![from], to: vec![to], ..Way::default() };
    let mut bench = Bench::begun(office.with("there", way(one, two)).with("back", way(two, one)));
    bench.obey();
    assert!(bench.controller.ledger().why().ends_with("without end: there back"));
    assert_eq!(bench.marked(), ["hold"]);
}

#[test]
fn with_a_period_it_looks_once_in_a_while_and_records_when_it_is_too_late() {
    let mut offices = [office(), office()];
    let (explore, back) = (offices[0].explore, offices[0].back);
    let [alarm, _] = offices.each_mut().map(|office| {
        (office.plan.period, office.plan.safe) = (Some(SECOND), None);
        office.plan.place("alarm", 0, &[])
    });
    let late = Way {
        from: vec![explore],
        to: vec![back],
        after: Some(2300 * MS),
        overrun: Some(alarm),
        ..Way::default()
    };
    let [office, again] = offices.map(|office| office.with("late", late.clone()));
    let mut bench = Bench::begun(office);
    bench.pass(2900 * MS);
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    bench.pass(200 * MS);
    bench.obey();
    assert_eq!(bench.marked(), ["return"], "the next look is in time");
    assert_eq!(bench.controller.ledger().history().next().unwrap().1, 3 * SECOND);
    // The executive is busy until 3.4 s and misses its look at 3 s; the next one is at 4 s.
    let mut bench = Bench::begun(again);
    bench.now = 3400 * MS;
    bench.pass(SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["return", "alarm"], "0.7 s late");
}

#[test]
fn stopped_by_its_process_it_brings_everything_to_rest_and_can_be_resumed() {
    let office = office();
    let (explorer, explored) = (office.explorer, office.explored());
    let mut bench = Bench::begun(office.with("explored", explored));
    bench.tell(ControllerEvent::Stop);
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"]);
    bench.obey();
    assert_eq!(bench.wanted(), ["Interrupted"]);
    let (plan, now) = (Arc::clone(&bench.plan), bench.now);
    let (controller, actions) = Controller::resume(plan, &bench.records, now).unwrap();
    bench.controller = controller;
    bench.note(actions);
    assert_eq!(bench.wanted(), [] as [&str; 0], "it asks everybody first");
    bench.everybody_appears();
    let last = "the explorer waits until those it excludes are known to be off";
    assert_eq!(bench.wanted(), ["activate driver", "activate explorer"], "{last}");
    bench.obey();
    bench.done(explorer);
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn resumed_with_what_it_decided_running_it_disturbs_no_component() {
    let office = office();
    let (explorer, driver) = (office.explorer, office.driver);
    let mut bench = Bench::begun(office);
    let running = [explorer, driver].map(|c| (c, bench.activation(c)));
    let (plan, now) = (Arc::clone(&bench.plan), bench.now);
    bench.controller = Controller::resume(plan, &bench.records, now).unwrap().0;
    for component in bench.plan.component_ids() {
        match running.iter().find(|other| other.0 == component) {
            Some((_, activation)) => bench.appears(component, Doing::Active, *activation),
            None => bench.appears(component, Doing::Frozen, 0),
        }
    }
    assert_eq!((bench.wanted(), bench.marked()), (vec![], vec!["explore".into()]));
    assert!(bench.controller.marking(0.0).places[0].active);
}

#[test]
fn what_the_mission_does_not_control_gets_no_commands_and_is_heard() {
    let mut office = office();
    let (explore, home) = (office.explore, office.home);
    let battery = office.plan.component("battery", true);
    let weak =
        Way { from: vec![explore], to: vec![home], on: Some((battery, "low")), ..Way::default() };
    let mut bench = Bench::of(office.with("weak", weak));
    bench.everybody_appears();
    bench.report_state(battery, Doing::Active, 0);
    bench.obey();
    assert!(bench.wanted().iter().all(|action| !action.contains("battery")));
    bench.reports(battery, 0, ComponentReport::Event { name: "full".into(), value: 1.0 });
    assert_eq!(bench.controller.dropped().unheard, 1);
    let marking = bench.controller.marking(0.0);
    let unheard = marking.components.iter().filter(|it| it.unheard_reports > 0);
    let unheard: Vec<_> = unheard.map(|it| (it.component.as_str(), it.unheard_reports)).collect();
    assert_eq!(unheard, [("battery", 1)]);
    bench.reports(battery, 0, ComponentReport::Event { name: "low".into(), value: 0.1 });
    bench.obey();
    assert_eq!(bench.wanted().last().map(String::as_str), Some("Goal"));
    assert_eq!(MissionOutcome::Goal.exit_code(), 0);
}
