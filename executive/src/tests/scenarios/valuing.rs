//! Values that places give to parameters of components.

use super::bench::{Bench, MS, Office, office};
use crate::controller::Controller;
use crate::roster::Doing;
use crate::terms::ComponentReport;
use crate::tests::simulation::draft::Way;
use armor_petri::PlaceId;
use armor_plan::{ComponentId, GivenValue};
use std::sync::Arc;

fn value(parameter: &str, text: &str) -> GivenValue {
    GivenValue {
        parameter: parameter.to_owned(),
        text: text.to_owned(),
        folder: "maps".into(),
        origin: "robot.xml:1:1".to_owned(),
    }
}

impl Office {
    fn giving(mut self, place: PlaceId, component: ComponentId, text: &str) -> Self {
        self.plan.places[place.index()].values.push((component, value("area", text)));
        self
    }
}

impl Bench {
    fn values(&self, component: ComponentId) -> Vec<String> {
        let name = &self.plan.component(component).name;
        let marking = self.controller.marking(0.0);
        let shown = marking.components.iter().find(|it| it.component == *name).unwrap();
        shown.values.iter().map(|it| format!("{}={}", it.parameter, it.value)).collect()
    }
}

/// Two places in sequence that give the explorer's `area` the values `north` and `second`; the
/// driver runs in both without interruption.
fn two_areas(second: Option<&str>) -> (Office, ComponentId, ComponentId) {
    let mut office = office();
    let (explorer, driver) = (office.explorer, office.driver);
    let again = office.plan.place("again", 0, &[explorer, driver]);
    let way = Way { from: vec![office.explore], to: vec![again], ..office.explored() };
    let explore = office.explore;
    let mut office = office.with("on", way).giving(explore, explorer, "north");
    if let Some(second) = second {
        office = office.giving(again, explorer, second);
    }
    (office, explorer, driver)
}

#[test]
fn an_activation_begins_with_the_values_of_its_places() {
    let (office, explorer, driver) = two_areas(Some("south"));
    let bench = Bench::begun(office);
    assert_eq!(bench.values(explorer), ["area=north"]);
    assert_eq!(bench.values(driver), [] as [&str; 0]);
    let entries: Vec<_> = bench.records.iter().map(|record| record.entry.to_string()).collect();
    assert!(
        entries.contains(&"explorer is activated, number 1 with area=north".to_owned()),
        "{entries:?}"
    );
}

#[test]
fn a_component_that_continues_with_another_value_is_stopped_and_started_again() {
    for (second, values) in [(Some("south"), vec!["area=south"]), (None, vec![])] {
        let (mut office, explorer, _) = two_areas(second);
        // An event fires the transition, so the explorer has not finished and could keep running.
        office.plan.transitions[0].on = Some((explorer, "seen".into()));
        let mut bench = Bench::begun(office);
        let event = ComponentReport::Event { name: "seen".into(), value: 1.0 };
        bench.reports(explorer, bench.activation(explorer), event);
        assert_eq!(bench.wanted(), ["freeze explorer"], "the driver continues undisturbed");
        bench.obey();
        assert_eq!(
            (bench.values(explorer), bench.marked()),
            (to_owned(&values), vec!["again".into()])
        );
    }
}

#[test]
fn a_component_that_continues_with_the_same_value_is_not_disturbed() {
    let (mut office, explorer, _) = two_areas(Some("north"));
    office.plan.transitions[0].on = Some((explorer, "seen".into()));
    let mut bench = Bench::begun(office);
    let event = ComponentReport::Event { name: "seen".into(), value: 1.0 };
    bench.reports(explorer, bench.activation(explorer), event);
    assert_eq!((bench.wanted(), bench.marked()), (vec![], vec!["again".into()]));
}

/// The explorer fails in two places: the first is left for a shelter without the driver, which ends the
/// driver's activation, and the second has no refuge, so at the same moment the mission retreats to a
/// place in which the driver drives on, with another value.
#[test]
fn a_component_that_nothing_needed_for_a_moment_is_stopped_and_started_again() {
    let mut office = office();
    let (explorer, driver) = (office.explorer, office.driver);
    office.plan.place("watch", 1, &[explorer]);
    let shelter = office.plan.place("shelter", 0, &[]);
    let aside = office.plan.place("aside", 0, &[driver]);
    office.plan.places[office.explore.index()].on_failure = Some(shelter);
    office.plan.safe = Some(aside);
    let mut bench = Bench::begun(office.giving(aside, driver, "aside"));
    let before = bench.activation(driver);
    let failed = ComponentReport::Failed { reason: "no way".into() };
    bench.reports(explorer, bench.activation(explorer), failed);
    assert!(bench.wanted().contains(&"freeze driver".to_owned()));
    bench.obey();
    assert_eq!(bench.values(driver), ["area=aside"]);
    assert!(bench.activation(driver) > before && bench.marked() == ["aside"]);
}

#[test]
fn a_component_that_comes_back_is_given_its_values_again() {
    let (office, explorer, _) = two_areas(None);
    let mut bench = Bench::begun(office);
    bench.gone(explorer);
    bench.pass(500 * MS);
    bench.appears(explorer, Doing::Frozen, 0);
    bench.obey();
    assert_eq!(
        (bench.activation(explorer), bench.values(explorer)),
        (3, vec!["area=north".into()])
    );
}

#[test]
fn a_resumed_executive_knows_what_was_given() {
    let (office, explorer, _) = two_areas(None);
    let mut bench = Bench::begun(office);
    let (plan, now) = (Arc::clone(&bench.plan), bench.now);
    bench.controller = Controller::resume(plan, &bench.records, now).unwrap().0;
    assert_eq!(bench.values(explorer), ["area=north"]);
    bench.everybody_appears();
    bench.obey();
    assert_eq!(bench.values(explorer), ["area=north"], "and gives it again");
}

fn to_owned(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|text| (*text).to_owned()).collect()
}
