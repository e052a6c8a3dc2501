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
