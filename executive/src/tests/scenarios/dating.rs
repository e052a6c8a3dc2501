//! Absolute dates: which transitions they enable, what follows when one has passed, and a wall
//! clock that is set.

use super::bench::{Bench, MS, Office, SECOND, office};
use crate::event::ControllerEvent;
use crate::order::MissionOrder;
use crate::record::JournalEntry;
use crate::tests::simulation::draft::{Way, noon};
use armor_marking::{DateWindow, MarkingStage};
use armor_plan::{DatePhase, PlannedDates};
use armor_robotfile::mission::{Autonomy, Missed};
use std::time::Duration;

/// The office with a transition home that has dates, in seconds after noon. The mission begins at
/// noon, and the wall clock has been read.
fn dated(
    (first, last): (Option<u64>, Option<u64>),
    missed: Missed,
    way: impl FnOnce(&Office) -> Way,
) -> Bench {
    let mut bench = dated_without_utc((first, last), missed, way);
    report_utc(&mut bench, Duration::ZERO);
    bench
}

/// As [`dated`], without a reading of the wall clock yet.
fn dated_without_utc(
    (first, last): (Option<u64>, Option<u64>),
    missed: Missed,
    way: impl FnOnce(&Office) -> Way,
) -> Bench {
    let office = office();
    let date = |after: Option<u64>| after.map(|after| noon().later(Duration::from_secs(after)));
    let dates = Some(PlannedDates { first: date(first), last: date(last), missed });
    let way = Way { from: vec![office.explore], to: vec![office.home], dates, ..way(&office) };
    Bench::begun(office.with("meet", way))
}

fn plain(_: &Office) -> Way {
    Way::default()
}

/// Reports a reading of the wall clock by which the mission began `after_noon`.
fn report_utc(bench: &mut Bench, after_noon: Duration) {
    bench.tell(ControllerEvent::Utc { at_start: noon().later(after_noon) });
}

/// Reports a reading by which the mission began `by` before noon: the wall clock was set back.
fn set_back(bench: &mut Bench, by: Duration) {
    bench.tell(ControllerEvent::Utc { at_start: noon().earlier(by) });
}

fn is_home(bench: &mut Bench) -> bool {
    bench.obey();
    bench.marked() == ["home"]
}

fn phases(bench: &Bench) -> Vec<DatePhase> {
    let phase = |record: &crate::record::JournalRecord| match &record.entry {
        JournalEntry::Dated { phase, .. } => Some(*phase),
        _ => None,
    };
    bench.records.iter().filter_map(phase).collect()
}

#[test]
fn it_does_not_fire_before_its_date_and_then_immediately() {
    let mut bench = dated((Some(60), None), Missed::Skip, plain);
    assert_eq!(bench.controller.next_deadline(), Some(60 * SECOND));
    bench.pass(60 * SECOND - MS);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(MS);
    assert!(is_home(&mut bench));
    assert_eq!(phases(&bench), [DatePhase::Open]);
}

#[test]
fn its_clock_starts_when_its_date_has_come() {
    let after = |_: &Office| Way { after: Some(10 * SECOND), ..Way::default() };
    let mut bench = dated((Some(60), None), Missed::Skip, after);
    bench.pass(70 * SECOND - MS);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(MS);
    assert!(is_home(&mut bench));
}

#[test]
fn a_date_that_has_come_before_the_mission_began_is_open() {
    let mut bench = dated_without_utc((Some(60), None), Missed::Skip, plain);
    report_utc(&mut bench, 61 * SECOND);
    assert!(is_home(&mut bench));
}

#[test]
fn without_a_clock_no_date_comes() {
    let mut bench = dated_without_utc((None, Some(60)), Missed::Fire, plain);
    bench.pass(100 * SECOND);
    assert_eq!((bench.marked(), phases(&bench)), (vec!["explore".to_owned()], Vec::new()));
}

#[test]
fn what_is_skipped_never_fires_once_its_date_has_passed() {
    let explored = |office: &Office| Way { on: Some((office.explorer, "done")), ..Way::default() };
    let mut bench = dated((Some(30), Some(60)), Missed::Skip, explored);
    bench.pass(60 * SECOND);
    let explorer = bench.plan.component_named("explorer").expect("it is there");
    bench.done(explorer);
    bench.pass(SECOND);
    set_back(&mut bench, 3600 * SECOND);
    bench.pass(2 * 3600 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    assert_eq!(phases(&bench), [DatePhase::Open, DatePhase::Past]);
}

#[test]
fn what_fires_late_fires_once() {
    let explored = |office: &Office| Way {
        on: Some((office.explorer, "done")),
        to: vec![office.explore],
        ..Way::default()
    };
    let mut office = office();
    let last = Some(noon().later(60 * SECOND));
    let dates = Some(PlannedDates { first: None, last, missed: Missed::Fire });
    let from = vec![office.explore];
    let way = Way { from, dates, ..explored(&office) };
    office = office.with("meet", way);
    let explorer = office.explorer;
    let mut bench = Bench::begun(office);
    report_utc(&mut bench, Duration::ZERO);
    bench.pass(100 * SECOND);
    for fired in [1, 1] {
        bench.done(explorer);
        bench.obey();
        assert_eq!(bench.controller.marking(0.0).fired, fired);
    }
}

#[test]
fn a_date_that_fails_the_mission_does_so_when_tokens_wait_for_it() {
    let mut bench = dated((Some(30), Some(60)), Missed::Fail, |office| Way {
        on: Some((office.explorer, "done")),
        ..Way::default()
    });
    bench.pass(59 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(2 * SECOND);
    bench.obey();
    assert_eq!(bench.marked(), ["hold"]);
    let why = bench.controller.marking(0.0).why;
    assert_eq!(why, "the date of `meet` has passed unused: 2026-11-21T12:01:00Z");
}

#[test]
fn where_no_token_waits_a_date_fails_nothing() {
    let mut office = office();
    let last = Some(noon().later(60 * SECOND));
    let dates = Some(PlannedDates { first: None, last, missed: Missed::Fail });
    let way = Way { from: vec![office.back], to: vec![office.home], dates, ..Way::default() };
    let explored = office.explored();
    office = office.with("meet", way).with("explored", explored);
    let explorer = office.explorer;
    let mut bench = Bench::begun(office);
    report_utc(&mut bench, Duration::ZERO);
    bench.pass(100 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.done(explorer);
    bench.obey();
    assert_eq!(bench.marked(), ["hold"], "they have come too late");
}

#[test]
fn in_a_pause_a_date_passes_and_fails_nothing_until_it_is_over() {
    let mut bench = dated((Some(30), Some(60)), Missed::Fail, |office| Way {
        on: Some((office.explorer, "done")),
        ..Way::default()
    });
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.pass(100 * SECOND);
    assert_eq!(phases(&bench), [DatePhase::Open, DatePhase::Past]);
    assert_eq!(bench.controller.marking(0.0).stage, MarkingStage::Paused);
    bench.orders("ruth", MissionOrder::Resume);
    bench.obey();
    assert_eq!(bench.marked(), ["hold"]);
}

#[test]
fn a_clock_that_is_set_moves_dates_and_no_timeout() {
    let mut office = office();
    let date = |after: Duration| Some(noon().later(after));
    let dates = Some(PlannedDates { first: date(60 * SECOND), last: None, missed: Missed::Skip });
    let (from, to) = (vec![office.explore], vec![office.home]);
    let meet = Way { from: from.clone(), to, dates, after: Some(30 * SECOND), ..Way::default() };
    let late = Way { from, to: vec![office.back], after: Some(200 * SECOND), ..Way::default() };
    office = office.with("meet", meet).with("late", late);
    let mut bench = Bench::begun(office);
    report_utc(&mut bench, Duration::ZERO);
    bench.pass(10 * SECOND);
    // The wall clock is set forward by an hour: the date has come and the transition's clock
    // starts. Then the wall clock is set back: the date is in the future again.
    report_utc(&mut bench, 3600 * SECOND);
    bench.pass(20 * SECOND);
    report_utc(&mut bench, Duration::ZERO);
    assert_eq!(phases(&bench), [DatePhase::Open, DatePhase::Early]);
    assert_eq!(bench.controller.next_deadline(), Some(60 * SECOND));
    set_back(&mut bench, 3600 * SECOND);
    bench.pass(170 * SECOND - MS);
    assert_eq!(bench.marked(), ["explore"]);
    bench.pass(MS);
    bench.obey();
    assert_eq!(bench.marked(), ["return"], "the timeout counts from its beginning");
}

#[test]
fn after_a_restart_dates_follow_the_clock_as_it_is_then() {
    for (missed, down, expected) in [
        (Missed::Skip, 15, "home"),
        (Missed::Skip, 120, "explore"),
        (Missed::Fire, 120, "home"),
        (Missed::Fail, 120, "hold"),
    ] {
        let after = |_: &Office| Way { after: Some(20 * SECOND), ..Way::default() };
        let mut bench = dated((Some(30), Some(60)), missed, after);
        bench.pass(40 * SECOND);
        bench.now += Duration::from_secs(down);
        bench.restarts();
        bench.everybody_returns();
        let waits = bench.marked();
        assert_eq!(waits, ["explore"], "until it knows what time it is");
        report_utc(&mut bench, Duration::ZERO);
        bench.obey();
        bench.pass(20 * SECOND);
        bench.obey();
        assert_eq!(bench.marked(), [expected], "{missed:?} after {down} s");
    }
}

#[test]
fn operators_are_informed_of_the_date() {
    let operated = |_: &Office| Way { autonomy: Autonomy::Operator, ..Way::default() };
    let mut bench = dated((Some(30), Some(60)), Missed::Skip, operated);
    let fire = || MissionOrder::Fire("meet".to_owned());
    assert_eq!(
        bench.orders("ruth", fire()),
        "refused: `meet` is not enabled: its date has not come: 2026-11-21T12:00:30Z"
    );
    bench.pass(70 * SECOND);
    assert_eq!(
        bench.orders("ruth", fire()),
        "refused: `meet` is not enabled: its date has passed: 2026-11-21T12:01:00Z"
    );
}

#[test]
fn dates_are_shown_with_when_they_come() {
    let mut bench = dated_without_utc((Some(30), Some(60)), Missed::Skip, |office| Way {
        on: Some((office.explorer, "done")),
        ..Way::default()
    });
    let shown = |bench: &Bench| {
        let date = bench.controller.marking(0.0).dates.pop().expect("one");
        (date.phase, date.next_at_s, date.used)
    };
    assert_eq!(shown(&bench), (DateWindow::Early, None, false));
    report_utc(&mut bench, 10 * SECOND);
    assert_eq!(shown(&bench), (DateWindow::Early, Some(20.0), false));
    bench.pass(25 * SECOND);
    assert_eq!(shown(&bench), (DateWindow::Open, Some(50.0), false));
    bench.pass(25 * SECOND);
    assert_eq!(shown(&bench), (DateWindow::Past, None, false));
}
