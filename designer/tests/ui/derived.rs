//! Places and transitions that a route stands for: shown, moved, and refused with the line to edit.

use eframe::egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;

const DRAWN: &str = r#"<armor version="1">
  <system name="bench">
    <component name="arm" kind="arm"/>
  </system>
  <mission goal="over" safe="hold">
    <map>
      <point name="P0" at="0 0"/>
      <point name="P1" at="6 0"/>
    </map>
    <route name="red" mover="arm.gain" start="P0" out="over">
      <leg name="l1" to="P1" by="1min"/>
      <otherwise on="recall" do="hold"/>
    </route>
    <place name="over"/>
    <place name="hold"/>
  </mission>
</armor>
"#;
const LINE: &str = "derived from leg l1 of route red, line 11 of robot.xml";

fn mission() -> Window {
    let mut window = Window::open(Some(DRAWN));
    window.click("view: Mission");
    window
}

#[track_caller]
fn expect_refused(window: &mut Window) {
    let message = window.last_message();
    assert!(message.contains(LINE), "{message}");
    assert_eq!(window.text(), DRAWN);
}

#[test]
fn what_is_derived_from_a_route_is_not_edited_and_names_its_line() {
    for label in ["place red.l1", "transition red.l1.late", "arc: red.l1.late puts into hold"] {
        for (modifiers, key) in [(Modifiers::NONE, Key::Delete), (Modifiers::NONE, Key::F2)] {
            let mut window = mission();
            window.click(label);
            let hint = "Derived from leg l1 of route red, line 11 of robot.xml.";
            assert!(window.harness.query_by_label_contains(hint).is_some(), "{label}");
            assert!(!window.has("name of the place") && !window.has("name of the transition"));
            window.keys(modifiers, key);
            if key == Key::Delete || !label.starts_with("arc") {
                expect_refused(&mut window);
            }
        }
    }
    let mut window = mission();
    window.drag_between("arc from transition red.l1.late", "place over");
    expect_refused(&mut window);
    window.click("place red.l1");
    window.keys(Modifiers::COMMAND, Key::D);
    expect_refused(&mut window);
}

#[test]
fn what_is_derived_from_a_route_is_moved_like_all_others() {
    let mut window = mission();
    for label in ["place red.l1", "place over"] {
        let at = window.at(label);
        window.drag(at, at + vec2(-20.0, 40.0));
    }
    let text = window.text();
    for block in ["of=\"red.l1\"", "transition=\"red.l1.late\"", "of=\"over\""] {
        assert_eq!(text.matches(&format!("<block {block}")).count(), 1, "{block}: {text}");
    }
    window.keys(Modifiers::COMMAND, Key::Z);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DRAWN);
}

/// Seven legs: too many places and transitions to be drawn one by one at first.
fn long() -> String {
    let legs: String = (1..=7)
        .map(|n| format!("      <leg name=\"l{n}\" to=\"P{}\" by=\"1min\"/>\n", n % 2))
        .collect();
    DRAWN.replace("      <leg name=\"l1\" to=\"P1\" by=\"1min\"/>\n", &legs)
}

fn long_mission() -> Window {
    let mut window = Window::open(Some(&long()));
    window.click("view: Mission");
    window
}

#[test]
fn the_steps_of_a_long_route_are_blocks_that_open_and_fold() {
    let mut window = long_mission();
    let (folded, frame) = ("step l3 of route red, folded", "group red.l3: leg to P1");
    assert!(window.has(folded) && window.has("place over") && !window.has("place red.l3"));
    assert!(window.has("3 arcs from red.l3 to hold"), "late, blocked and recall are one line");
    window.double_click(folded);
    for label in ["place red.l3", "transition red.l3.recall", frame] {
        assert!(window.has(label), "{label}");
    }
    assert!(!window.has(folded) && window.has("step l4 of route red, folded"));
    window.keys(Modifiers::COMMAND | Modifiers::SHIFT, Key::G);
    assert!(window.has(folded) && !window.has(frame), "it is still selected");
    assert!(window.has("Leg red.l3"), "the properties show it");
    window.click("Open");
    assert!(window.has(frame));
    window.click("Fold");
    window.click("Show on the map");
    assert!(window.has("leg l3 of route red"), "the view Map is shown");
    assert_eq!(window.text(), long());
}

#[test]
fn what_is_in_a_folded_step_is_found_and_opens_it() {
    let mut window = long_mission();
    window.keys(Modifiers::COMMAND, Key::F);
    window.write("red.l5.late");
    window.key(Key::Enter);
    assert!(window.has("transition red.l5.late"));
    assert!(window.has("Transition red.l5.late"), "it is selected");
}

#[test]
fn a_folded_step_is_moved_as_a_whole_and_not_removed() {
    let mut window = long_mission();
    let label = "step l2 of route red, folded";
    window.click(label);
    window.key(Key::Delete);
    let message = window.last_message();
    assert!(message.starts_with("leg l2 of route red, line 12 of robot.xml"), "{message}");
    assert!(message.contains("view Map (Ctrl+3)"), "{message}");
    assert_eq!(window.text(), long());
    let at = window.at(label);
    window.drag(at, at + vec2(0.0, 60.0));
    let text = window.text();
    assert_eq!(text.matches("<block of=\"red.l2\"").count(), 1, "{text}");
    assert!(!text.contains("<block transition=\"red"), "what it hides has no position: {text}");
    assert!(!text.contains("of=\"red.l2."), "{text}");
    // Opened, its places and transitions are around the first one.
    let before = window.at(label);
    window.double_click(label);
    let frame = window.harness.get_by_label("group red.l2: leg to P0").rect();
    assert!(frame.expand(40.0).contains(before), "{before:?} {frame:?}");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), long());
}

#[test]
fn a_folded_step_shows_the_tokens_in_it() {
    let mut window = long_mission();
    window.key(Key::F5);
    assert!(window.has("step l1 of route red, folded, marked"));
    window.click("Fire red.l1.done");
    window.until("the token", |window| window.has("step l2 of route red, folded, marked"));
    assert!(window.has("step l1 of route red, folded"));
}
