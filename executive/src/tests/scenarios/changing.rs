//! Changes of the file while the mission runs: when a version is taken, what is carried over, and
//! what is refused.

use super::bench::{Bench, SECOND};
use crate::event::ControllerEvent;
use crate::ledger::applying::replay_records;
use crate::ledger::{Ledger, Phase};
use crate::order::{MissionOrder, MovedTokens};
use crate::record::JournalEntry;
use crate::roster::Doing;
use armor_plan::{FileText, Version};
use armor_robotfile::guard::Scalar;
use std::sync::Arc;
use std::time::Duration;

/// A mission that explores and comes back; `rest` differs between tests.
pub(super) fn mission(rest: &str) -> String {
    format!(
        r#"<mission name="office" goal="home" safe="hold">
             <place name="home"/><place name="hold" components="brake"/>
             <exclusive components="explorer homing brake"/>
             <transition name="lost" from="explore" to="hold" timeout="1h"/>
             {rest}
           </mission>"#
    )
}

pub(super) const EXPLORE: &str =
    r#"<place name="explore" initial="true" components="explorer driver"/>"#;
pub(super) const BACK: &str = r#"<place name="return" components="homing driver"/>"#;
pub(super) const EXPLORED: &str =
    r#"<transition name="explored" from="explore" to="return" on="explorer.done"/>"#;
pub(super) const ARRIVED: &str =
    r#"<transition name="arrived" from="return" to="home" on="homing.done"/>"#;

/// The complete mission with `more` added.
fn office(more: &str) -> String {
    mission(&[EXPLORE, BACK, EXPLORED, ARRIVED, more].concat())
}

pub(super) fn version(number: u64, mission: &str) -> Arc<Version> {
    version_over(number, "", mission)
}

fn version_over(number: u64, components: &str, mission: &str) -> Arc<Version> {
    let kinds = ["explorer", "driver", "homing", "brake"]
        .map(|name| format!(r#"<component name="{name}" kind="k"/>"#));
    let text = format!(
        r#"<armor version="1"><system>{}{components}<component name="free" kind="k"/></system>
           {mission}</armor>"#,
        kinds.concat()
    );
    Arc::new(Version { number, files: vec![FileText { path: "office.xml".into(), text }] })
}

/// Begins the mission: all components are connected, and `explore` is active.
pub(super) fn begun(mission: &str) -> Bench {
    let mut bench = Bench::playing(version(1, mission).plan().expect("a mission"));
    bench.everybody_appears();
    bench.obey();
    bench.wanted();
    assert_eq!(bench.marked(), ["explore"]);
    bench
}

impl Bench {
    pub(super) fn component(&self, name: &str) -> armor_plan::ComponentId {
        self.plan.component_named(name).expect("it is in the file")
    }

    /// Offers a version of the file and answers all questions about it.
    pub(super) fn saved(&mut self, version: Arc<Version>) {
        self.tell(ControllerEvent::Offered(version));
        self.judge();
    }

    pub(super) fn played(&self) -> u64 {
        self.controller.plan().version().number
    }

    /// State and reason of the version that is not in force.
    pub(super) fn change(&self) -> (String, String) {
        let change = self.controller.marking(0.0).change.expect("a version that is not played");
        (change.state.to_string(), change.why)
    }

    /// Seconds until a transition may fire.
    fn left_s(&self, name: &str) -> Option<f64> {
        let id = self.controller.plan().transition_named(name).expect("it is in the file");
        let at = self.controller.ledger().state().earliest(id)?;
        Some((at.saturating_sub(self.now)).as_secs_f64())
    }

    /// Replays the first `records` records of the journal.
    pub(super) fn replayed(&self, records: usize) -> Ledger {
        replay_records(Arc::clone(&self.plan), &self.records[..records]).expect("its own journal")
    }
}

#[test]
fn a_new_transition_is_taken_and_no_component_is_disturbed() {
    let mut bench = begun(&office(""));
    bench.pass(3 * SECOND);
    let recall = r#"<transition name="recall" from="explore" to="return" timeout="9s"/>"#;
    bench.saved(version(2, &office(recall)));
    assert_eq!(bench.played(), 2);
    assert_eq!(bench.wanted(), [] as [&str; 0], "no component is disturbed");
    assert_eq!((bench.left_s("lost"), bench.left_s("recall")), (Some(3597.0), Some(9.0)));
    let Some(JournalEntry::Changed { changes, .. }) =
        bench.records.last().map(|it| it.entry.clone())
    else {
        panic!("{:?}", bench.records.last());
    };
    assert_eq!(changes, ["transition recall added: from explore, to return, time 9s"]);
    bench.pass(9 * SECOND);
    assert_eq!(bench.wanted(), ["freeze explorer"]);
}

#[test]
fn a_clock_continues_while_what_it_waits_for_is_the_same() {
    let late = |terms: &str| {
        office(&format!(r#"<transition name="late" from="explore" to="return" {terms}/>"#))
    };
    let mut bench = begun(&late(r#"timeout="10s""#));
    bench.pass(4 * SECOND);
    bench.saved(version(2, &late(r#"timeout="6s""#)));
    assert_eq!(bench.left_s("late"), Some(2.0), "another time, counted from the same moment");
    bench.saved(version(3, &late(r#"timeout="6s" on="explorer.seen""#)));
    assert_eq!((bench.played(), bench.left_s("late")), (3, None), "it waits for something else");
    bench.saved(version(4, &late(r#"timeout="6s""#)));
    assert_eq!(bench.left_s("late"), Some(6.0), "it begins again");
    bench.pass(5 * SECOND);
    bench.saved(version(5, &late(r#"timeout="1s""#)));
    assert_eq!(bench.wanted(), ["freeze explorer"], "its time has passed already");
}

#[test]
fn a_place_that_is_marked_stays_until_it_is_empty() {
    let mut bench = begun(&office(""));
    let without = [
        BACK,
        ARRIVED,
        r#"<place name="wander" initial="true" components="explorer driver"/>"#,
        r#"<transition name="wandered" from="wander" to="return" on="explorer.done"/>"#,
    ];
    let without = mission(&without.concat()).replace(r#"from="explore""#, r#"from="wander""#);
    bench.saved(version(2, &without));
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "waiting"));
    assert_eq!(why, "`explore` holds a token, and the new file has no such place");
    bench.done(bench.component("explorer"));
    assert!(bench.change().1.contains("explored is under way"), "{:?}", bench.change());
    bench.obey();
    bench.judge();
    assert_eq!((bench.played(), bench.marked()), (2, vec!["return".to_owned()]));
}

#[test]
fn nothing_is_changed_while_a_firing_is_under_way() {
    let mut bench = begun(&office(""));
    let explorer = bench.component("explorer");
    bench.done(explorer);
    let tired = r#"<transition name="tired" from="return" to="hold" timeout="5s"/>"#;
    bench.saved(version(2, &office(tired)));
    let phases = |bench: &Bench| -> Vec<_> {
        bench.controller.ledger().firings().values().map(|firing| firing.phase).collect()
    };
    assert_eq!((bench.played(), phases(&bench)), (1, vec![Phase::Stopping]));
    bench.report_state(explorer, Doing::Frozen, bench.activation(explorer));
    assert_eq!((bench.played(), phases(&bench)), (1, vec![Phase::Starting]));
    bench.obey();
    bench.judge();
    assert_eq!((bench.played(), bench.marked()), (2, vec!["return".to_owned()]));
    assert_eq!(bench.left_s("tired"), Some(5.0));
}

#[test]
fn the_components_of_a_marked_place_stay_until_it_is_left() {
    let mut bench = begun(&office(""));
    let alone = office("").replace(r#"components="explorer driver""#, r#"components="explorer""#);
    bench.saved(version(2, &alone));
    assert_eq!(bench.change().1, "`explore` is marked, and the new file gives it other components");
    let safety = office("").replace(r#"initial="true""#, r#"initial="true" class="safety""#);
    bench.saved(version(3, &safety));
    assert_eq!(bench.change().1, "`explore` is marked, and the new file gives it another class");
    assert_eq!((bench.played(), bench.wanted()), (1, Vec::new()));
    bench.saved(version(4, &office("")));
    assert!(bench.controller.marking(0.0).change.is_none(), "the file is again what is played");
    assert_eq!(bench.controller.marking(0.0).version, 4);
}

#[test]
fn what_is_unsafe_from_where_the_mission_stands_is_refused_with_a_trace_to_it() {
    let mut bench = begun(&office(""));
    let both = r#"<place name="scout" components="explorer"/>
        <transition name="both" from="explore"><arc to="return"/><arc to="scout"/></transition>
        <transition name="scouted" from="scout" to="home" timeout="1s"/>"#;
    bench.saved(version(2, &office(both)));
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "refused"));
    assert!(why.contains("after both") && why.contains("exclude each other"), "{why}");
    assert!(matches!(
        &bench.records.last().unwrap().entry,
        JournalEntry::Refused { version: 2, .. }
    ));
    bench.pass(SECOND);
    bench.done(bench.component("explorer"));
    bench.obey();
    assert_eq!((bench.marked(), bench.played()), (vec!["return".to_owned()], 1));
}

#[test]
fn a_goal_that_cannot_be_reached_from_here_is_refused() {
    let mut bench = begun(&office(""));
    bench.done(bench.component("explorer"));
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
    // The goal can be reached from the initial marking, but not from the current one.
    let straight = r#"<transition name="straight" from="explore" to="home" on="explorer.done"/>"#;
    let lost = mission(&[EXPLORE, BACK, EXPLORED, straight].concat());
    bench.saved(version(2, &lost));
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "refused"));
    assert!(why.contains("E0241"), "{why}");
}

#[test]
fn the_first_dates_come_only_by_a_clock_that_a_service_keeps() {
    let dated = r#"<transition name="curfew" from="explore" to="return" not-before="2099-01-01T00:00:00Z"/>"#;
    let mut bench = begun(&office(""));
    bench.clock_doubts = Some("no service keeps it".into());
    bench.saved(version(2, &office(dated)));
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "refused"));
    assert!(why.contains("no service keeps it") && why.contains("--trust-clock"), "{why}");
    bench.clock_doubts = None;
    // A refused version is judged again as soon as its text differs.
    bench.saved(version(3, &office(&dated.replace("2099", "2098"))));
    assert_eq!(bench.played(), 3, "{:?}", bench.controller.marking(0.0).change);
    // A mission that already has dates continues with an untrusted clock, and so does its next
    // version.
    bench.clock_doubts = Some("no service keeps it".into());
    bench.saved(version(4, &office(&dated.replace("2099", "2100"))));
    assert_eq!(bench.played(), 4);
}

#[test]
fn a_fault_that_the_mission_has_already_keeps_nothing_from_changing() {
    let idle = r#"<place name="idle"/><transition name="stray" from="explore" to="idle" operator="true"/>"#;
    let mut bench = begun(&office(idle));
    let other = idle.replace("operator=", "priority=\"-2\" operator=");
    bench.saved(version(2, &office(&other)));
    assert_eq!(bench.played(), 2, "it could come to a standstill before, too");
    bench.saved(version(3, &office("")));
    assert_eq!(bench.played(), 3);
    bench.saved(version(4, &office(idle)));
    assert_eq!((bench.played(), bench.change().0.as_str()), (3, "refused"));
}

#[test]
fn only_components_that_run_can_be_in_a_new_version() {
    let mut bench = begun(&office(""));
    let arm = r#"<component name="arm" kind="k"/>"#;
    let grasp = r#"<place name="grasp" components="arm"/>
        <transition name="reach" from="return" to="grasp" timeout="1s"/>
        <transition name="back" from="grasp" to="home" timeout="1s"/>"#;
    bench.saved(version_over(2, arm, &office(grasp)));
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "refused"));
    assert!(why.contains("arm does not run: it was not in the file at the start"), "{why}");
    assert!(why.contains("run the system again"), "{why}");
    let unplaced =
        office("").replace(r#"<place name="hold" components="brake"/>"#, r#"<place name="hold"/>"#);
    let unplaced = unplaced.replace("homing brake", "homing");
    bench.saved(version(3, &unplaced));
    assert!(bench.change().1.contains("`brake` would be in no place"), "{:?}", bench.change());
    let placed = office("").replace(r#"components="brake""#, r#"components="brake free""#);
    bench.saved(version(4, &placed));
    assert!(bench.change().1.contains("`free` is in no place now"), "{:?}", bench.change());
    bench.saved(version_over(5, arm, &office("")));
    assert!(bench.controller.marking(0.0).change.is_none(), "the mission is what it was");
    assert_eq!(bench.controller.marking(0.0).version, 5);
}

#[test]
fn new_exclusions_wait_until_no_components_can_meet() {
    let mut bench = begun(&office(""));
    let exclusive = r#"<exclusive components="explorer driver"/>"#;
    let apart = office(exclusive).replace("explorer driver\"/><place", "explorer\"/><place");
    bench.saved(version(2, &apart));
    assert_eq!(bench.change().0, "waiting", "they are together now");
    let mut bench = begun(&office(""));
    let homing = bench.component("homing");
    bench.tell(ControllerEvent::Lost { component: homing, instance: 3 });
    let exclusive = r#"<exclusive components="driver homing"/>"#;
    let apart = office(exclusive).replace("homing driver\"/>", "homing\"/>");
    bench.saved(version(2, &apart));
    assert!(bench.change().1.contains("both may run"), "{:?}", bench.change());
    bench.gone(homing);
    bench.judge();
    assert_eq!(bench.played(), 2);
}

#[test]
fn a_pause_continues_through_a_change() {
    let late = |s: u32| {
        office(&format!(r#"<transition name="late" from="explore" to="return" timeout="{s}s"/>"#))
    };
    let mut bench = begun(&late(10));
    bench.pass(4 * SECOND);
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.pass(60 * SECOND);
    bench.wanted();
    bench.saved(version(2, &late(20)));
    assert_eq!((bench.played(), bench.wanted()), (2, Vec::new()));
    bench.pass(60 * SECOND);
    bench.orders("ruth", MissionOrder::Resume);
    bench.obey();
    assert_eq!(bench.left_s("late"), Some(16.0));
    assert_eq!(bench.wanted(), ["activate explorer", "activate driver"]);
}

#[test]
fn what_is_asked_and_what_was_reported_are_carried_over() {
    let asks = r#"<transition name="land" from="explore" to="return" autonomy="confirm"
                    answer-within="30s" unanswered="decline"/>"#;
    let mut bench = begun(&office(asks));
    bench.pass(5 * SECOND);
    let asked = |bench: &Bench| {
        let asked = bench.controller.marking(0.0).confirmations;
        asked.into_iter().map(|it| (it.transition, it.answer_by_at_s)).collect::<Vec<_>>()
    };
    let by = asked(&bench);
    let camera = r#"<place name="wait" components="brake"/>
        <transition name="stay" from="explore" to="wait" on="driver.done" priority="-1"/>
        <transition name="on" from="wait" to="return" timeout="1s"/>"#;
    bench.saved(version(2, &office(&[asks, camera].concat())));
    assert_eq!((bench.played(), asked(&bench)), (2, by));
    // No transition waits for this report before the new version is taken.
    let mut bench = begun(&office(""));
    bench.done(bench.component("driver"));
    bench.obey();
    assert_eq!(bench.marked(), ["explore"]);
    bench.saved(version(2, &office(camera)));
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze driver"], "it has been done");
}

#[test]
fn a_guard_that_stays_keeps_its_clock_and_a_new_one_is_weighed() {
    let weak = |more: &str| {
        let weak = r#"<transition name="weak" from="explore" to="return" when="driver.level &lt; 3" timeout="9s"/>"#;
        office(&[weak, more].concat())
    };
    let mut bench = begun(&weak(""));
    let level = armor_plan::WatchId(0);
    bench.tell(ControllerEvent::Sensed { watch: level, value: Some(Scalar::Number(2.0)) });
    bench.pass(4 * SECOND);
    let more = r#"<transition name="hot" from="explore" to="return" when="driver.level &lt; 2.5 and homing.heat > 9"/>"#;
    bench.saved(version(2, &weak(more)));
    assert_eq!((bench.played(), bench.left_s("weak")), (2, Some(5.0)));
    let watches: Vec<_> =
        bench.controller.plan().watches().iter().map(|watch| watch.data.clone()).collect();
    assert_eq!(watches, ["driver.level", "homing.heat"], "what was watched keeps its number");
    let heat = armor_plan::WatchId(1);
    bench.tell(ControllerEvent::Sensed { watch: heat, value: Some(Scalar::Number(10.0)) });
    assert_eq!(bench.wanted(), ["freeze explorer"], "the level is known from before");
}

#[test]
fn killed_at_any_moment_it_comes_back_in_the_old_net_or_in_the_new_one() {
    let late = |s: u32| {
        office(&format!(r#"<transition name="late" from="explore" to="return" timeout="{s}s"/>"#))
    };
    let mut bench = begun(&late(10));
    bench.pass(4 * SECOND);
    let before = bench.records.len();
    bench.saved(version(2, &late(20)));
    assert_eq!(bench.replayed(before).plan().version().number, 1);
    let live = bench.controller.ledger();
    let again = bench.replayed(bench.records.len());
    assert_eq!(again.plan().version().number, 2);
    assert_eq!(again.marking(), live.marking());
    for id in live.plan().net().transition_ids() {
        assert_eq!(again.state().enabled_since(id), live.state().enabled_since(id));
    }
    bench.restarts();
    bench.everybody_appears();
    bench.obey();
    assert_eq!((bench.played(), bench.left_s("late")), (2, Some(16.0)));
    bench.pass(Duration::from_secs(17));
    assert!(bench.controller.ledger().firings().len() + bench.marked().len() > 0);
    assert!(bench.records.iter().any(
        |it| matches!(&it.entry, JournalEntry::Took { cause, .. } if cause.to_string() == "late")
    ));
}

#[test]
fn tokens_are_not_moved_to_where_something_bad_follows() {
    let trap = r#"<place name="pit"/>
        <transition name="out" from="pit" to="home" on="explorer.done"><read place="return"/></transition>"#;
    let mut bench = begun(&office(trap));
    let moved = |bench: &mut Bench, to: &str| {
        let one = MovedTokens { from: "explore".into(), to: to.into(), tokens: 1 };
        bench.orders("ruth", MissionOrder::Move(vec![one]))
    };
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    let refused = moved(&mut bench, "pit");
    assert!(refused.starts_with("refused: from there, E0241: "), "{refused}");
    assert_eq!(bench.marked(), ["explore"]);
    assert!(moved(&mut bench, "return").starts_with("accepted: 1 token is moved"));
    assert_eq!(bench.marked(), ["return"]);
}
