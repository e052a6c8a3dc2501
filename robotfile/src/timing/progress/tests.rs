//! What a mission in progress is shown as: the routes of one file, and made-up observations of them.

use std::path::Path;

use super::*;
use crate::site_map::ZoneKind;

/// Two robots that meet in the middle, 10 m from where each begins, at 1 m/s; then both drive 10 m more.
const MEETING: &str = r#"<armor version="1">
  <system name="two">
    <component name="red-way" kind="patrol"/>
    <component name="blue-way" kind="patrol"/>
    <component name="red-driver" kind="driver"/>
  </system>
  <mission goal="over" safe="hold">
    <map>
      <point name="A" at="0 0"/><point name="M" at="10 0"/><point name="B" at="20 0"/>
      <point name="C" at="10 -10"/><rally name="R1" at="0 5"/>
      <zone name="pit" kind="no-go" margin="0.5m" shape="4,3 8,3 8,6 4,6"/>
      <zone name="yard" kind="stay-in" shape="-1,-11 21,-11 21,8 -1,8"/>
      <zone name="far" kind="observe" shape="circle 100,100 5m"/>
    </map>
    <route name="red" mover="red-way.route" pace="red-driver.speed" pose="mapper.pose" start="A" out="over"
           radius="0.5m" patience="1min">
      <leg name="l1" to="M" speed="1m/s" by="15s"/>
      <meet name="m1" with="blue" patience="9s"/>
      <leg name="l2" to="B" speed="1m/s" by="12s"/>
      <stay name="s1" for="4s"/>
      <otherwise on="late blocked recall" do="rally"/>
    </route>
    <route name="blue" mover="blue-way.route" start="C" out="over">
      <leg name="b1" to="M" speed="0.5m/s"/>
      <meet name="m1" with="red" patience="1min"/>
      <leg name="b2" to="C" speed="0.5m/s"/>
    </route>
    <place name="over"/><place name="hold"/>
  </mission>
</armor>"#;

fn followed(text: &str) -> FollowedMission {
    let reading = crate::read(Path::new("m.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    let configuration = reading.configuration.expect("it can be read");
    let mission = configuration.mission.as_ref().expect("a mission");
    FollowedMission::of_mission(mission, &configuration.system)
}

fn at(x_m: f64, y_m: f64) -> Option<MapPoint> {
    Some(MapPoint::new(x_m, y_m).expect("a position"))
}

fn robot(x_m: f64, y_m: f64) -> RobotSighting {
    RobotSighting { at: at(x_m, y_m), path: Vec::new() }
}

/// Each step with its stand and its end in seconds: `l1 done 12.0, m1 current ?`.
fn steps(progress: &RouteProgress) -> String {
    let words = progress.steps.iter().map(|step| {
        let stand = match step.stand {
            StepStand::Done => "done",
            StepStand::Current => "current",
            StepStand::Coming => "coming",
        };
        let end = step.end_s.map_or("?".to_owned(), |end_s| format!("{end_s:.1}"));
        format!("{} {stand} {end}", step.step)
    });
    words.collect::<Vec<_>>().join(", ")
}

fn near(value: Option<f64>, expected: f64) -> bool {
    value.is_some_and(|value| (value - expected).abs() < 1e-6)
}

#[test]
fn before_anything_is_observed_the_times_are_those_of_the_file() {
    let [red, blue] = &followed(MEETING).progress(&MissionSighting::default())[..] else {
        panic!("two routes")
    };
    // Blue takes 20 s to the meeting.
    assert_eq!(steps(red), "l1 coming 10.0, m1 coming 20.0, l2 coming 30.0, s1 coming 34.0");
    assert_eq!(steps(blue), "b1 coming 20.0, m1 coming 20.0, b2 coming 40.0");
    assert_eq!((red.stand.clone(), red.current, red.total_m), (RouteStand::Waiting, None, 20.0));
    assert!(red.steps.iter().all(|step| step.late_s() == Some(0.0)));
}

#[test]
fn a_robot_that_is_slower_is_expected_later_on_all_that_is_left() {
    let mission = followed(MEETING);
    // Red has driven 5 m in 8 s, 0.3 m to the side of its leg; blue is on time.
    let seen = MissionSighting {
        now_s: 8.0,
        places: vec!["red.l1", "blue.b1"],
        robots: vec![robot(5.0, 0.3), robot(10.0, -6.0)],
        ..MissionSighting::default()
    };
    let progress = mission.progress(&seen);
    let [red, blue] = &progress[..] else { panic!("two routes") };
    assert_eq!((red.stand.clone(), red.current), (RouteStand::Underway, Some(0)));
    assert!((red.stretch - 1.6).abs() < 0.02, "{}", red.stretch);
    assert!(near(red.off_leg_m, 0.3) && near(red.speed_mps, 5.0 / 8.0), "{red:?}");
    assert!(near(Some(red.done_m), 5.0) && near(red.left_m, 5.0_f64.hypot(0.3)), "{red:?}");
    let eta_s = red.steps[0].end_s.expect("a time");
    assert!((eta_s - 16.0).abs() < 0.15, "{eta_s}");
    let late_s = red.late_s().expect("a time");
    assert!((late_s - 6.0).abs() < 0.15, "{late_s}");
    let limit = red.steps[0].limit.as_ref().expect("by");
    assert_eq!((limit.words.as_str(), limit.at_s), ("by 15 s", 15.0));
    assert!(limit.left_s.is_some_and(|left_s| left_s < 0.0), "it is expected to be late");
    // The meeting waits for blue: 8 s for 4 m should have been 8 s.
    assert_eq!(steps(blue), "b1 current 20.0, m1 coming 20.0, b2 coming 40.0");
    assert!(near(red.steps[1].end_s, 20.0));
    // The pace of red stretches the drive after the meeting, and not the stay.
    let l2_s = red.steps[2].end_s.expect("a time") - 20.0;
    assert!((l2_s - 10.0 * red.stretch).abs() < 1e-6, "{l2_s}");
    assert!(near(red.end_s(), 20.0 + l2_s + 4.0));
}

#[test]
fn past_legs_correct_what_is_expected_and_their_ends_stay() {
    let mission = followed(MEETING);
    let seen = MissionSighting {
        now_s: 26.0,
        places: vec!["red.l2", "blue.b2"],
        fired: vec![("red.l1.done", 20.0), ("blue.b1.done", 22.0), ("red.m1.met", 25.0)],
        robots: vec![robot(10.5, 0.0), RobotSighting::default()],
        ..MissionSighting::default()
    };
    let progress = mission.progress(&seen);
    let [red, blue] = &progress[..] else { panic!("two routes") };
    // Half a metre is too little to compare: the first leg took twice its time.
    assert_eq!(red.stretch, 2.0);
    assert_eq!(steps(red), "l1 done 20.0, m1 done 25.0, l2 current 45.0, s1 coming 49.0");
    assert!(near(red.steps[0].late_s(), 10.0) && red.steps[0].limit.is_none());
    assert!(near(red.steps[2].limit.as_ref().map(|limit| limit.at_s), 37.0));
    assert!(near(Some(red.done_m), 10.5));
    // Without a pose nothing is known of the rest, and so of the end.
    assert_eq!(steps(blue), "b1 done 22.0, m1 done 25.0, b2 current ?");
    assert_eq!((blue.left_m, blue.off_leg_m), (None, None));
}

#[test]
fn a_published_path_is_longer_than_the_straight_line() {
    let mission = followed(MEETING);
    let way = [(1.0, 0.0), (1.0, 4.0), (10.0, 4.0), (10.0, 0.2)];
    let path = way.map(|(x_m, y_m)| at(x_m, y_m).expect("a position")).to_vec();
    let mut seen = MissionSighting {
        places: vec!["red.l1", "blue.b1"],
        robots: vec![RobotSighting { at: at(1.0, 1.0), path }],
        ..MissionSighting::default()
    };
    assert!(near(mission.progress(&seen)[0].left_m, 3.0 + 9.0 + 3.8 + 0.2));
    // A path to another point is not of this leg.
    seen.robots[0].path.pop();
    assert!(near(mission.progress(&seen)[0].left_m, 9.0_f64.hypot(1.0)));
}

#[test]
fn a_pause_takes_no_time_of_the_pace_and_puts_off_limits() {
    let mission = followed(MEETING);
    let seen = MissionSighting {
        now_s: 105.0,
        places: vec!["red.l1", "blue.b1"],
        pauses: vec![[2.0, 102.0]],
        robots: vec![robot(5.0, 0.0), robot(10.0, -7.5)],
        ..MissionSighting::default()
    };
    let red = &mission.progress(&seen)[0];
    assert_eq!(red.stretch, 1.0);
    assert!(near(red.steps[0].end_s, 110.0) && near(red.speed_mps, 1.0), "{red:?}");
    let limit = red.steps[0].limit.as_ref().expect("by");
    assert!(near(Some(limit.at_s), 115.0) && near(limit.left_s, 5.0), "{limit:?}");
}

#[test]
fn a_detour_an_end_and_a_route_that_was_left_are_told_apart() {
    let mission = followed(MEETING);
    let stand = |places: &[&str], fired: &[(&str, f64)]| {
        let (places, fired) = (places.to_vec(), fired.to_vec());
        let seen = MissionSighting { now_s: 50.0, places, fired, ..MissionSighting::default() };
        let red = mission.progress(&seen).swap_remove(0);
        (red.stand.clone(), red.current, steps(&red))
    };
    let (to_rally, current, ends) = stand(&["red.l1.to-R1"], &[("red.l1.late", 15.0)]);
    assert_eq!(to_rally, RouteStand::Detour { point: "R1".into(), is_there: false });
    assert_eq!(current, Some(0));
    assert_eq!(ends, "l1 current ?, m1 coming ?, l2 coming ?, s1 coming ?");
    let (at_rally, ..) = stand(&["red.l1.at-R1"], &[("red.l1.to-R1.done", 20.0)]);
    assert_eq!(at_rally, RouteStand::Detour { point: "R1".into(), is_there: true });
    let (ended, current, ends) = stand(&["over"], &[("red.l2.done", 30.0), ("red.s1.done", 34.0)]);
    assert_eq!((ended, current), (RouteStand::Ended, None));
    assert_eq!(ends, "l1 done ?, m1 done ?, l2 done 30.0, s1 done 34.0");
    let (left, current, _) = stand(&["hold"], &[("red.l1.to-R1.blocked", 20.0)]);
    assert_eq!((left, current), (RouteStand::Left, None));
}

#[test]
fn a_leg_that_is_resumed_counts_from_then() {
    let mission = followed(MEETING);
    let seen = MissionSighting {
        now_s: 64.0,
        places: vec!["red.l1", "blue.m1"],
        fired: vec![("red.l1.recall", 5.0), ("red.l1.at-R1.resume", 60.0), ("blue.b1.done", 21.0)],
        robots: vec![robot(4.0, 0.0), robot(10.0, 0.0)],
        ..MissionSighting::default()
    };
    let progress = mission.progress(&seen);
    let red = &progress[0];
    assert!(near(red.steps[0].end_s, 70.0) && near(red.speed_mps, 1.0), "{red:?}");
    assert!(near(red.steps[0].limit.as_ref().map(|limit| limit.at_s), 75.0));
    // Blue waits at the meeting until red is there.
    assert!(near(progress[1].steps[1].end_s, 70.0), "{}", steps(&progress[1]));
}

#[test]
fn the_zones_near_are_listed_by_the_distance_of_the_robots_rim() {
    let mission = followed(MEETING);
    let zones = |x_m: f64, y_m: f64| {
        let robots = vec![robot(x_m, y_m)];
        let seen = MissionSighting { robots, ..MissionSighting::default() };
        mission.progress(&seen).swap_remove(0).zones
    };
    let found = zones(5.0, 0.0);
    let names: Vec<_> = found.iter().map(|zone| (zone.zone.as_str(), zone.kind)).collect();
    assert_eq!(names, [("pit", ZoneKind::NoGo), ("yard", ZoneKind::StayIn)]);
    // 3 m, less the margin and the radius.
    assert!(near(Some(found[0].distance_m), 2.0) && !found[0].is_inside);
    assert!(found[1].is_inside);
    let found = zones(6.0, 4.0);
    assert!(found[0].is_inside && found[0].distance_m == 0.0, "{found:?}");
    let found = zones(-0.8, 0.0);
    let yard = found.iter().find(|zone| zone.zone == "yard").expect("it is near");
    assert!(!yard.is_inside && yard.distance_m == 0.0, "a part of the robot is out of it");
}

#[test]
fn at_a_phase_line_the_robot_waits_for_its_date() {
    let text = MEETING.replace(
        "<rally name",
        r#"<line name="green" kind="phase" shape="5,-1 5,1" not-before="2026-11-21T14:30:00Z"/><rally name"#,
    );
    let mission = followed(&text);
    let mut seen = MissionSighting {
        now_s: 6.0,
        utc: Some("2026-11-21T14:29:50Z".parse().expect("a date")),
        places: vec!["red.l1.at-green", "blue.b1"],
        fired: vec![("red.l1.reached", 5.0)],
        robots: vec![robot(5.0, 0.0)],
        ..MissionSighting::default()
    };
    let red = mission.progress(&seen).swap_remove(0);
    assert_eq!(
        (red.stand.clone(), red.current, red.left_m),
        (RouteStand::Underway, Some(0), Some(0.0))
    );
    assert!(steps(&red).starts_with("l1 to green current 16.0, l1 coming 21.0"), "{}", steps(&red));
    seen.utc = None;
    let red = mission.progress(&seen).swap_remove(0);
    assert!(steps(&red).starts_with("l1 to green current ?, l1 coming ?"), "{}", steps(&red));
}
