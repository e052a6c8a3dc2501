//! Variables that transitions set: when guards read the new values, recovery after a crash, and
//! transfer to another version of the file.

use super::bench::{Bench, Office, SECOND, office};
use super::changing::{begun as begun_from, version};
use crate::event::ControllerEvent;
use crate::ledger::applying::replay_records;
use crate::ledger::snapshot::snapshot_of;
use crate::record::JournalEntry;
use crate::terms::ComponentReport;
use crate::tests::simulation::draft::{DraftPlan, Way};
use armor_plan::{PlannedVariable, WatchId};
use armor_robotfile::guard::Scalar;
use std::sync::Arc;
use std::time::Duration;

const LEVEL: WatchId = WatchId(0);

/// The office with a counter `round` that is set to `value` whenever the explorer reports `seen`;
/// `when` guards the transition home.
fn rounds(value: &str, when: &str) -> Bench {
    let mut office = office();
    let source = office.plan.watch("driver.level", &[]);
    let (minimum, maximum, name) = (0.0, 9.0, "level".to_owned());
    office.plan.variables.push(PlannedVariable { name, source, minimum, maximum });
    let round = office.plan.counter("round", 0, 3);
    office.plan.counter("twice", 0, 6);
    let sets = vec![office.plan.setting(round, value), office.plan.setting(1, "2 * round")];
    let again = Way {
        from: vec![office.explore],
        to: vec![office.explore],
        on: Some((office.explorer, "seen")),
        sets,
        ..Way::default()
    };
    let guard = Some(office.plan.guarded(when));
    let enough = Way { from: vec![office.explore], to: vec![office.home], guard, ..Way::default() };
    let office: Office = office.with("again", again).with("enough", enough);
    Bench::begun(office)
}

fn seen(bench: &mut Bench) {
    let explorer = bench.plan.component_named("explorer").expect("it is there");
    let event = ComponentReport::Event { name: "seen".into(), value: 1.0 };
    bench.reports(explorer, bench.activation(explorer), event);
    bench.obey();
}

fn values(bench: &Bench) -> Vec<i64> {
    bench.controller.ledger().values().map(|it| it.1).collect()
}

fn report_level(bench: &mut Bench, level: f64) {
    bench.tell(ControllerEvent::Sensed { watch: LEVEL, value: Some(Scalar::Number(level)) });
}

#[test]
fn transitions_set_variables_and_guards_see_it_immediately() {
    let mut bench = rounds("round + 1", "round == 2");
    assert_eq!(values(&bench), [0, 0]);
    seen(&mut bench);
    assert_eq!((values(&bench)[0], bench.marked()), (1, vec!["explore".into()]));
    seen(&mut bench);
    bench.obey();
    assert_eq!((values(&bench)[0], bench.marked()), (2, vec!["home".into()]));
    let turned = bench.records.iter().filter_map(|record| match &record.entry {
        JournalEntry::Took { sets, guards, .. } if !guards.is_empty() => Some((sets, guards)),
        _ => None,
    });
    let turned: Vec<_> = turned.collect();
    let [(sets, guards)] = &turned[..] else { panic!("{turned:?}") };
    assert_eq!(
        (sets[0].value, guards[0].transition.as_str(), guards[0].holds),
        (2, "enough", true)
    );
}

#[test]
fn all_values_are_worked_out_from_those_before() {
    let mut bench = rounds("round + 1", "round == 3 and twice == 4");
    for _ in 0..3 {
        seen(&mut bench);
    }
    bench.obey();
    assert_eq!((values(&bench), bench.marked()), (vec![3, 4], vec!["home".into()]));
}

#[test]
fn what_leaves_its_domain_ends_in_the_safe_place() {
    let mut bench = rounds("round + 2", "round == 3");
    seen(&mut bench);
    assert_eq!(bench.marked(), ["explore"]);
    seen(&mut bench);
    bench.obey();
    let why = bench.controller.ledger().why();
    assert_eq!(why, "again would set round to 4, and it is 0 to 3");
    assert_eq!((values(&bench)[0], bench.marked()), (2, vec!["hold".into()]));
}

#[test]
fn a_crash_leaves_no_guard_behind_its_variable() {
    let mut bench = rounds("round + 1", "round < 1 and level > 5");
    report_level(&mut bench, 1.0);
    seen(&mut bench);
    // At whichever record the journal ends, the guard matches the values at that record.
    let id = bench.plan.transition_named("enough").expect("it is there");
    for len in 1..=bench.records.len() {
        let plan = Arc::clone(&bench.plan);
        let ledger = replay_records(plan, &bench.records[..len]).expect("its own journal");
        let round = ledger.values().next().expect("a variable").1;
        assert!(!ledger.guard_holds(id) || round < 1, "{len} records, round {round}");
    }
    let snapshot = snapshot_of(bench.controller.ledger());
    let again = replay_records(Arc::clone(&bench.plan), &[snapshot]).expect("its own snapshot");
    assert!(again.values().eq(bench.controller.ledger().values()));
}

#[test]
fn after_a_restart_a_guard_over_both_is_as_in_the_journal_until_a_variable_changes() {
    for moves in [false, true] {
        let mut office = office();
        let source = office.plan.watch("driver.level", &[]);
        let (minimum, maximum, name) = (0.0, 9.0, "level".to_owned());
        office.plan.variables.push(PlannedVariable { name, source, minimum, maximum });
        let round = office.plan.counter("round", 0, 3);
        let again = Way {
            from: vec![office.back],
            to: vec![office.back],
            on: Some((office.driver, "seen")),
            sets: vec![office.plan.setting(round, "round + 1")],
            ..Way::default()
        };
        let late = Way {
            from: vec![office.explore],
            to: vec![office.home],
            after: Some(10 * SECOND),
            guard: Some(office.plan.guarded("level > round")),
            ..Way::default()
        };
        let ticks = office.plan.place("ticks", 1, &[]);
        let tick = Way {
            from: vec![ticks],
            after: Some(6 * SECOND),
            sets: vec![office.plan.setting(round, if moves { "round + 1" } else { "round" })],
            ..Way::default()
        };
        let office = office.with("late", late).with("again", again).with("tick", tick);
        let mut bench = Bench::begun(office);
        report_level(&mut bench, 5.0);
        bench.pass(5 * SECOND);
        bench.restarts();
        bench.everybody_appears();
        bench.obey();
        let id = bench.plan.transition_named("late").expect("it is there");
        let since = |bench: &Bench| bench.controller.ledger().state().enabled_since(id);
        assert_eq!(since(&bench), Some(Duration::ZERO), "as in the journal");
        bench.pass(1500 * super::bench::MS);
        let expected = (!moves).then_some(Duration::ZERO);
        assert_eq!(since(&bench), expected, "the variable changes: {moves}");
        report_level(&mut bench, 5.0);
        assert!(since(&bench).is_some(), "there is news");
    }
}

#[test]
fn values_are_carried_over_by_name_and_wait_for_their_domain() {
    let mission = |domain: &str, more: &str| {
        format!(
            r#"<mission name="office" goal="home" safe="hold">
               <variable name="round" {domain}/>{more}
               <place name="explore" initial="true" components="explorer"/>
               <place name="home"/><place name="hold" components="brake"/>
               <transition name="again" from="explore" to="explore" on="explorer.seen"
                   when="round &lt; 3"><set variable="round" value="round + 1"/></transition>
               <transition name="enough" from="explore" to="home" timeout="1h"/></mission>"#
        )
    };
    let mut bench = begun_from(&mission(r#"min="0" max="3""#, ""));
    seen(&mut bench);
    seen(&mut bench);
    assert_eq!(values(&bench), [2]);
    bench.saved(version(2, &mission(r#"min="0" max="1""#, "").replace("&lt; 3", "&lt; 1")));
    let why = "`round` is 2, and the new file lets it be 0 to 1";
    assert_eq!((bench.played(), bench.change().1.as_str()), (1, why));
    let more = r#"<variable name="other" min="-5" max="5" initial="4"/>"#;
    let used = r#"when="round &lt; 3 and other > 0""#;
    let next = mission(r#"min="-1" max="4""#, more).replace(r#"when="round &lt; 3""#, used);
    bench.saved(version(3, &next));
    assert_eq!((bench.played(), values(&bench)), (3, vec![2, 4]), "{:?}", bench.records.last());
    let again = replay_records(Arc::clone(&bench.plan), &bench.records).expect("its own journal");
    assert!(again.values().eq([("round", 2), ("other", 4)]));
    seen(&mut bench);
    assert_eq!(values(&bench), [3, 4]);
    // Checks of a new version are proven from the current values, not from the initial ones.
    let claiming = |hours: &str, claim: &str| {
        let check = format!("<check>always round &gt;= {claim}</check></mission>");
        next.replace("1h", hours).replace("</mission>", &check)
    };
    bench.saved(version(4, &claiming("2h", "4")));
    assert_eq!(bench.played(), 3);
    assert!(bench.change().1.contains("round at 3"), "{:?}", bench.change());
    bench.saved(version(5, &claiming("2h", "3")));
    assert_eq!(bench.played(), 5);
}
