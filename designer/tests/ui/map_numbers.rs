//! What is drawn is changed by numbers, swept by patterns, copied, and shown with drawings of other files.

use eframe::egui::{Event, Key, Modifiers};

use crate::ui::Window;
use crate::ui::map::map;

/// A yard of 10 m by 6 m, a line, and a route with two legs.
const DRAWN: &str = r#"<armor version="1">
  <system name="bench">
    <component name="way" kind="way"/>
  </system>
  <mission goal="over" safe="hold">
    <map>
      <point name="P1" at="0 0"/>
      <point name="P2" at="10 0"/>
      <point name="P3" at="10 8"/>
      <zone name="yard" kind="observe" shape="20,0 30,0 30,6 20,6"/>
      <line name="green" kind="phase" shape="0,20 10,20"/>
    </map>
    <route name="red" mover="way.route" start="P1" out="over">
      <leg name="l1" to="P2" by="1min"/>
      <leg name="l2" to="P3" by="1min"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
  </mission>
</armor>
"#;

fn changed(before: &str, after: &str) -> Vec<String> {
    let new = after.lines().filter(|line| !before.lines().any(|old| old == *line));
    new.map(|line| line.trim().to_owned()).collect()
}

#[track_caller]
fn check(window: &mut Window, field: &str, text: &str, expected: &[&str]) {
    window.fill(field, text);
    assert_eq!(changed(DRAWN, &window.text()), expected, "{}", window.last_message());
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN);
}

#[test]
fn what_is_selected_is_moved_turned_mirrored_and_offset_by_numbers() {
    let mut window = map(DRAWN);
    window.click("zone yard");
    let yard = |shape: &str| format!(r#"<zone name="yard" kind="observe" shape="{shape}"/>"#);
    let moved = yard("21.5,-2 31.5,-2 31.5,4 21.5,4");
    check(&mut window, "move by the selection", "1.5 -2", &[&moved]);
    // Around its middle, 25 3.
    let turned = yard("28,-2 28,8 22,8 22,-2");
    check(&mut window, "rotate by the selection", "90deg", &[&turned]);
    let mirrored = yard("30,0 20,0 20,6 30,6");
    check(&mut window, "mirror across the selection", "y", &[&mirrored]);
    let larger = yard("19,-1 31,-1 31,7 19,7");
    check(&mut window, "offset by the selection", "-1m", &[&larger]);
    for (field, text, why) in [
        ("move by the selection", "one", "two lengths"),
        ("rotate by the selection", "90m", "angle"),
        ("offset by the selection", "9m", "too short"),
    ] {
        window.fill(field, text);
        assert!(window.last_message().contains(why), "{}", window.last_message());
        assert_eq!(window.text(), DRAWN);
    }
}

#[test]
fn legs_take_their_points_along() {
    let mut window = map(DRAWN);
    window.click("leg l1 of route red");
    let moved = [r#"<point name="P2" at="10 3"/>"#];
    check(&mut window, "move by the selection", "0 3", &moved);
}

#[test]
fn a_zone_is_surveyed_in_lanes_each_leg_a_line_of_the_file() {
    let mut window = map(DRAWN);
    window.click("zone yard");
    window.fill("distance of lanes of the pattern", "3m");
    window.fill("distance from the boundary of the pattern", "0m");
    window.click("Survey the zone");
    // From the corner that is nearest to the end of the route.
    let expected = [
        r#"<point name="P4" at="20 4.5"/>"#,
        r#"<point name="P5" at="30 4.5"/>"#,
        r#"<point name="P6" at="30 1.5"/>"#,
        r#"<point name="P7" at="20 1.5"/>"#,
        r#"<leg name="l3" to="P4"/>"#,
        r#"<leg name="l4" to="P5"/>"#,
        r#"<leg name="l5" to="P6"/>"#,
        r#"<leg name="l6" to="P7"/>"#,
    ];
    let found = changed(DRAWN, &window.text());
    assert_eq!(found.len(), expected.len(), "{found:?} {}", window.last_message());
    assert!(expected.iter().all(|line| found.iter().any(|it| it == line)), "{found:?}");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN, "it is one step");
    window.click("zone yard");
    window.fill("distance of lanes of the pattern", "0m");
    window.click("Survey the zone");
    assert!(window.last_message().contains("at least 0.01 m"), "{}", window.last_message());
}

#[test]
fn a_corridor_follows_a_line() {
    let mut window = map(DRAWN);
    window.click("line green");
    window.fill("distance of lanes of the pattern", "2m");
    window.fill("width of the pattern", "4m");
    window.click("Follow the line");
    let found = changed(DRAWN, &window.text());
    for line in [
        r#"<point name="P4" at="0 19"/>"#,
        r#"<point name="P5" at="10 19"/>"#,
        r#"<point name="P6" at="10 21"/>"#,
        r#"<point name="P7" at="0 21"/>"#,
        r#"<leg name="l6" to="P7"/>"#,
    ] {
        assert!(found.iter().any(|it| it == line), "{line} is not in {found:?}");
    }
    assert_eq!(found.len(), 8, "{found:?}");
}

#[test]
fn what_is_copied_is_pasted_under_names_of_its_own() {
    let mut window = map(DRAWN);
    window.click("zone yard");
    window.keys(Modifiers::COMMAND, Key::D);
    let expected = [r#"<zone name="yard1" kind="observe" shape="20,0 30,0 30,6 20,6"/>"#];
    assert_eq!(changed(DRAWN, &window.text()), expected);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN);
    window.harness.event(Event::Paste("scrap".into()));
    window.settle();
    assert!(window.last_message().contains("no part of a map"), "{}", window.last_message());
    assert_eq!(window.text(), DRAWN);
}

#[test]
fn the_drawing_of_another_file_is_shown_and_not_edited() {
    let mut window = map(DRAWN);
    let other = DRAWN.replace("red", "blue").replace(r#"at="10 8""#, r#"at="-5 8""#);
    std::fs::write(window.path("other.xml"), other).expect("written");
    window.fill("file of another drawing", "other.xml");
    window.until("the other drawing", |window| window.has("other.xml: leg l2 of route blue"));
    // A click at its point selects nothing of it.
    window.click("other.xml: point P3");
    assert!(!window.has("name of the point"));
    assert_eq!(window.text(), DRAWN);
    window.click("other drawing: other.xml");
    window.until("it is hidden", |window| !window.has("other.xml: leg l2 of route blue"));
    window.fill("file of another drawing", "robot.xml");
    assert!(window.last_message().contains("is the open file"), "{}", window.last_message());
    window.fill("file of another drawing", "none.xml");
    assert!(window.last_message().contains("there is no file"), "{}", window.last_message());
    // One that has an origin, where this file has none.
    let placed = DRAWN.replace("<map>", "<map origin=\"48.8583 2.2945 35m\">");
    std::fs::write(window.path("placed.xml"), placed).expect("written");
    window.fill("file of another drawing", "placed.xml");
    window.until("the reason", |window| window.has_part("give this one an origin"));
}

#[test]
fn the_exits_of_a_route_and_its_limits_are_fields() {
    let mut window = map(DRAWN);
    window.click("leg l1 of route red");
    window.click("route red");
    window.click("Add exits");
    let added = "<otherwise on=\"lost-link blocked late\" do=\"hold\"/>";
    assert_eq!(changed(DRAWN, &window.text()), [added]);
    window.fill("causes of exit 1", "late recall");
    window.choose("action of exit 1", "home");
    assert_eq!(
        changed(DRAWN, &window.text()),
        ["<otherwise on=\"late recall\" do=\"home\"/>"],
        "{}",
        window.last_message()
    );
    let exits = window.text();
    for (field, text, expected) in [
        ("tolerance", "10%", "tolerance=\"10%\""),
        ("battery lasts", "40min", "endurance=\"40min\""),
        ("fence", "way", "fence=\"way\""),
    ] {
        window.fill(field, text);
        let lines = changed(&exits, &window.text());
        assert!(lines.len() == 1 && lines[0].contains(expected), "{lines:?}");
        window.keys(Modifiers::COMMAND, Key::Z);
    }
}
