//! Building, selecting, copying, finding: what one does all day.

use eframe::egui::{Event, Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::Window;

const ROBOT: &str = r#"<armor version="1">
  <!-- a bench -->
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target" keep="all"/>
    <layout>
      <block of="eye" x="0" y="0"/>
      <block of="arm" x="300" y="40"/>
    </layout>
  </system>
</armor>
"#;

#[test]
fn a_kind_is_dragged_from_the_palette_into_the_drawing() {
    let mut window = Window::open(None);
    let (from, to) = (window.at("kind lamp"), window.at("drawing of the system"));
    window.drag(from, to);
    assert!(window.text().contains(r#"<component name="lamp" kind="lamp"/>"#));
    assert!(window.has("component lamp"));
    let from = window.at("kind lamp");
    window.drag(from, to + vec2(150.0, 150.0));
    assert!(window.has("component lamp-2"));
}

#[test]
fn a_narrow_window_keeps_the_first_tools_and_all_views() {
    let window = Window::open_sized(vec2(690.0, 600.0), Some(ROBOT), |_, _| ());
    let tools = ["Run", "Stop", "Save", "Undo", "Redo"].map(|name| format!("tool: {name}"));
    let views = ["System", "Mission", "Map", "Live"].map(|name| format!("view: {name}"));
    for label in tools.iter().chain(&views) {
        let rect = window.harness.get_by_label(label).rect();
        assert!(rect.right() <= 690.0 && rect.width() > 15.0, "{label}: {rect:?}");
    }
}

#[test]
fn what_is_typed_narrows_the_palette_and_enter_adds_the_first() {
    let mut window = Window::open(None);
    window.click("Search components");
    window.write("ar");
    assert!(window.has("kind arm") && !window.has("kind eye"));
    window.key(Key::Enter);
    assert!(window.has("component arm"));
}

#[test]
fn something_is_added_by_keyboard_alone() {
    let mut window = Window::open(None);
    window.key(Key::A);
    window.write("lam");
    window.key(Key::Enter);
    assert!(window.has("component lamp"));
    window.key(Key::Delete);
    assert!(!window.has("component lamp"));
}

#[test]
fn a_drag_moves_a_block_and_is_one_line_of_the_file() {
    let mut window = Window::open(Some(ROBOT));
    let from = window.at("component arm");
    window.drag(from, from + vec2(40.0, 20.0));
    let moved =
        ROBOT.replace(r#"<block of="arm" x="300" y="40"/>"#, r#"<block of="arm" x="340" y="60"/>"#);
    assert_eq!(window.text(), moved);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), ROBOT);
    window.keys(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(window.text(), moved);
}

#[test]
fn a_rubber_band_selects_and_delete_removes_with_links() {
    let mut window = Window::open(Some(ROBOT));
    let (eye, arm) = (window.at("component eye"), window.at("component arm"));
    window.drag(eye - vec2(140.0, 120.0), arm + vec2(140.0, 140.0));
    assert!(window.has("2 selected"));
    window.key(Key::Delete);
    assert!(!window.text().contains("<component") && !window.text().contains("<link"));
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), ROBOT);
}

#[test]
fn a_copy_brings_parameters_and_inner_links_under_new_names() {
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.keys(Modifiers::COMMAND, Key::A);
    window.keys(Modifiers::COMMAND, Key::D);
    let text = window.text();
    assert!(text.contains(r#"<link from="eye-2.target" to="arm-2.target" keep="all"/>"#), "{text}");
    assert_eq!(text.matches(r#"value="usb""#).count(), 2);
    assert!(window.has("component arm-2"));
}

#[test]
fn what_is_copied_is_pasted_into_another_file() {
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.keys(Modifiers::COMMAND, Key::A);
    window.harness.event(Event::Copy);
    window.harness.step();
    let copied =
        window.harness.output().platform_output.commands.iter().find_map(|command| match command {
            eframe::egui::OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        });
    let mut other = Window::open(None);
    other.harness.event(Event::Paste(copied.expect("something was copied")));
    other.settle();
    let text = other.text();
    assert!(text.contains(r#"<link from="eye.target" to="arm.target" keep="all"/>"#), "{text}");
    other.harness.event(Event::Paste("no file at all".into()));
    other.settle();
    assert!(other.last_message().contains("the clipboard holds no part of a system"));
    assert_eq!(other.text(), text);
}

#[test]
fn a_problem_leads_to_its_place() {
    let mut window = Window::open(Some(&ROBOT.replace("kind=\"arm\"", "kind=\"leg\"")));
    window.click("there is no kind of component called leg");
    assert!(window.has("Another kind"), "the properties of the block are shown, with a remedy");
    window.click("Another kind");
    window.click("arm");
    assert_eq!(window.text(), ROBOT);
}

#[test]
fn a_port_that_vanished_is_marked_and_its_link_can_be_led_to_another() {
    let mut window = Window::open(Some(&ROBOT.replace("eye.target", "eye.aim")));
    window.click("component eye");
    assert!(window.has("output eye.aim"));
    window.click("instead of aim");
    window.click("target: Point");
    assert_eq!(window.text(), ROBOT);
}

#[test]
fn something_is_found_by_a_value() {
    let mut window = Window::open(Some(ROBOT));
    window.keys(Modifiers::COMMAND, Key::F);
    window.write("usb");
    window.key(Key::Enter);
    assert!(window.has("Component name"), "the eye is selected");
}

#[test]
fn a_group_and_a_note_are_drawn_and_kept_in_the_file() {
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.keys(Modifiers::COMMAND, Key::G);
    window.fill("Title", "Senses");
    assert!(window.text().contains(r#"<group title="Senses""#), "{}", window.text());
    assert!(window.has("group Senses"));
    window.key(Key::Escape);
    window.key(Key::N);
    assert!(window.text().contains("<note"), "{}", window.text());
}

#[test]
fn new_notes_are_at_the_pointer_and_not_on_each_other() {
    let mut window = Window::open(Some(ROBOT));
    let free = window.at("component eye") + vec2(0.0, 200.0);
    let mut add_at = |at| {
        window.harness.event(Event::PointerMoved(at));
        window.settle();
        window.key(Key::N);
        window.key(Key::Escape);
        window.key(Key::Escape);
        let text = window.text();
        let note = text.rsplit("<note ").next().unwrap().to_owned();
        let number = |attribute: &str| -> f32 {
            let value = note.split_once(attribute).unwrap().1.split_once('"').unwrap().0;
            value.parse().unwrap()
        };
        (number("x=\""), number("y=\""))
    };
    let (first, second) = (add_at(free), add_at(free));
    assert_ne!(first, second, "the second would cover the first");
    let right = add_at(free + vec2(150.0, 0.0));
    assert!(right.0 > first.0, "{right:?} is right of {first:?}");
}

#[test]
fn everything_is_arranged_in_one_step() {
    let mut window = Window::open(Some(ROBOT));
    window.keys(Modifiers::COMMAND, Key::L);
    assert_ne!(window.text(), ROBOT);
    let (eye, arm) = (window.at("component eye"), window.at("component arm"));
    assert!(eye.x < arm.x);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), ROBOT);
}

#[test]
fn a_file_with_any_letters_and_faults_is_shown() {
    let odd = ROBOT.replace("usb", "\u{4f60}\u{1f916} \u{5d0}").replace("bench", "b\u{e4}nk");
    let mut window = Window::open(Some(&odd));
    window.click("component eye");
    let window = Window::open(Some("<armor><system"));
    assert!(!window.has("component eye"));
}

#[test]
fn what_is_too_small_to_be_drawn_is_not_dragged() {
    let mut window = Window::open(Some(ROBOT));
    for _ in 0..6 {
        window.keys(Modifiers::COMMAND, Key::Minus);
    }
    let input = window.at("input arm.target");
    window.drag(input, input + vec2(0.0, 40.0));
    assert!(window.text().contains(r#"<link from="eye.target" to="arm.target" keep="all"/>"#));
}

#[test]
fn a_link_that_is_selected_is_led_from_another_output() {
    let mut window = Window::open(Some(&ROBOT.replace(
        r#"<component name="arm" kind="arm"/>"#,
        r#"<component name="arm" kind="arm"/><component name="eye-2" kind="eye"/>"#,
    )));
    window.click("link eye.target to arm.target");
    window.drag_between("start of link eye.target to arm.target", "output eye-2.target");
    let text = window.text();
    assert!(text.contains(r#"<link from="eye-2.target" to="arm.target" keep="all"/>"#), "{text}");
}

#[test]
fn a_list_at_the_pointer_is_left_with_escape() {
    for view in ["view: System", "view: Mission"] {
        let mut window = Window::open(Some(ROBOT));
        window.click(view);
        window.key(Key::A);
        assert!(window.has("Add a component") || window.has("Add to the mission"));
        window.key(Key::Escape);
        assert!(!window.has("Add a component") && !window.has("Add to the mission"));
    }
}

#[test]
fn what_is_added_by_keyboard_lies_on_nothing() {
    let mut window = Window::open(None);
    for _ in 0..3 {
        window.key(Key::A);
        window.write("lam");
        window.key(Key::Enter);
    }
    let blocks = ["component lamp", "component lamp-2", "component lamp-3"];
    let areas = blocks.map(|name| window.harness.get_by_label(name).rect());
    for (n, area) in areas.iter().enumerate() {
        assert!(areas[..n].iter().all(|other| !other.intersects(*area)), "{areas:?}");
    }
}

#[test]
fn the_drawing_has_the_keyboard_where_nothing_else_has() {
    let mut window = Window::open(Some(ROBOT));
    window.key(Key::ArrowRight);
    assert!(window.has("Component name"), "a block is selected without a click");
    window.keys(Modifiers::COMMAND, Key::F);
    window.key(Key::Escape);
    window.key(Key::Escape);
    assert!(!window.has("Component name"));
    window.key(Key::ArrowRight);
    assert!(window.has("Component name"));
}

#[test]
fn redo_has_two_keys() {
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.key(Key::Delete);
    let removed = window.text();
    window.keys(Modifiers::COMMAND, Key::Z);
    window.keys(Modifiers::COMMAND, Key::Y);
    assert_eq!(window.text(), removed);
}

#[test]
fn actual_size_of_an_empty_drawing_shows_where_the_first_item_goes() {
    let empty = "<armor version=\"1\">\n  <system>\n  </system>\n</armor>\n";
    let mut window = Window::open(Some(empty));
    let before = window.at("drawing of the system");
    window.harness.event(Event::PointerMoved(before));
    for _ in 0..3 {
        window.keys(Modifiers::COMMAND, Key::Minus);
    }
    window.keys(Modifiers::COMMAND, Key::Num0);
    assert_eq!(window.last_message(), "");
    window.key(Key::A);
    window.write("arm");
    window.key(Key::Enter);
    let block = window.harness.get_by_label("component arm").rect();
    assert!(window.harness.get_by_label("drawing of the system").rect().contains_rect(block));
    assert!(block.width() >= 140.0, "{block}: it is shown at actual size");
}
