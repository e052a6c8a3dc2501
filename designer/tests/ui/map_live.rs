//! A mission on the map while it runs: robots, legs, tracks, progress and orders.

use armor_inspect::{MissionLook, ParameterClient};
use armor_marking::{
    EnabledTransition, Fired, FiringDecider, MarkedPlace, Marking, MarkingStage, Paused,
};
use armor_sdk::configuration::ParameterList;
use armor_sdk::messages::{
    Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, TrackedObject, Tracks,
    Vector3,
};
use eframe::egui::{Key, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;
use crate::ui::map::map;
use crate::ui::still_system::{playing, radar};

/// Two legs of 10 m at 1 m/s, past a pit.
pub(super) const DRIVEN: &str = r#"<armor version="1">
  <system name="bench">
    <component name="way" kind="way"/>
    <component name="driver" kind="way">
      <parameter name="speed" value="1m/s"/>
    </component>
  </system>
  <mission name="drive" goal="over" safe="hold">
    <map>
      <point name="P1" at="0 0"/>
      <point name="P2" at="10 0"/>
      <point name="P3" at="10 10"/>
      <zone name="pit" kind="no-go" margin="0.5m" shape="4,3 8,3 8,6 4,6"/>
      <rally name="R1" at="-2 0"/>
    </map>
    <route name="red" mover="way.route" pace="driver.speed" pose="eye.pose" start="P1" out="over" radius="0.5m" patience="1min">
      <leg name="l1" to="P2" speed="1m/s" by="1min"/>
      <leg name="l2" to="P3" speed="1m/s" by="12s"/>
      <otherwise on="recall" do="rally"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
  </mission>
</armor>
"#;

fn enabled(name: &str) -> EnabledTransition {
    EnabledTransition {
        transition: name.into(),
        enabled_at_s: 0.0,
        earliest_at_s: 0.0,
        latest_at_s: None,
        by: FiringDecider::Operator,
        held: false,
    }
}

/// The second leg is under way since 12 s, 15 s after the begin.
pub(super) fn marking() -> Marking {
    let place =
        MarkedPlace { place: "red.l2".into(), tokens: 1, active: true, waits_for: Vec::new() };
    Marking {
        places: vec![place],
        enabled: vec![enabled("red.l2.recall"), enabled("abort")],
        fired: 1,
        history: vec![Fired { transition: "red.l1.done".into(), fired_at_s: 12.0 }],
        ..playing("drive", 15.0)
    }
}

pub(super) fn pose(frame: &str, x: f64, y: f64) -> PoseWithCovarianceStamped {
    let position = Point { x, y, z: 0.0 };
    let orientation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
    let pose = PoseWithCovariance { pose: Pose { position, orientation }, ..Default::default() };
    PoseWithCovarianceStamped { frame: frame.into(), pose, ..Default::default() }
}

/// A window on the map with the strip open, and a robot in the second leg.
fn driving(marking: Marking) -> Window {
    let mut window = map(DRIVEN);
    let live = &mut window.harness.state_mut().workspace().live;
    let parameters = ParameterClient::still(
        ParameterList { version: 1, refused: false, parameters: Vec::new() },
        None,
    );
    live.show_still(radar(), MissionLook::of(marking), parameters).unwrap();
    shows(&mut window, "eye.pose", &pose("map", 10.0, 4.0));
    window.key(Key::P);
    shows(&mut window, "eye.pose", &pose("map", 10.0, 4.0));
    window.harness.run_steps(2);
    window
}

fn shows<M: armor_wire::WireType>(window: &mut Window, data: &str, message: &M) {
    let live = &window.harness.state_mut().workspace().live;
    live.watched().expect("a system").values.show_still(data, message);
}

/// Lets so much time of the window pass.
fn pass(window: &mut Window, seconds: f32) {
    // A frame is a quarter of a second of the window.
    window.harness.run_steps((seconds * 4.0).ceil() as usize);
}

fn ordered(window: &mut Window) -> Vec<String> {
    let live = &window.harness.state_mut().workspace().live;
    let given = live.watched().map(|watched| watched.orders.given()).unwrap_or_default();
    given.into_iter().map(|given| given.order).collect()
}

#[test]
fn a_robot_is_at_its_pose_with_done_and_coming_legs() {
    let mut window = driving(marking());
    assert!(window.has_part("robot red, l2, "), "its name has its step");
    assert!(window.has("step l1 of red: done") && window.has("step l2 of red: under way"));
    let (from, to) = (window.at("point P2"), window.at("point P3"));
    let label = "robot red, l2, ";
    let at = window.harness.get_by_label_contains(label).rect().center();
    assert!((at - (from + (to - from) * 0.4)).length() < 2.0, "{at}");
    // Closed, nothing of it is left, and no output is linked to.
    window.key(Key::P);
    window.settle();
    assert!(!window.has_part("robot red") && !window.has_part("step l1 of red"));
}

#[test]
fn the_strip_has_the_progress_and_what_is_expected() {
    let window = driving(marking());
    assert!(window.has("step of red: l2"));
    assert!(window.has("done of red: 14.0 of 20.0 m"));
    assert!(window.has("left of red: 6.0 m"));
    assert!(window.has("off the leg of red: 0.00 m"));
    // The first leg took 12 s in place of 10 s, 4 m of the second one took 3 s: 15 s for 14 m.
    assert!(window.has("expected of red: in 6.4 s"), "{:?}", window.parts("expected of red"));
    assert!(
        window.has("against nominal of red: 1.4 s late"),
        "{:?}",
        window.parts("against nominal")
    );
    assert!(window.has("limit of red: by 12 s: 2.6 s left"), "{:?}", window.parts("limit of red"));
    assert!(window.has("zones of red: 1.0 m to pit"), "{:?}", window.parts("zones of red"));
}

#[test]
fn an_old_pose_is_drawn_as_old_and_one_of_another_origin_is_not_drawn() {
    let mut window = driving(marking());
    pass(&mut window, 4.0);
    assert!(
        window.has_part("robot red, seen 4 s ago") || window.has_part("robot red, seen 5 s ago"),
        "{:?}",
        window.parts("robot red")
    );
    assert!(window.has("left of red: -"), "an old pose is no base for what is expected");
    shows(&mut window, "eye.pose", &pose("map", 10.0, 5.0));
    pass(&mut window, 0.5);
    assert!(window.has_part("robot red, l2, ") && window.has("left of red: 5.0 m"));
    shows(&mut window, "eye.pose", &pose("map#3f2a", 10.0, 5.0));
    pass(&mut window, 0.5);
    assert!(!window.has_part("robot red,"));
    assert!(window.has_part("not drawn of red: not drawn: its pose is in `map#3f2a`"));
}

#[test]
fn an_operator_recalls_a_robot_pauses_and_goes_to_safety_from_the_map() {
    let mut window = driving(marking());
    window.click("Fire red.l2.recall");
    window.click("Fire abort");
    window.click("Pause");
    window.click("Safe place");
    window.click("Yes, to the safe place");
    let orders = ordered(&mut window);
    assert_eq!(orders.len(), 4, "{orders:?}");
    assert!(orders[0].contains("red.l2.recall") && orders[1].contains("abort"), "{orders:?}");

    let mut paused = marking();
    paused.stage = MarkingStage::Paused;
    paused.pause = Some(Paused { by: "ruth".into(), since_at_s: 14.0, at_rest: true });
    paused.enabled.iter_mut().for_each(|enabled| enabled.held = true);
    let mut window = driving(paused);
    assert!(window.has("Resume"));
    window.click("Fire red.l2.recall");
    assert_eq!(ordered(&mut window), [] as [String; 0], "it waits for the end of the pause");
}

#[test]
fn tracks_are_symbols_that_age_and_go() {
    let mut window = driving(marking());
    let track = |id: &str, sidc: &str, x: f64| TrackedObject {
        id: id.into(),
        sidc: sidc.into(),
        position: Point { x, y: 8.0, z: 0.0 },
        velocity: Vector3 { x: 3.0, y: 4.0, z: 0.0 },
        stamp: 0.0,
    };
    let tracks = vec![track("t1", "10061000121211000000", 2.0), track("t2", "nonsense", 4.0)];
    shows(&mut window, "radar.tracks", &Tracks { stamp: 0.0, frame: "map".into(), tracks });
    pass(&mut window, 0.5);
    assert!(window.has("track t1, 5.0 m/s") && window.has("track t2, 5.0 m/s"));
    let (origin, along) = (window.at("point P1"), window.at("point P2"));
    let metre = (along - origin).x / 10.0;
    assert!((window.at("track t1, 5.0 m/s") - origin - vec2(2.0, -8.0) * metre).length() < 2.0);
    pass(&mut window, 20.0);
    assert!(
        window.has_part("track t1, 5.0 m/s, 20 s old")
            || window.has_part("track t1, 5.0 m/s, 21 s old"),
        "{:?}",
        window.parts("track t1")
    );
    pass(&mut window, 45.0);
    assert!(!window.has_part("track t1"), "{:?}", window.parts("track t1"));
    let tracks = vec![track("t1", "10061000121211000000", 2.0)];
    shows(&mut window, "radar.tracks", &Tracks { stamp: 0.0, frame: "map#2".into(), tracks });
    pass(&mut window, 0.5);
    assert!(!window.has_part("track t1"));
    assert!(window.has_part("The tracks of radar.tracks are not drawn: in `map#2`"));
}

#[test]
fn without_a_system_and_with_another_mission_the_strip_states_so() {
    let mut window = map(DRIVEN);
    window.key(Key::P);
    window.settle();
    assert!(window.has_part("No system is watched"));
    let mut other = marking();
    other.mission = "another".into();
    let window = driving(other);
    assert!(window.has_part("plays the mission another, not this one"));
}
