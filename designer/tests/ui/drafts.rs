//! A file with errors is saved as a draft, which is checked and not run.

use eframe::egui::{Key, Modifiers};

use crate::ui::{Window, read};

/// The eye needs a value for its device.
const OPEN: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye"/>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
</armor>
"#;

fn press(window: &mut Window, modifiers: Modifiers, begin: &str) {
    window.harness.key_press_modifiers(modifiers, Key::S);
    window.until(begin, |window| window.last_message().starts_with(begin));
}

#[test]
fn a_file_with_errors_is_saved_as_a_draft_and_completed_by_saving() {
    let mut window = Window::open(Some(OPEN));
    window.click("component arm");
    window.fill("Component name", "hand");
    press(&mut window, Modifiers::COMMAND, "Not saved");
    assert!(window.last_message().contains("Save as draft"), "{}", window.last_message());
    assert_eq!(read(&window.path("robot.xml")), OPEN);
    press(&mut window, Modifiers::COMMAND | Modifiers::ALT, "Saved");
    window.settle();
    let draft = OPEN.replace("arm\"", "hand\"").replace("arm.", "hand.");
    let draft = draft.replace("kind=\"hand\"", "kind=\"arm\"");
    let draft = draft.replace("version=\"1\"", "version=\"1\" draft=\"true\"");
    assert_eq!(read(&window.path("robot.xml")), draft);
    assert!(window.has("robot.xml (draft)"));
    assert!(window.has("this file is a draft, which is not run"), "the check reports it");
    // A run states what is missing, and starts nothing.
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.until("it is refused", |window| window.last_message().starts_with("Not run"));
    assert!(!window.last_message().contains("Save as draft"), "{}", window.last_message());
    assert!(window.harness.state_mut().workspace().live.run().is_none());
    window.settle();
    window.click("view: System");
    window.click("component eye");
    window.fill("parameter device", "usb");
    press(&mut window, Modifiers::COMMAND, "Saved");
    window.settle();
    let saved = read(&window.path("robot.xml"));
    assert!(!saved.contains("draft") && saved.contains("usb"), "{saved}");
    assert!(!window.has("robot.xml (draft)") && window.has("robot.xml"));
    // Undo leads back to the draft, and to the text before it.
    for _ in 0..4 {
        window.keys(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(window.text(), OPEN);
}

#[test]
fn a_file_that_was_opened_with_errors_is_not_run_and_can_become_a_draft() {
    let mut window = Window::open(Some(OPEN));
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.until("it is refused", |window| window.last_message().starts_with("Not run"));
    let message = window.last_message();
    assert!(message.contains("this file has errors") && !message.contains("draft"), "{message}");
    assert!(window.harness.state_mut().workspace().live.run().is_none());
    press(&mut window, Modifiers::COMMAND | Modifiers::ALT, "Saved");
    window.settle();
    assert!(read(&window.path("robot.xml")).contains("draft=\"true\""), "nothing was edited");
    assert!(window.has("robot.xml (draft)"));
}

#[test]
fn a_file_without_errors_is_never_a_draft() {
    let mut window = Window::open(Some(&OPEN.replace(
        r#"<component name="eye" kind="eye"/>"#,
        r#"<component name="eye" kind="eye"><parameter name="device" value="u"/></component>"#,
    )));
    press(&mut window, Modifiers::COMMAND | Modifiers::ALT, "Saved");
    assert!(!read(&window.path("robot.xml")).contains("draft"));
}

#[test]
fn a_new_robot_with_errors_gets_a_name_as_a_draft() {
    let mut window = Window::open(None);
    window.key(Key::A);
    window.write("eye");
    window.key(Key::Enter);
    window.keys(Modifiers::COMMAND | Modifiers::ALT, Key::S);
    let path = window.path("new.xml");
    window.keys(Modifiers::COMMAND, Key::A);
    window.write(&path.to_string_lossy());
    window.harness.key_press(Key::Enter);
    window.until("it is saved", |window| window.last_message().starts_with("Saved"));
    assert!(read(&path).contains("draft=\"true\""), "{}", read(&path));
}
