//! A mission that was played, compared with its times, by the names of the net.

use std::path::Path;
use std::time::Duration;

use armor_robotfile::timing::{
    JournalFiring, Rehearsal, RehearsedEnd, StepBounds, StraightLengths, Timetable,
};
use armor_robotfile::{Configuration, check, read};

const FILE: &str = r#"<armor version="1">
  <system name="two"><component name="r" kind="patrol"/><component name="b" kind="patrol"/></system>
  <mission goal="over" safe="hold">
    <map>
      <point name="A" at="0 0"/><point name="B" at="10 0"/><point name="C" at="0 5"/>
      <line name="green" kind="phase" shape="5,-1 5,1" not-before="2026-11-21T14:30:00Z"/>
    </map>
    <route name="red" mover="r.route" start="A" out="over">
      <leg name="l1" to="B" speed="1m/s"/>
      <meet name="m1" with="blue"/>
      <otherwise on="blocked" do="hold"/>
    </route>
    <route name="blue" mover="b.route" start="C" out="over">
      <leg name="b1" to="A" speed="1m/s"/>
      <meet name="m1" with="red"/>
      <stay name="s1" for="3s"/>
      <otherwise on="blocked" do="hold"/>
    </route>
    <place name="over"/><place name="hold"/>
  </mission>
</armor>"#;

fn configuration() -> Configuration {
    let reading = read(Path::new("two.xml"), &mut |_| Ok(FILE.as_bytes().to_vec()));
    let reading = check(reading, &[], None);
    reading.configuration.expect("it can be read")
}

fn firing(at_s: u64, transition: &str, from: &[&str]) -> JournalFiring {
    JournalFiring {
        at: Duration::from_secs(at_s),
        transition: Some(transition.into()),
        from: from.iter().map(ToString::to_string).collect(),
    }
}

fn compare(firings: &[JournalFiring]) -> Rehearsal {
    let configuration = configuration();
    let mission = configuration.mission.as_ref().expect("a mission");
    let begin = Some("2026-11-21T14:29:52Z".parse().expect("a date"));
    let table = Timetable::of_mission(mission, &configuration.system, &StraightLengths, begin);
    Rehearsal::compare(mission, &table, firings)
}

#[test]
fn each_step_ends_with_its_own_transition() {
    let rehearsal = compare(&[
        firing(5, "blue.b1.done", &["blue.b1"]),
        firing(6, "red.l1.reached", &["red.l1"]),
        firing(8, "red.l1.at-green.crosses", &["red.l1.at-green"]),
        firing(13, "red.l1.after-green.done", &["red.l1.after-green"]),
        firing(13, "red.m1.met", &["red.m1", "blue.m1"]),
        firing(16, "blue.s1.done", &["blue.s1"]),
    ]);
    let ends: Vec<_> = rehearsal
        .steps
        .iter()
        .map(|step| {
            let RehearsedEnd::Done(at) = step.end else { panic!("{step:?}") };
            let length = step.length.expect("it has one").as_secs();
            (step.route.as_str(), step.step.as_str(), at.as_secs(), length)
        })
        .collect();
    assert_eq!(
        ends,
        [
            ("red", "l1 to green", 8, 8),
            ("red", "l1", 13, 5),
            ("red", "m1", 13, 0),
            ("blue", "b1", 5, 5),
            ("blue", "m1", 13, 8),
            ("blue", "s1", 16, 3),
        ]
    );
    assert_eq!(rehearsal.list_outside().count(), 0, "{rehearsal:?}");
    let error = rehearsal.leg_error().expect("three legs");
    assert!(error.legs == 3 && error.p90 < 1e-9, "{error:?}");
}

#[test]
fn a_step_that_was_left_or_that_did_not_begin_is_not_done() {
    let retreat = JournalFiring { transition: None, ..firing(9, "", &["blue.m1"]) };
    let rehearsal = compare(&[
        firing(2, "red.l1.blocked", &["red.l1"]),
        firing(9, "blue.b1.done", &["blue.b1"]),
        retreat,
    ]);
    let by = Some("red.l1.blocked".to_owned());
    let left = RehearsedEnd::Left { at: Duration::from_secs(2), by };
    assert_eq!(rehearsal.steps[0].end, left);
    assert_eq!(rehearsal.steps[1].end, RehearsedEnd::Open);
    // At most 5 m at 0.8 m/s.
    assert_eq!(rehearsal.steps[3].bounds(), StepBounds::Late(Duration::from_millis(2750)));
    let given_up = RehearsedEnd::Left { at: Duration::from_secs(9), by: None };
    assert_eq!(rehearsal.steps[4].end, given_up);
    assert_eq!(rehearsal.list_outside().count(), 6);
}

#[test]
fn a_leg_that_an_operator_resumed_ends_when_it_is_done() {
    let rehearsal = compare(&[
        firing(2, "blue.b1.recall", &["blue.b1"]),
        firing(4, "blue.b1.at-R1.resume", &["blue.b1.at-R1"]),
        firing(6, "blue.b1.done", &["blue.b1"]),
    ]);
    assert_eq!(rehearsal.steps[3].end, RehearsedEnd::Done(Duration::from_secs(6)));
}
