//! A component is renamed or removed that files name which are not open.

use std::path::Path;

use eframe::egui::{Key, Modifiers};

use crate::ui::{Window, read};

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
  </system>
</armor>
"#;

const MISSION: &str = r#"<armor version="1">
  <mission name="work" system="robot.xml" goal="done">
    <place name="busy" initial="true" components="arm"/>
    <place name="done"/>
    <transition name="end" from="busy" to="done" timeout="5s"/>
  </mission>
</armor>
"#;

fn window() -> Window {
    Window::open_as(Some(ROBOT), |folder: &Path, _| {
        std::fs::write(folder.join("work.xml"), MISSION).unwrap();
        std::fs::write(folder.join("locked.xml"), MISSION).unwrap();
        let mut mode = std::fs::metadata(folder.join("locked.xml")).unwrap().permissions();
        mode.set_readonly(true);
        std::fs::set_permissions(folder.join("locked.xml"), mode).unwrap();
    })
}

fn save(window: &mut Window) {
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.until("it is saved", |window| window.last_message().starts_with("Saved"));
}

#[test]
fn other_files_are_named_and_changed_in_the_same_step() {
    let mut window = window();
    window.click("component arm");
    window.fill("Component name", "hand");
    for label in [
        "Other files name arm",
        "work.xml: named once",
        "locked.xml: named once; it cannot be changed: it is read-only",
    ] {
        assert!(window.has(label), "{label}");
    }
    window.click("Change them too");
    let renamed = MISSION.replace(r#""arm""#, r#""hand""#);
    assert_eq!(read(&window.path("work.xml")), MISSION, "only saving writes files");
    save(&mut window);
    assert_eq!(read(&window.path("work.xml")), renamed);
    assert_eq!(read(&window.path("locked.xml")), MISSION);
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), ROBOT);
    save(&mut window);
    assert_eq!(read(&window.path("work.xml")), MISSION, "both files are one step");
}

#[test]
fn other_files_are_left_with_escape() {
    let mut window = window();
    window.click("component arm");
    window.key(Key::Delete);
    assert!(window.has("Other files name arm"));
    window.key(Key::Escape);
    assert!(!window.has("Other files name arm"));
    assert_eq!(window.last_message(), "2 other files still name arm");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), ROBOT);
    assert_eq!(read(&window.path("work.xml")), MISSION);
}
