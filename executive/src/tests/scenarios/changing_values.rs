//! Changes of the values that marked places give while the mission runs: only components whose values differ
//! are started again.

use super::bench::{Bench, SECOND};
use super::changing::{ARRIVED, BACK, EXPLORE, EXPLORED, begun, mission, version};
use crate::event::ControllerEvent;
use crate::ledger::check_same;
use crate::order::MissionOrder;
use crate::record::JournalEntry;
use crate::roster::Doing;
use crate::terms::ComponentReport;
use std::time::Duration;

/// The mission with an area for the explorer in the place that is marked.
fn searching(area: &str) -> String {
    let value = format!(r#"<parameter component="explorer" name="area" value="{area}"/>"#);
    let place = format!("{}{value}</place>", EXPLORE.replace("/>", ">"));
    mission(&[&place, BACK, EXPLORED, ARRIVED].concat())
}

impl Bench {
    /// The values that a component was given with its last activation.
    fn given(&self, name: &str) -> Vec<String> {
        let last = self.controller.ledger().activation(self.component(name));
        last.values.iter().map(ToString::to_string).collect()
    }

    /// Checks that a replay of the journal gives the ledger in force.
    fn check_replay(&self) {
        check_same(&self.replayed(self.records.len()), self.controller.ledger());
    }
}

#[test]
fn values_of_a_marked_place_take_effect_with_the_version_that_has_them() {
    let mut bench = begun(&searching("north"));
    let explorer = bench.component("explorer");
    let (before, driver) = (bench.activation(explorer), bench.component("driver"));
    let driven = bench.activation(driver);
    bench.saved(version(2, &searching("south")));
    assert_eq!(bench.played(), 2);
    assert_eq!(bench.wanted(), ["freeze explorer"], "the driver's values are the same");
    let changed = bench.records.iter().find_map(|it| match &it.entry {
        JournalEntry::Changed { restarts, .. } => Some((restarts.clone(), it.entry.to_string())),
        _ => None,
    });
    let (restarts, words) = changed.expect("the version is in the journal");
    assert_eq!(restarts, ["explorer"]);
    assert!(words.ends_with("; explorer is started again with other values"), "{words}");
    // A report of the drive that is over does not count, even if it arrives before the stop.
    bench.reports(explorer, before, ComponentReport::Done);
    bench.check_replay();
    bench.obey();
    assert_eq!(bench.wanted(), ["activate explorer"]);
    assert_eq!(bench.given("explorer"), ["area=south"]);
    assert!(bench.activation(explorer) > before);
    assert_eq!((bench.activation(driver), bench.marked()), (driven, vec!["explore".to_owned()]));
    bench.check_replay();
    bench.done(explorer);
    bench.obey();
    assert_eq!(bench.marked(), ["return"], "it is done with the new value");
}

#[test]
fn values_that_are_written_elsewhere_or_belong_to_a_coming_place_restart_nothing() {
    let mut bench = begun(&searching("north"));
    // The same value on another line.
    bench.saved(version(
        2,
        &searching("north").replace("<place name=\"explore\"", "\n\n<place name=\"explore\""),
    ));
    assert_eq!(bench.wanted(), [] as [&str; 0]);
    let coming = r#"<place name="return" components="homing driver"><parameter component="homing" name="area" value="far"/></place>"#;
    bench.saved(version(3, &searching("north").replace(BACK, coming)));
    assert_eq!((bench.played(), bench.wanted()), (3, Vec::new()));
    bench.done(bench.component("explorer"));
    bench.obey();
    assert_eq!(
        (bench.given("homing"), bench.marked()),
        (vec!["area=far".into()], vec!["return".into()])
    );
}

#[test]
fn a_value_that_goes_is_no_longer_given_and_one_that_has_been_done_is_done_again() {
    let mut bench = begun(&searching("north"));
    let (explorer, driver) = (bench.component("explorer"), bench.component("driver"));
    let both = searching("north").replace("on=\"explorer.done\"", "on=\"driver.done\"");
    bench.saved(version(2, &both));
    bench.done(explorer);
    assert_eq!(bench.marked(), ["explore"], "the explorer has finished, and the driver not");
    bench.saved(version(
        3,
        &both.replace("<parameter component=\"explorer\" name=\"area\" value=\"north\"/>", ""),
    ));
    bench.obey();
    assert_eq!((bench.played(), bench.given("explorer")), (3, Vec::new()));
    assert!(!bench.controller.ledger().activation(explorer).done);
    bench.done(driver);
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
}

#[test]
fn in_a_pause_the_new_values_wait_for_its_end() {
    let mut bench = begun(&searching("north"));
    bench.orders("ruth", MissionOrder::Pause);
    bench.obey();
    bench.pass(60 * SECOND);
    bench.wanted();
    bench.saved(version(2, &searching("south")));
    assert_eq!((bench.played(), bench.wanted()), (2, Vec::new()));
    bench.orders("ruth", MissionOrder::Resume);
    bench.obey();
    assert_eq!(bench.wanted(), ["activate explorer", "activate driver"]);
    assert_eq!(bench.given("explorer"), ["area=south"]);
    bench.check_replay();
}

/// The executive is killed between the record of the version and the stop of the component, which
/// comes back as it ran: with the value of before.
#[test]
fn killed_before_the_component_is_stopped_it_stops_it_and_gives_the_new_value() {
    let mut bench = begun(&searching("north"));
    let explorer = bench.component("explorer");
    let before = bench.activation(explorer);
    // Longer than a component may take to come up: the time counts from the change.
    bench.pass(120 * SECOND);
    bench.saved(version(2, &searching("south")));
    bench.wanted();
    bench.restarts();
    for component in bench.plan.component_ids() {
        let runs = ["explorer", "driver"].map(|name| bench.component(name)).contains(&component);
        let doing = if runs { Doing::Active } else { Doing::Frozen };
        bench.appears(component, doing, if runs { bench.activation(component) } else { 0 });
    }
    assert_eq!(bench.wanted(), ["freeze explorer"]);
    bench.obey();
    assert_eq!(
        (bench.given("explorer"), bench.marked()),
        (vec!["area=south".into()], vec!["explore".into()])
    );
    assert!(bench.activation(explorer) > before);
}

/// A component that does not stop for its new values is killed, and begins with them when its
/// process is back.
#[test]
fn one_that_does_not_stop_for_its_new_values_is_killed_and_begins_with_them() {
    let mut bench = begun(&searching("north"));
    let explorer = bench.component("explorer");
    bench.pass(120 * SECOND);
    bench.saved(version(2, &searching("south")));
    bench.pass(Duration::from_millis(2200));
    assert_eq!(bench.wanted(), ["freeze explorer", "freeze explorer", "kill explorer"]);
    bench.gone(explorer);
    bench.appears(explorer, Doing::Frozen, 0);
    bench.obey();
    assert_eq!(
        (bench.given("explorer"), bench.marked()),
        (vec!["area=south".into()], vec!["explore".into()])
    );
}

/// The version is played when it has been read: nothing is proven.
fn is_taken_unproven(bench: &mut Bench, number: u64, mission: &str) -> bool {
    bench.tell(ControllerEvent::Offered(version(number, mission)));
    let read = bench.controller.question().expect("it is read");
    bench.tell(read.answer(&|| None));
    let is_taken = bench.played() == number;
    assert_eq!(bench.controller.question().is_some(), !is_taken);
    is_taken
}

#[test]
fn a_version_that_gives_other_values_alone_is_taken_without_a_proof() {
    let mut bench = begun(&searching("north"));
    assert!(is_taken_unproven(&mut bench, 2, &searching("south")));
    bench.obey();
    assert_eq!(bench.given("explorer"), ["area=south"]);
    // Another time, and another claim, are proven.
    let later = |area| searching(area).replace(r#"timeout="1h""#, r#"timeout="2h""#);
    assert!(!is_taken_unproven(&mut bench, 3, &later("south")));
    bench.judge();
    let claimed =
        later("west").replace("</mission>", "<check>never home and hold</check></mission>");
    assert!(!is_taken_unproven(&mut bench, 4, &claimed));
    bench.judge();
    assert_eq!(bench.played(), 4);
    bench.obey();
    assert_eq!(bench.given("explorer"), ["area=west"]);
    bench.check_replay();
}

/// While it was read, the mission has moved on.
#[test]
fn a_version_that_gives_other_values_alone_is_taken_wherever_the_mission_has_come() {
    let mut bench = begun(&searching("north"));
    bench.tell(ControllerEvent::Offered(version(2, &searching("south"))));
    let read = bench.controller.question().expect("it is read");
    bench.done(bench.component("explorer"));
    bench.obey();
    assert_eq!(bench.marked(), ["return"]);
    bench.wanted();
    bench.tell(read.answer(&|| None));
    assert_eq!((bench.played(), bench.wanted()), (2, Vec::new()));
    bench.check_replay();
}

/// Two places that are marked together give the driver the same speed, then different ones.
#[test]
fn values_that_contradict_each_other_only_now_are_proven_and_refused() {
    let driven = |speed: &str| {
        let give = |speed: &str| {
            format!(r#"<parameter component="driver" name="speed" value="{speed}"/></place>"#)
        };
        let explore = EXPLORE.replace("/>", ">") + &give("1");
        let watch = r#"<place name="watch" initial="true" components="driver">"#.to_owned();
        let watch = watch + &give(speed);
        let ends = r#"<transition name="seen" from="watch" to="home" timeout="1h"/>"#;
        mission(&[&explore, &watch, BACK, EXPLORED, ARRIVED, ends].concat())
    };
    let mut bench = Bench::playing(version(1, &driven("1")).plan().expect("a mission"));
    bench.everybody_appears();
    bench.obey();
    bench.wanted();
    assert!(!is_taken_unproven(&mut bench, 2, &driven("2")));
    bench.judge();
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "refused"), "{why}");
    assert!(why.contains("marked together"), "{why}");
}

/// A version whose proof was not over when the mission was: that it is not played is reported.
#[test]
fn a_version_that_is_not_played_before_the_mission_ends_is_refused() {
    let mut bench = begun(&searching("north"));
    let later = searching("north").replace(r#"timeout="1h""#, r#"timeout="2h""#);
    assert!(!is_taken_unproven(&mut bench, 2, &later));
    assert_eq!(bench.change(), ("waiting".to_owned(), "it is being proven".to_owned()));
    for component in ["explorer", "homing"] {
        bench.done(bench.component(component));
        bench.obey();
    }
    assert_eq!(bench.marked(), ["home"]);
    let (state, why) = bench.change();
    assert_eq!((bench.played(), state.as_str()), (1, "refused"));
    assert!(why.starts_with("the mission ended before it was played"), "{why}");
}
