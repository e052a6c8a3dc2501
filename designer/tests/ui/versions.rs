//! The live view compares the version that runs with the text on the screen, and keeps the logs of
//! earlier runs apart.

use std::time::Duration;

use armor_configd::KeptVersion;
use armor_designer::live::RunningVersions;
use armor_inspect::log::LogLine;
use armor_inspect::systems::RunRecord;
use armor_inspect::{MissionLook, ParameterClient, SystemEvent, SystemPicture};
use armor_sdk::configuration::ParameterList;
use armor_sdk::control::{Answer, RunState};
use armor_sdk::directory::DirectoryChange;
use armor_wire::registry::ComponentEntry;
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;

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

fn entry(name: &str, instance: u64) -> ComponentEntry {
    ComponentEntry {
        name: name.into(),
        kind: "bench".into(),
        instance,
        pid: 7,
        host: "here".into(),
        endpoint: "127.0.0.1:1".into(),
    }
}

fn add(picture: &mut SystemPicture, name: &str, instance: u64) {
    let mut handle = |event| drop(picture.handle_event(event, Duration::ZERO));
    handle(SystemEvent::Registry(DirectoryChange::Appeared(entry(name, instance))));
    handle(SystemEvent::Connected(name.into(), instance));
    let answer = Answer::State { state: RunState::Active, activation: 1, controllable: true };
    handle(SystemEvent::Answered(name.into(), instance, answer));
}

/// A window that watches a run of `ROBOT` in its third version, in which the arm was restarted.
fn watching() -> Window {
    let mut window = Window::open(Some(ROBOT));
    let path = window.path("robot.xml");
    let mut picture = SystemPicture::default();
    for (name, instance) in [("eye", 1), ("arm", 1), ("arm", 2)] {
        add(&mut picture, name, instance);
    }
    let record = RunRecord {
        system: "bench".into(),
        file_names: Vec::new(),
        pid: std::process::id(),
        registry: "127.0.0.1:4000".parse().unwrap(),
        started_s: 1_790_000_000.0,
        file: path.clone(),
        out: window.path("out"),
        place: None,
    };
    let runs = KeptVersion { number: 3, files: vec![(path, ROBOT.to_owned())] };
    let live = &mut window.harness.state_mut().workspace().live;
    let list = ParameterList { version: 3, refused: false, parameters: Vec::new() };
    live.show_still(picture, MissionLook::default(), ParameterClient::still(list, None)).unwrap();
    live.show_versions(record, RunningVersions::still(runs, None));
    window.click("view: Live");
    window
}

fn edit(window: &mut Window, from: &str, to: &str) {
    let text = window.text();
    assert!(text.contains(from), "{text}");
    let project = &mut window.harness.state_mut().workspace().project;
    project.replace_text(0, "edit", text.replace(from, to).into());
    window.settle();
}

#[test]
fn what_is_drawn_is_what_runs_and_an_edit_is_marked() {
    let mut window = watching();
    assert!(window.has("version 3 runs"));
    edit(
        &mut window,
        r#"<component name="arm" kind="arm"/>"#,
        r#"<component name="hand" kind="arm"/>"#,
    );
    edit(&mut window, r#"to="arm.target""#, r#"to="hand.target""#);
    edit(&mut window, r#"components="arm""#, r#"components="hand""#);
    edit(&mut window, r#""usb""#, r#""csi""#);
    edit(&mut window, r#"<place name="home"/>"#, r#"<place name="home"/><place name="hold"/>"#);
    for label in [
        "version 3 runs; the text on the screen differs",
        "component eye: active, differs in the text",
        "component arm: active, 1 restart, removed in the text",
        "component hand: not running: only in the text",
        "link eye.target to hand.target: not running: only in the text",
        "place hold: not running: only in the text",
    ] {
        assert!(window.has(label), "{label}");
    }
    // Undone, the text is the one that runs.
    for _ in 0..5 {
        window.keys(Modifiers::COMMAND, Key::Z);
    }
    assert!(window.has("version 3 runs") && window.has("component arm: active, 1 restart"));
    assert!(!window.has("component hand: not running: only in the text"));
}

#[test]
fn of_another_open_file_only_what_runs_is_drawn() {
    let mut window = watching();
    let other = window.path("other.xml");
    std::fs::write(&other, ROBOT.replace("eye", "ear")).unwrap();
    window.harness.state_mut().open(&other);
    window.settle();
    assert!(window.has("version 3 runs; the open file is another one"));
    assert!(window.has("component eye: active"));
    assert!(window.harness.query_by_label_contains("component ear").is_none());
}

#[test]
fn watching_a_system_opens_its_file_and_asks_before_work_is_lost() {
    let mut window = watching();
    let other = window.path("other.xml");
    std::fs::write(&other, ROBOT.replace("eye", "ear")).unwrap();
    edit(&mut window, r#""usb""#, r#""csi""#);
    window.harness.state_mut().workspace().opened = Some(other.clone());
    window.settle();
    assert!(window.has("Unsaved changes"));
    window.click("Leave without saving");
    assert_eq!(window.text(), std::fs::read_to_string(&other).unwrap());
}

#[test]
fn a_new_run_has_a_new_log_and_the_one_before_is_read_under_its_name() {
    let mut window = watching();
    let say = |window: &mut Window, text: &str| {
        let live = &window.harness.state_mut().workspace().live;
        live.log.push(LogLine::own_line("eye", "INFO", text));
        window.settle();
    };
    window.harness.state_mut().workspace().live.log_name = "bench, started 08:00:00 UTC".into();
    say(&mut window, "of the first run");
    assert!(window.has("of the first run") && !window.has("log of the run"));
    // More lines than the first run had, as those of a run that was not looked at.
    let live = &mut window.harness.state_mut().workspace().live;
    live.begin_log("bench, started 09:00:00 UTC".into());
    for _ in 0..3 {
        say(&mut window, "of the second run");
    }
    assert!(!window.has("of the first run"));
    window.click("log of the run");
    window.click("bench, started 08:00:00 UTC");
    assert!(window.has("of the first run") && !window.has("of the second run"));
    window.click("log of the run");
    window.click("bench, started 09:00:00 UTC (newest)");
    assert!(!window.has("of the first run"));
}
