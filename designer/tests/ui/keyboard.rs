//! The keyboard alone: menus, dialogs and fields, and a name for everything that can have the focus.

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable, by};

use crate::ui::Window;

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
  <mission name="bench" goal="home">
    <place name="explore" initial="true" components="arm"/>
    <place name="home"/>
    <transition name="late" from="explore" to="home" timeout="90s"/>
  </mission>
</armor>
"#;

/// Presses and releases Alt, as a window reports it: the key, and the modifiers.
fn press_alt(window: &mut Window) {
    for (modifiers, pressed) in [(Modifiers::ALT, true), (Modifiers::NONE, false)] {
        window.harness.event(Event::Key {
            key: Key::AltLeft,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers,
        });
        window.harness.event(Event::ModifiersChanged(modifiers));
        window.harness.step();
    }
    window.settle();
}

/// Whether a menu with this entry is open. Its keys belong to the name of an entry.
fn offers(window: &Window, entry: &str) -> bool {
    window.harness.query_all_by_label_contains(entry).next().is_some()
}

#[test]
fn alt_opens_the_first_menu_and_arrows_lead_through_all() {
    let mut window = Window::open(Some(ROBOT));
    press_alt(&mut window);
    assert!(offers(&window, "Save as…"), "File is open");
    window.key(Key::ArrowRight);
    assert!(!offers(&window, "Save as…") && offers(&window, "Rename"), "Edit is open");
    window.key(Key::ArrowLeft);
    window.key(Key::ArrowDown);
    window.key(Key::Enter);
    assert!(!offers(&window, "Save as…"), "New was chosen");
    assert!(window.text().contains(r#"<system name="robot">"#), "{}", window.text());
}

#[test]
fn alt_with_a_letter_opens_its_menu_and_escape_closes_it() {
    let mut window = Window::open(Some(ROBOT));
    for (key, entry) in [
        (Key::F, "Save as…"),
        (Key::E, "Rename"),
        (Key::V, "Snap to grid"),
        (Key::H, "Welcome page"),
    ] {
        window.keys(Modifiers::ALT, key);
        assert!(offers(&window, entry), "{entry} is offered");
        window.key(Key::Escape);
        assert!(!offers(&window, entry), "{entry} is gone");
    }
    // With another key, Alt does not open a menu.
    window.click("component eye");
    window.keys(Modifiers::ALT, Key::ArrowLeft);
    assert!(!offers(&window, "Save as…"));
}

#[test]
fn escape_closes_each_dialog() {
    let mut window = Window::open(Some(ROBOT));
    let save_as = Modifiers::COMMAND | Modifiers::SHIFT;
    for (modifiers, key, shown) in [
        (Modifiers::COMMAND, Key::O, "Open a robot or a mission"),
        (save_as, Key::S, "Save as"),
        (Modifiers::COMMAND, Key::E, "Export drawing"),
        (Modifiers::NONE, Key::F1, "Keys and mouse"),
        (Modifiers::COMMAND, Key::F, "Find by name, port, parameter or value"),
    ] {
        window.keys(modifiers, key);
        assert!(window.harness.query_all_by_label_contains(shown).next().is_some(), "{shown}");
        // A field may have the focus, which takes the first Escape.
        window.key(Key::Escape);
        if shown != "Find by name, port, parameter or value" {
            window.key(Key::Escape);
        }
        let is_it = |label: &str| label == shown;
        let dialog = window.harness.query_all_by(|node| {
            node.role() == Role::Label && node.value().as_deref().is_some_and(is_it)
        });
        let dialog = dialog.into_iter().next();
        assert!(dialog.is_none(), "{shown}");
    }
    window.click("component eye");
    window.key(Key::Delete);
    window.keys(Modifiers::COMMAND, Key::N);
    assert!(window.has("Unsaved changes"));
    window.key(Key::Escape);
    assert!(!window.has("Unsaved changes"));
}

#[test]
fn everything_that_can_have_the_focus_has_a_name() {
    let mut window = Window::open(Some(ROBOT));
    let mut seen = 0;
    for (view, selected) in [
        ("view: System", "component eye"),
        ("view: System", "link eye.target to arm.target"),
        ("view: Mission", "place explore"),
        ("view: Mission", "transition late"),
    ] {
        window.click(view);
        window.click(selected);
        let nodes = window.harness.query_all(by().predicate(|node| {
            matches!(
                node.role(),
                Role::Button
                    | Role::TextInput
                    | Role::MultilineTextInput
                    | Role::CheckBox
                    | Role::ComboBox
                    | Role::Slider
                    | Role::SpinButton
            )
        }));
        for node in nodes {
            seen += 1;
            let node = node.accesskit_node();
            let is_named = node.label().is_some_and(|label| !label.trim().is_empty())
                || node.labelled_by().next().is_some();
            assert!(is_named, "{view}, {selected}: {:?} at {:?}", node.role(), node.bounding_box());
        }
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn the_version_is_shown_and_closed_with_escape() {
    let mut window = Window::open(Some(ROBOT));
    window.keys(Modifiers::COMMAND, Key::P);
    window.write("About");
    window.key(Key::Enter);
    assert!(window.has(concat!("Version ", env!("CARGO_PKG_VERSION"))));
    window.key(Key::Escape);
    assert!(!window.has(concat!("Version ", env!("CARGO_PKG_VERSION"))));
}

#[test]
fn a_thing_is_found_once() {
    let mut window = Window::open(Some(ROBOT));
    window.keys(Modifiers::COMMAND, Key::F);
    window.write("usb");
    assert_eq!(window.harness.query_all_by_label("component eye").count(), 2, "block and line");
}

#[test]
fn the_tab_key_reaches_the_buttons_and_enter_presses_them() {
    let mut window = Window::open(Some(ROBOT));
    let mut names = std::collections::BTreeSet::new();
    for _ in 0..60 {
        window.harness.event(Event::Key {
            key: Key::Tab,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        });
        window.harness.run_steps(2);
        let focused = window.harness.query_by(|node| node.is_focused());
        names.extend(focused.and_then(|node| node.accesskit_node().label()));
    }
    for name in ["File", "Help", "tool: Save", "view: Live", "Open the palette"] {
        assert!(names.contains(name), "{name}: {names:?}");
    }
}
