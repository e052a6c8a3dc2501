//! What is being written into a field is part of the file for saving and leaving.

use eframe::egui::{Event, Key, Modifiers, ViewportCommand};

use crate::ui::{Window, read};

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
  <mission goal="home" safe="hold">
    <place name="go" initial="true" components="arm"/>
    <place name="home"/>
    <place name="hold"/>
    <transition name="seen" from="go" to="home" on="arm.done"/>
    <transition name="late" from="go" to="hold" timeout="90s"/>
  </mission>
</armor>
"#;

impl Window {
    /// Clicks on a field and selects what is in it.
    fn enter(&mut self, label: &str) {
        self.click(label);
        self.keys(Modifiers::COMMAND, Key::A);
    }

    /// Presses keys; returns whether the window was asked to close.
    fn closes_with(&mut self, modifiers: Modifiers, key: Key) -> bool {
        let event = Event::Key { key, modifiers, physical_key: None, pressed: true, repeat: false };
        self.harness.input_mut().events.push(event);
        self.harness.step();
        let viewports = self.harness.output().viewport_output.values();
        let mut commands = viewports.flat_map(|viewport| &viewport.commands);
        let closes = commands.any(|command| *command == ViewportCommand::Close);
        self.settle();
        closes
    }
}

/// A mission's transition with its time being written.
fn at_the_time(text: &str) -> Window {
    let mut window = Window::open(Some(text));
    window.click("view: Mission");
    window.click("transition late");
    window.enter("timeout");
    window
}

#[test]
fn a_text_and_return_in_one_frame_lose_nothing() {
    let mut window = at_the_time(ROBOT);
    window.harness.event(Event::Text("76".into()));
    window.harness.step();
    window.harness.event(Event::Text("s".into()));
    window.key(Key::Enter);
    assert!(window.text().contains(r#"timeout="76s""#), "{}", window.text());
    window.enter("timeout");
    window.harness.event(Event::Text("5min".into()));
    window.key(Key::Enter);
    assert!(window.text().contains(r#"timeout="5min""#), "{}", window.text());
}

#[test]
fn escape_takes_back_what_was_written() {
    let mut window = at_the_time(ROBOT);
    window.write("76s");
    window.key(Key::Escape);
    assert_eq!(window.text(), ROBOT);
}

/// Saves in the middle of a field.
fn saves(mut window: Window, text: &str, expected: &str) {
    window.write(text);
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.until("it is saved", |window| window.last_message().starts_with("Saved"));
    let saved = read(&window.path("robot.xml"));
    assert!(saved.contains(expected), "{saved}");
}

#[test]
fn saving_saves_what_is_being_written() {
    saves(at_the_time(ROBOT), "99s", r#"timeout="99s""#);
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.enter("parameter device");
    saves(window, "firewire", r#"value="firewire""#);
}

#[test]
fn leaving_asks_about_what_is_being_written() {
    let mut window = at_the_time(ROBOT);
    window.write("99s");
    assert!(!window.closes_with(Modifiers::COMMAND, Key::Q));
    assert!(window.has("Leave without saving"));
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.enter("parameter device");
    window.write("firewire");
    assert!(!window.closes_with(Modifiers::COMMAND, Key::N));
    assert!(window.has("Leave without saving"));
    let mut window = Window::open(Some(ROBOT));
    assert!(window.closes_with(Modifiers::COMMAND, Key::Q), "nothing is lost");
}

#[test]
fn what_cannot_be_taken_is_not_lost_in_silence() {
    let mut window = at_the_time(ROBOT);
    window.enter("priority");
    window.write("much");
    assert!(!window.closes_with(Modifiers::COMMAND, Key::Q));
    assert!(window.last_message().starts_with("priority not changed"), "{}", window.last_message());
    let mut window = Window::open(Some(ROBOT));
    window.click("component eye");
    window.enter("Component name");
    window.write("an eye");
    assert!(!window.closes_with(Modifiers::COMMAND, Key::Q));
    assert!(window.last_message().contains("an eye"), "{}", window.last_message());
}

#[test]
fn another_view_takes_what_is_being_written_along() {
    let mut window = at_the_time(ROBOT);
    window.write("99s");
    window.keys(Modifiers::COMMAND, Key::Num1);
    assert!(window.text().contains(r#"timeout="99s""#), "{}", window.text());
}
