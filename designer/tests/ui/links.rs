//! ArMoR 4.1, rule by rule: what can be linked, and the reason where it cannot.

use eframe::egui::{Key, Modifiers, Rect, Shape, vec2};

use crate::ui::Window;

const TWO_EACH: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="eye-2" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <component name="arm-2" kind="arm"/>
    <component name="lamp" kind="lamp"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="eye-2" x="0" y="200"/>
      <block of="arm" x="300" y="0"/>
      <block of="arm-2" x="300" y="200"/>
      <block of="lamp" x="300" y="400"/>
    </layout>
  </system>
</armor>
"#;

#[test]
fn an_output_is_linked_to_an_input_of_its_type_from_either_end() {
    let mut window = Window::open(Some(TWO_EACH));
    window.drag_between("output eye.target", "input arm.target");
    assert!(window.text().contains(r#"<link from="eye.target" to="arm.target"/>"#));
    window.drag_between("input arm-2.view", "output eye-2.image");
    assert!(window.text().contains(r#"<link from="eye-2.image" to="arm-2.view"/>"#));
    assert!(window.has("link eye.target to arm.target"));
}

#[test]
fn two_outputs_cannot_be_linked() {
    let mut window = Window::open(Some(TWO_EACH));
    window.drag_between("output eye.target", "output eye-2.target");
    assert_eq!(window.text(), TWO_EACH);
    assert!(
        window.last_message().contains("two outputs cannot be linked"),
        "{}",
        window.last_message()
    );
}

#[test]
fn two_inputs_cannot_be_linked() {
    let mut window = Window::open(Some(TWO_EACH));
    window.drag_between("input arm.target", "input arm-2.target");
    assert_eq!(window.text(), TWO_EACH);
    assert!(
        window.last_message().contains("two inputs cannot be linked"),
        "{}",
        window.last_message()
    );
}

#[test]
fn ports_of_different_types_cannot_be_linked_and_both_types_are_named() {
    let mut window = Window::open(Some(TWO_EACH));
    window.drag_between("output eye-2.image", "input arm-2.target");
    assert_eq!(window.text(), TWO_EACH);
    let message = window.last_message();
    assert!(message.contains("eye-2.image is Image, arm-2.target takes Point"), "{message}");
    window.drag_between("output eye.target", "input lamp.place");
    assert!(window.last_message().contains("two versions of Point"), "{}", window.last_message());
    assert_eq!(window.text(), TWO_EACH);
}

#[test]
fn an_input_that_is_fed_takes_no_second_link() {
    let mut window = Window::open(Some(TWO_EACH));
    window.drag_between("output eye.target", "input arm.target");
    let before = window.text();
    window.drag_between("output eye-2.target", "input arm.target");
    assert_eq!(window.text(), before);
    assert!(
        window.last_message().contains("arm.target is already fed by eye.target"),
        "{}",
        window.last_message()
    );
}

#[test]
fn an_input_that_takes_many_has_a_wire_from_each_output_once() {
    let wall = r#"    <component name="wall" kind="wall"/>
    <layout>
      <block of="wall" x="300" y="500"/>"#;
    let mut window = Window::open(Some(&TWO_EACH.replace("    <layout>", wall)));
    window.drag_between("input wall.images", "output eye.image");
    window.drag_between("output eye-2.image", "input wall.images");
    for eye in ["eye", "eye-2"] {
        let link = format!(r#"<link from="{eye}.image" to="wall.images"/>"#);
        assert!(window.text().contains(&link), "{}: {}", window.last_message(), window.text());
        assert!(window.has(&format!("link {eye}.image to wall.images")));
    }
    let before = window.text();
    window.drag_between("output eye.image", "input wall.images");
    assert_eq!(window.text(), before);
    let message = window.last_message();
    assert!(message.contains("eye.image already feeds wall.images"), "{message}");
}

#[test]
fn ports_of_any_type_have_that_of_the_first_link() {
    let relay = r#"    <component name="relay" kind="relay"/>
    <layout>
      <block of="relay" x="600" y="0"/>"#;
    let mut window = Window::open(Some(&TWO_EACH.replace("    <layout>", relay)));
    window.drag_between("output eye.target", "input relay.writers");
    assert!(window.text().contains(r#"<link from="eye.target" to="relay.writers"/>"#));
    let before = window.text();
    window.drag_between("output eye-2.image", "input relay.writers");
    let message = window.last_message();
    assert!(message.contains("eye-2.image is Image, relay.writers takes Point"), "{message}");
    window.drag_between("output relay.element", "input arm.view");
    let message = window.last_message();
    assert!(message.contains("relay.element is Point, arm.view takes Image"), "{message}");
    assert_eq!(window.text(), before);
    window.drag_between("output relay.element", "input arm.target");
    window.drag_between("output eye-2.target", "input relay.writers");
    for link in [("relay.element", "arm.target"), ("eye-2.target", "relay.writers")] {
        let link = format!(r#"<link from="{}" to="{}"/>"#, link.0, link.1);
        assert!(window.text().contains(&link), "{}", window.last_message());
    }
}

#[test]
fn a_link_is_taken_by_its_end_and_led_elsewhere_or_let_go() {
    let mut window = Window::open(Some(TWO_EACH));
    window.drag_between("output eye.target", "input arm.target");
    window.drag_between("input arm.target", "input arm-2.target");
    assert!(window.text().contains(r#"<link from="eye.target" to="arm-2.target"/>"#));
    assert!(!window.text().contains(r#"to="arm.target""#));
    let end = window.at("input arm-2.target");
    window.drag(end, end + vec2(0.0, 330.0));
    assert!(!window.text().contains("<link"), "{}", window.text());
    for _ in 0..3 {
        window.keys(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(window.text(), TWO_EACH);
}

#[test]
fn a_wire_dropped_on_nothing_offers_what_fits() {
    let mut window = Window::open(Some(TWO_EACH));
    let from = window.at("output eye.target");
    window.drag(from, from + vec2(60.0, 160.0));
    assert!(window.has("eye.target > arm.target") && window.has("add arm, target"));
    assert!(!window.has("add lamp, place"), "another version of the type does not fit");
    window.click("add arm, target");
    assert!(window.text().contains(r#"<link from="eye.target" to="arm-3.target"/>"#));
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), TWO_EACH, "the component and its link are one step");
}

#[test]
fn two_ports_are_linked_by_keyboard_alone() {
    let mut window = Window::open(Some(TWO_EACH));
    window.click("component eye");
    window.key(Key::L);
    window.write("arm-2 target");
    window.key(Key::Enter);
    assert!(window.text().contains(r#"<link from="eye.target" to="arm-2.target"/>"#));
}

#[test]
fn a_drag_is_called_off_with_escape() {
    let mut window = Window::open(Some(TWO_EACH));
    let (from, to) = (window.at("output eye.target"), window.at("input arm.target"));
    window.drag_and_hold(from, to);
    window.key(Key::Escape);
    window.drag(to + vec2(0.0, 500.0), to + vec2(0.0, 501.0));
    assert_eq!(window.text(), TWO_EACH);
}

/// Two links next to each other have texts that do not cover each other.
#[test]
fn texts_of_links_never_overlap() {
    let text = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye"/>
    <component name="arm" kind="arm"/>
    <component name="hand" kind="arm"/>
    <link from="eye.target" to="arm.target" keep="50"/>
    <link from="eye.target" to="hand.target" keep="60"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="arm" x="400" y="0"/>
      <block of="hand" x="400" y="6"/>
    </layout>
  </system>
</armor>
"#;
    let window = Window::open(Some(text));
    let mut found = Vec::new();
    for clipped in &window.harness.output().shapes {
        collect_texts(&clipped.shape, &mut found);
    }
    let of = |text: &str| found.iter().find(|(it, _)| it == text).map(|(_, rect)| *rect);
    let (Some(one), Some(other)) = (of("keep 50"), of("keep 60")) else { panic!("{found:?}") };
    assert!(!one.intersects(other), "{one:?} {other:?}");
}

fn collect_texts(shape: &Shape, texts: &mut Vec<(String, Rect)>) {
    match shape {
        Shape::Text(text) => {
            texts.push((text.galley.text().to_owned(), shape.visual_bounding_rect()));
        }
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect_texts(shape, texts)),
        _ => {}
    }
}
