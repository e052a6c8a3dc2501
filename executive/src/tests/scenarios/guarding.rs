//! Guards and variables: when a transition is enabled, and what happens to its clock.

use super::bench::{Bench, MS, Office, SECOND, office};
use crate::controller::Controller;
use crate::event::ControllerEvent;
use crate::record::{JournalEntry, JournalRecord};
use crate::roster::Doing;
use crate::tests::simulation::draft::{DraftPlan, Way};
use armor_plan::{PlannedVariable, WatchId};
use armor_robotfile::guard::Scalar;
use std::sync::Arc;
use std::time::Duration;

const LEVEL: WatchId = WatchId(0);

/// The office with a guarded transition home; `battery` (0 to 1) follows `driver.level`.
fn guarded(when: &str, way: impl FnOnce(&Office) -> Way) -> Bench {
    let mut office = office();
    let source = office.plan.watch("driver.level", &[]);
    assert_eq!(source, LEVEL);
    let (minimum, maximum) = (0.0, 1.0);
    let name = "battery".to_owned();
    office.plan.variables.push(PlannedVariable { name, source, minimum, maximum });
    let guard = Some(office.plan.guarded(when));
    let way = Way { from: vec![office.explore], to: vec![office.home], guard, ..way(&office) };
    Bench::begun(office.with("weak", way))
}

fn report_level(bench: &mut Bench, level: impl Into<Option<f64>>) {
    let value = level.into().map(Scalar::Number);
    bench.tell(ControllerEvent::Sensed { watch: LEVEL, value });
}

fn is_home(bench: &mut Bench) -> bool {
    bench.obey();
    bench.marked() == ["home"]
}

/// The guard changes that the journal records.
fn changes(records: &[JournalRecord]) -> Vec<(bool, String)> {
    let change = |record: &JournalRecord| match &record.entry {
        JournalEntry::Guard { holds, because, .. } => Some((*holds, because.clone())),
        _ => None,
    };
    records.iter().filter_map(change).collect()
}

fn enabled_since(bench: &Bench) -> Option<Duration> {
    let id = bench.plan.transition_named("weak")?;
    bench.controller.ledger().state().enabled_since(id)
}

#[test]
fn it_fires_when_its_guard_comes_to_hold() {
    let mut bench = guarded("battery < 30%", |_| Way::default());
    bench.pass(SECOND);
    assert_eq!(bench.marked(), ["explore"], "nothing is known yet");
    for level in [0.5, 0.31] {
        report_level(&mut bench, level);
    }
    report_level(&mut bench, None);
    assert_eq!(bench.marked(), ["explore"]);
    report_level(&mut bench, 0.29);
    assert!(is_home(&mut bench));
    assert_eq!(changes(&bench.records), [(true, "battery is 0.29".to_owned())]);
}

#[test]
fn what_it_waits_for_is_published_with_the_values_and_their_unit() {
    let on = |office: &Office| Way { on: Some((office.explorer, "done")), ..Way::default() };
    let mut bench = guarded("battery < 30%", on);
    bench.tell(ControllerEvent::UnitKnown { watch: LEVEL, unit: "V" });
    report_level(&mut bench, 2.0 / 3.0);
    let waiting = |bench: &Bench| {
        let marking = bench.controller.marking(0.0);
        let weak = marking.waiting.into_iter().find(|it| it.transition == "weak");
        let because = marking.guards.into_iter().map(|guard| guard.because).collect::<String>();
        (weak.map(|it| (it.from, it.report, it.guard, it.hindrance)), because)
    };
    let explore = || vec!["explore".to_owned()];
    let both = (explore(), "explorer.done".to_owned(), true, String::new());
    assert_eq!(waiting(&bench), (Some(both), "battery is 0.666667 V".to_owned()));
    let explorer = bench.plan.component_named("explorer").expect("it is there");
    bench.done(explorer);
    let guard = (explore(), String::new(), true, String::new());
    assert_eq!(waiting(&bench).0, Some(guard), "the report has arrived");
    report_level(&mut bench, 0.2);
    assert!(is_home(&mut bench));
    assert_eq!(waiting(&bench).0, None, "its place is not marked");
}

#[test]
fn one_with_a_report_and_a_guard_needs_both_in_any_order() {
    let on = |office: &Office| Way { on: Some((office.explorer, "done")), ..Way::default() };
    for guard_first in [true, false] {
        let mut bench = guarded("battery < 30%", on);
        let explorer = bench.plan.component_named("explorer").expect("it is there");
        report_level(&mut bench, if guard_first { 0.2 } else { 0.9 });
        if guard_first {
            assert_eq!(bench.wanted(), [] as [&str; 0]);
        }
        bench.done(explorer);
        if !guard_first {
            assert_eq!(bench.wanted(), [] as [&str; 0], "the report waits for the guard");
            report_level(&mut bench, 0.2);
        }
        assert!(is_home(&mut bench), "guard first: {guard_first}");
    }
}

#[test]
fn its_clock_runs_only_while_the_guard_holds() {
    let after = |_: &Office| Way { after: Some(10 * SECOND), ..Way::default() };
    let mut bench = guarded("battery < 30%", after);
    report_level(&mut bench, 0.2);
    bench.pass(9 * SECOND);
    assert_eq!(enabled_since(&bench), Some(Duration::ZERO));
    report_level(&mut bench, 0.4);
    assert_eq!(enabled_since(&bench), None);
    bench.pass(5 * SECOND);
    report_level(&mut bench, 0.2);
    bench.pass(9 * SECOND);
    assert_eq!(bench.marked(), ["explore"], "it began again");
    bench.pass(SECOND);
    assert!(is_home(&mut bench));
}

#[test]
fn a_value_holds_for_a_while_without_its_provider_and_then_is_not_known() {
    let after = |_: &Office| Way { after: Some(10 * SECOND), ..Way::default() };
    let mut bench = guarded("battery < 30%", after);
    report_level(&mut bench, 0.2);
    bench.tell(ControllerEvent::Unlinked { watch: LEVEL });
    bench.pass(1900 * MS);
    report_level(&mut bench, 0.2);
    bench.pass(5 * SECOND);
    assert_eq!(enabled_since(&bench), Some(Duration::ZERO), "the executive has not noticed");
    bench.tell(ControllerEvent::Unlinked { watch: LEVEL });
    bench.pass(1900 * MS);
    assert!(enabled_since(&bench).is_some());
    bench.pass(200 * MS);
    assert_eq!(enabled_since(&bench), None);
    let last = changes(&bench.records).pop();
    assert_eq!(last, Some((false, "battery is not known".to_owned())));
}

#[test]
fn a_guard_may_ask_whether_anything_is_known() {
    let after = |_: &Office| Way { after: Some(3 * SECOND), ..Way::default() };
    let mut bench = guarded("not known(battery)", after);
    bench.pass(2 * SECOND);
    report_level(&mut bench, 0.5);
    bench.pass(2 * SECOND);
    assert_eq!(bench.marked(), ["explore"]);
    bench.tell(ControllerEvent::Unlinked { watch: LEVEL });
    bench.pass(5 * SECOND);
    assert!(is_home(&mut bench));
}

#[test]
fn what_is_outside_of_its_domain_counts_as_its_end_and_is_counted() {
    let mut bench = guarded("battery == 1", |_| Way::default());
    report_level(&mut bench, -3.0);
    report_level(&mut bench, f64::NEG_INFINITY);
    let shown = bench.controller.marking(0.0);
    let [battery] = shown.variables.as_slice() else { panic!("{shown:?}") };
    assert_eq!((battery.number, battery.outside), (Some(0.0), 2));
    report_level(&mut bench, 7.0);
    assert!(is_home(&mut bench));
}

#[test]
fn variables_and_guards_are_shown_with_their_values() {
    let mut bench = guarded("battery < 30%", |_| Way::default());
    let shown = |bench: &Bench| {
        let marking = bench.controller.marking(0.0);
        let guard = &marking.guards[0];
        format!("{}: {} is {}, {}", guard.transition, guard.guard, guard.truth, guard.because)
    };
    assert_eq!(shown(&bench), "weak: battery < 30% is not known, battery is not known");
    report_level(&mut bench, 0.75);
    assert_eq!(shown(&bench), "weak: battery < 30% is false, battery is 0.75");
    assert_eq!(bench.controller.marking(0.0).variables[0].value, "0.75");
}

#[test]
fn values_alone_are_shown_once_a_second() {
    let mut bench = guarded("battery < 30%", |_| Way::default());
    bench.pass(5 * SECOND);
    report_level(&mut bench, 0.9);
    let mut shown = 0;
    for step in 0..300 {
        bench.now += 10 * MS;
        let value = Some(Scalar::Number(0.5 + f64::from(step) * 1e-3));
        let event = ControllerEvent::Sensed { watch: LEVEL, value };
        let actions = bench.controller.handle(event, bench.now);
        shown += actions.len();
        let due = bench.controller.next_deadline().filter(|due| *due <= bench.now);
        assert_eq!(due, None, "what is due has been done");
    }
    assert!((2..=4).contains(&shown), "{shown} in three seconds");
}

#[test]
fn after_a_restart_a_guard_is_as_it_was_until_there_is_news() {
    for (open, news) in [(true, true), (true, false), (false, true), (false, false)] {
        let after = |_: &Office| Way { after: Some(10 * SECOND), ..Way::default() };
        let mut bench = guarded("battery < 30%", after);
        report_level(&mut bench, if open { 0.2 } else { 0.8 });
        bench.pass(4 * SECOND);
        let resumed = Controller::resume(Arc::clone(&bench.plan), &bench.records, bench.now);
        let (controller, actions) = resumed.expect("its own journal");
        bench.controller = controller;
        bench.note(actions);
        bench.everybody_returns();
        bench.pass(1900 * MS);
        assert_eq!(enabled_since(&bench).is_some(), open, "the clock runs on if it ran");
        if news {
            report_level(&mut bench, 0.1);
        }
        bench.pass(200 * MS);
        assert_eq!(enabled_since(&bench).is_some(), news, "was open: {open}");
        if news && open {
            bench.pass(3900 * MS);
            assert!(is_home(&mut bench), "ten seconds, the restart included");
        }
    }
}

impl Bench {
    /// All components reconnect in the state in which they were when the executive was killed.
    pub(super) fn everybody_returns(&mut self) {
        for component in self.plan.component_ids() {
            let activation = self.activation(component);
            let doing = if activation > 0 { Doing::Active } else { Doing::Frozen };
            self.appears(component, doing, activation);
        }
    }
}
