//! The strip of the times under the map: the slider, the marks, the lists.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::ui::Window;
use crate::ui::map::map;

/// Two robots whose legs cross: both are at 5 0 after 5 s.
const CROSSING: &str = r#"<armor version="1">
  <system name="bench">
    <component name="way" kind="way"/>
    <component name="path" kind="way"/>
  </system>
  <mission goal="over" safe="hold">
    <map>
      <point name="P1" at="0 0"/>
      <point name="P2" at="10 0"/>
      <point name="Q1" at="5 -5"/>
      <point name="Q2" at="5 5"/>
    </map>
    <route name="red" mover="way.route" start="P1" out="over" radius="0.5m">
      <leg name="l1" to="P2" speed="1m/s" by="10s"/>
    </route>
    <route name="blue" mover="path.route" start="Q1" radius="0.5m">
      <leg name="b1" to="Q2" speed="1m/s" by="1min"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
  </mission>
</armor>
"#;

/// A window with the strip open, and everything computed.
fn times(text: &str) -> Window {
    let mut window = map(text);
    window.key(Key::T);
    window
        .until("the chances", |window| window.has_part("Of 1000 draws") && !window.has_part(": …"));
    window
}

#[test]
fn the_strip_is_opened_and_closed() {
    let mut window = map(CROSSING);
    assert!(!window.has("time of the mission") && !window.has_part("robot red at"));
    window.click("times of the routes");
    window.until("the robots", |window| window.has("robot red at 0.0 s"));
    window.key(Key::T);
    assert!(!window.has("time of the mission") && !window.has_part("robot red at"));
}

#[test]
fn the_slider_moves_the_robots_over_the_map() {
    let mut window = times(CROSSING);
    assert!((window.at("robot red at 0.0 s") - window.at("point P1")).length() < 1.0);
    window.click("time of the mission");
    let name = |window: &Window| {
        let robot = window.harness.get_by_label_contains("robot red at ");
        robot.accesskit_node().label().unwrap_or_default()
    };
    let before = name(&window);
    assert_ne!(before, "robot red at 0.0 s");
    for _ in 0..5 {
        window.key(Key::ArrowLeft);
    }
    let after = name(&window);
    assert_ne!(after, before, "the arrow keys move it");
    let x = |window: &mut Window, times: &str| {
        window.click(times);
        window.at(&after).x
    };
    let [early, nominal, late] =
        ["times: earliest", "times: nominal", "times: latest"].map(|times| x(&mut window, times));
    assert!(early > nominal + 1.0 && nominal > late + 1.0, "{early} {nominal} {late}");
}

#[test]
fn a_click_at_an_encounter_goes_to_its_time() {
    let mut window = times(CROSSING);
    let (start, end) = (window.at("point P1"), window.at("point P2"));
    window.click_part("red and blue, 0.00 m at 5.0 s (l1, b1)");
    let at = window.at("robot red at 5.0 s");
    assert!((at - (start + (end - start) * 0.5)).length() < 1.0, "{at}");
    window.click("times: earliest");
    window.click("mark of red and blue at 4.2 s");
    assert!(window.has("robot blue at 4.2 s"));
    assert!(window.has_part("red and blue at any speeds: "));
}

#[test]
fn a_click_in_the_diagram_goes_to_its_time() {
    let mut window = times(CROSSING);
    let at = window.at("distance of the robots over time");
    window.click_at(at);
    assert!(!window.has("robot red at 0.0 s") && window.has_part("robot red at "));
}

#[test]
fn appointments_have_their_times_and_chances() {
    let mut window = times(CROSSING);
    assert!(window.has_part("red.l1: 10.0 s") && window.has_part("blue.b1: 10.0 s"));
    assert!(window.has_part("by 1 min: 100.0 % (99.6 to 100.0)"));
    let half = window.harness.query_by_label_contains("by 10 s: ").expect("its chance");
    let text = half.accesskit_node().label().or(half.value()).unwrap_or_default();
    let share = text.trim_start().strip_prefix("by 10 s: ").and_then(|it| it.split(' ').next());
    let share: f64 = share.and_then(|share| share.parse().ok()).expect("a share");
    assert!((45.0..55.0).contains(&share), "{text}");
    window.click_part("red.l1: 10.0 s");
    assert!(window.has("robot red at 10.0 s"));
}

#[test]
fn the_times_follow_the_file() {
    let mut window = times(CROSSING);
    window.click("leg l1 of route red");
    window.fill("speed", "2m/s");
    window.until("the new times", |window| window.has_part("red.l1: 5.0 s"));
    window.keys(Modifiers::COMMAND, Key::Z);
    window.until("the old times", |window| window.has_part("red.l1: 10.0 s"));
    assert_eq!(window.text(), CROSSING);
}

#[test]
fn what_depends_on_a_date_needs_the_begin() {
    let text = CROSSING.replace("by=\"10s\"", "not-after=\"2026-11-21T14:30:00Z\"");
    let mut window = times(&text);
    assert!(window.has_part("not after 2026-11-21T14:30:00Z: not known"));
    window.fill("begin of the mission", "2026-11-21T14:29:00Z");
    let known = "not after 2026-11-21T14:30:00Z: 100.0 %";
    window.until("the chance", |window| window.has_part(known));
    window.fill("begin of the mission", "tomorrow");
    assert!(window.has_part("such as 2026-11-21T14:30:00Z"));
}

#[test]
fn what_is_not_known_is_named() {
    let mut window = map(&CROSSING.replace(" speed=\"1m/s\" by=\"10s\"", ""));
    window.key(Key::T);
    window.until("the warning", |window| window.has_part("Where red is from l1 on is not known."));
    assert!(window.has("robot blue at 0.0 s") && window.has("robot red at 0.0 s"));
    let mut empty = map("<armor version=\"1\">\n  <system name=\"bench\"/>\n</armor>\n");
    empty.key(Key::T);
    assert!(empty.has_part("No route is drawn"));
}
