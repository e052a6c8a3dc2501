//! A component, or a place of a sub-mission, is renamed or removed that other files name.

use std::path::Path;

use armor_designer::View;
use eframe::egui::{Key, Modifiers};

use egui_kittest::kittest::Queryable;

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

const DOCK: &str = r#"<armor version="1">
  <mission name="dock" system="robot.xml" goal="done">
    <place name="creep" initial="true"/>
    <place name="done"/>
    <transition name="contact" from="creep" to="done" timeout="5s"/>
  </mission>
</armor>
"#;

const TOUR: &str = r#"<armor version="1">
  <mission name="tour" system="robot.xml" goal="home">
    <place name="home"/>
    <place name="ride" initial="true"/>
    <submission ref="dock.xml" in="ride" out="home"/>
    <check>never dock.creep and home</check>
  </mission>
</armor>
"#;

/// A window on a sub-mission that a mission next to it includes.
fn submission_window() -> Window {
    Window::open_as(Some(ROBOT), |folder: &Path, start| {
        std::fs::write(folder.join("dock.xml"), DOCK).unwrap();
        std::fs::write(folder.join("tour.xml"), TOUR).unwrap();
        start.file = Some(folder.join("dock.xml"));
        start.view = View::Mission;
    })
}

#[test]
fn the_checks_of_including_missions_follow_a_place() {
    let mut window = submission_window();
    window.click("place creep");
    window.fill("name of the place", "crawl");
    assert!(window.has("Other files name creep") && window.has("tour.xml: named once"));
    window.click("Change them too");
    save(&mut window);
    assert_eq!(read(&window.path("tour.xml")), TOUR.replace("dock.creep", "dock.crawl"));
    window.keys(Modifiers::COMMAND, Key::Z);
    save(&mut window);
    assert_eq!(read(&window.path("tour.xml")), TOUR, "both files are one step");
    assert_eq!(read(&window.path("dock.xml")), DOCK);
}

#[test]
fn the_checks_of_including_missions_follow_the_name_of_the_mission() {
    let mut window = submission_window();
    window.fill("name of the mission", "wharf");
    assert!(window.has("Other files name dock") && window.has("tour.xml: named once"));
    window.click("Change them too");
    save(&mut window);
    assert_eq!(read(&window.path("tour.xml")), TOUR.replace("dock.creep", "wharf.creep"));
    assert_eq!(read(&window.path("dock.xml")), DOCK.replace("\"dock\"", "\"wharf\""));
    window.keys(Modifiers::COMMAND, Key::Z);
    save(&mut window);
    assert_eq!(read(&window.path("tour.xml")), TOUR, "both files are one step");
    assert_eq!(read(&window.path("dock.xml")), DOCK);
}

#[test]
fn a_removed_place_is_reported_where_a_check_names_it() {
    let mut window = submission_window();
    window.click("place creep");
    window.key(Key::Delete);
    assert!(window.has("Other files name creep"));
    let shown = window.harness.query_all_by_label_contains("tour.xml: named once; it cannot be");
    assert_eq!(shown.count(), 1);
    window.key(Key::Escape);
    assert_eq!(window.last_message(), "1 other file still names creep");
    window.keys(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.text(), DOCK);
}
