//! A group is folded into one block, whose ports are the links that cross its border.

use eframe::egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="relay" kind="relay"/>
    <component name="arm" kind="arm"/>
    <component name="spare" kind="arm"/>
    <link from="eye.target" to="relay.writers"/>
    <link from="relay.element" to="arm.target"/>
    <link from="eye.image" to="arm.view"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="relay" x="220" y="0"/>
      <block of="arm" x="600" y="0"/>
      <block of="spare" x="600" y="300"/>
      <group title="Senses" x="-30" y="-50" width="500" height="300"/>
      <note x="10" y="180" width="100" height="50">Wash</note>
    </layout>
  </system>
</armor>
"#;

const FOLD: (Modifiers, Key) = (Modifiers { shift: true, ..Modifiers::COMMAND }, Key::G);

/// A window with the group folded.
fn folded() -> Window {
    let mut window = Window::open(Some(ROBOT));
    select_group(&mut window);
    window.keys(FOLD.0, FOLD.1);
    window
}

/// Clicks the title of the group that is not folded.
fn select_group(window: &mut Window) {
    let title = window.harness.get_by_label("group Senses").rect().left_top();
    window.click_at(title + vec2(30.0, 6.0));
}

#[test]
fn its_ports_are_the_links_that_cross_its_border() {
    let window = folded();
    assert!(window.has("group Senses, folded"), "its name has its state");
    for label in ["output relay.element", "output eye.image", "link relay.element to arm.target"] {
        assert!(window.has(label), "{label}");
    }
    for label in ["component eye", "component relay", "output eye.target", "input relay.writers"] {
        assert!(!window.has(label), "{label} is hidden");
    }
    assert!(!window.has("link eye.target to relay.writers") && !window.has("note Wash"));
    let block = window.harness.get_by_label("group Senses, folded").rect();
    let output = window.at("output eye.image");
    assert!((output.x - block.right()).abs() < 8.0, "outputs are at the right");
    let shown = window.harness.query_all_by_label("In it: eye, relay").count();
    assert_eq!(shown, 1, "the properties list what is in it");
}

#[test]
fn it_is_kept_in_the_file_and_undone_in_one_step() {
    let mut window = folded();
    let text = window.text();
    assert!(text.contains(r#"height="300" folded="true">"#), "{text}");
    let mut again = Window::open(Some(&text));
    assert!(again.has("group Senses, folded"));
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), ROBOT);
    assert!(window.has("component eye"));
    again.click("group Senses, folded");
    again.keys(FOLD.0, FOLD.1);
    assert!(again.has("component eye"), "{}", again.last_message());
    assert!(again.has("note Wash"));
    assert!(again.has("group Senses"), "it is still selected, and there");
    again.keys(FOLD.0, FOLD.1);
    assert_eq!(again.text().matches("folded").count(), 1);
}

#[test]
fn dragging_it_moves_all_that_is_in_it() {
    let mut window = folded();
    let block = window.harness.get_by_label("group Senses, folded").rect();
    let from = block.center_bottom() - vec2(0.0, 4.0);
    let zoom = (window.at("component spare").y - window.at("component arm").y) / 300.0;
    window.drag(from, from + vec2(0.0, 200.0) * zoom);
    let text = window.text();
    for expected in [
        r#"<block of="eye" x="0" y="200"/>"#,
        r#"<block of="relay" x="220" y="200"/>"#,
        r#"<block of="arm" x="600" y="0"/>"#,
        r#"<note x="10" y="380""#,
    ] {
        assert!(text.contains(expected), "{expected} is not in {text}");
    }
    window.keys(Modifiers::COMMAND, Key::Z);
    assert!(window.text().contains(r#"<block of="eye" x="0" y="0"/>"#));
}

#[test]
fn links_are_drawn_from_and_to_its_ports() {
    let mut window = folded();
    window.drag_between("output eye.image", "input spare.view");
    let link = r#"<link from="eye.image" to="spare.view"/>"#;
    assert!(window.text().contains(link), "{}", window.last_message());
    assert!(window.has("link eye.image to spare.view"));
    let before = window.text();
    window.drag_between("output relay.element", "input spare.view");
    assert_eq!(window.text(), before);
    let message = window.last_message();
    assert!(message.contains("spare.view"), "the reason is that of the component: {message}");
}

#[test]
fn what_is_dropped_where_it_was_is_not_hidden() {
    let mut window = folded();
    let (spare, group) = (window.at("component spare"), window.at("group Senses, folded"));
    // Within the frame that the group has when it is unfolded.
    window.drag(spare, group + vec2(160.0, 100.0));
    assert!(window.has("component spare"));
}

#[test]
fn it_is_removed_and_copied_with_what_is_in_it() {
    let mut window = folded();
    window.keys(Modifiers::COMMAND, Key::D);
    let text = window.text();
    for copy in [r#"name="eye-2""#, r#"name="relay-2""#, r#"to="relay-2.writers""#] {
        assert!(text.contains(copy), "{copy} is not in {text}");
    }
    window.keys(Modifiers::COMMAND, Key::Z);
    window.click("group Senses, folded");
    window.key(Key::Delete);
    let text = window.text();
    assert!(!text.contains("eye") && !text.contains("Senses") && text.contains("spare"), "{text}");
}

#[test]
fn what_is_hidden_is_found_as_its_group() {
    let mut window = folded();
    window.key(Key::Escape);
    window.keys(Modifiers::COMMAND, Key::F);
    window.write("relay");
    window.key(Key::Enter);
    assert!(window.has("In it: eye, relay"), "the group is selected");
}

#[test]
fn a_group_without_components_stays_as_it_is() {
    let text = ROBOT.replace(r#"x="-30" y="-50" width="500""#, r#"x="-300" y="-50" width="200""#);
    let mut window = Window::open(Some(&text));
    select_group(&mut window);
    window.keys(FOLD.0, FOLD.1);
    assert_eq!(window.text(), text);
    assert_eq!(window.last_message(), "Not folded: there is no component in the group.");
}
