//! Changes of the values that marked places give while the mission runs: only components whose values differ
//! are started again.

use super::bench::{Bench, SECOND};
use super::changing::{ARRIVED, BACK, EXPLORE, EXPLORED, begun, mission, version};
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
