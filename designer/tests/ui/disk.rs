//! The window and the disk: other programs change the file, a crash leaves work behind, files are
//! dropped, drawings are saved as pictures.

use std::path::Path;
use std::sync::Arc;

use armor_designer::disk::recovery::{Kept, KeptFile};
use armor_designer::{Command, system};
use eframe::egui::{DroppedFile, Key};
use egui_kittest::kittest::Queryable;

use crate::ui::{Window, read};

const ROBOT: &str = r#"<armor version="1">
  <system name="bench">
    <component name="eye" kind="eye">
      <parameter name="device" value="usb"/>
    </component>
    <component name="arm" kind="arm"/>
    <link from="eye.target" to="arm.target"/>
    <component name="lamp" kind="lamp"/>
  </system>
</armor>
"#;

/// Another program writes the file.
fn outside(window: &Window, from: &str, to: &str) {
    let path = window.path("robot.xml");
    let text = read(&path);
    assert!(text.contains(from), "{text}");
    armor_files::save_atomically(&path, text.replace(from, to).as_bytes()).unwrap();
}

fn rename(window: &mut Window, from: &str, to: &str) {
    let workspace = window.harness.state_mut().workspace();
    assert!(workspace.edit("renaming", |documents| system::rename(documents, from, to)));
    window.settle();
}

#[test]
fn a_file_that_changed_on_the_disk_is_read_again() {
    let mut window = Window::open(Some(ROBOT));
    outside(&window, "\"usb\"", "\"firewire\"");
    window.until("it is read again", |window| window.text().contains("firewire"));
    assert!(
        window.last_message().contains("changed by another program"),
        "{}",
        window.last_message()
    );
    assert!(!window.harness.state_mut().workspace().project.is_dirty());
}

#[test]
fn changes_in_different_places_are_merged() {
    let mut window = Window::open(Some(ROBOT));
    rename(&mut window, "lamp", "light");
    outside(&window, "\"usb\"", "\"firewire\"");
    window.until("both are there", |window| {
        let text = window.text();
        text.contains("firewire") && text.contains("\"light\"")
    });
    assert!(
        window.harness.state_mut().workspace().project.is_dirty(),
        "the file has only one of them"
    );
    assert!(!read(&window.path("robot.xml")).contains("light"), "nothing is written unasked");
}

#[track_caller]
fn decides(button: &str, expected: &str, other: &str) {
    let mut window = Window::open(Some(ROBOT));
    rename(&mut window, "lamp", "mine");
    outside(&window, "\"lamp\"", "\"theirs\"");
    window.until("it is asked", |window| window.has("Keep mine"));
    let shows = |part: &str| window.harness.query_all_by_label_contains(part).next().is_some();
    assert!(shows("Yours, from line") && shows("\"mine\"") && shows("\"theirs\""));
    window.click(button);
    assert!(window.text().contains(expected), "{}", window.text());
    assert!(!window.has("Keep mine"));
    window.harness.state_mut().workspace().project.undo();
    assert!(window.text().contains(other), "undo brings back the other: {}", window.text());
}

#[test]
fn a_contradiction_is_for_the_user_to_decide() {
    decides("Keep mine", "\"mine\"", "\"theirs\"");
    decides("Use the version on disk", "\"theirs\"", "\"mine\"");
}

#[test]
fn a_deleted_file_is_reported_and_created_again() {
    let mut window = Window::open(Some(ROBOT));
    std::fs::remove_file(window.path("robot.xml")).unwrap();
    window.until("it is missed", |window| window.last_message().contains("was deleted on disk"));
    window.harness.state_mut().workspace().order_command(Command::Save);
    window.until("it exists again", |window| window.path("robot.xml").exists());
    assert_eq!(read(&window.path("robot.xml")), ROBOT);
}

#[test]
fn a_file_that_became_no_text_counts_as_not_saved_and_is_replaced() {
    let mut window = Window::open(Some(ROBOT));
    std::fs::write(window.path("robot.xml"), b"\xff\xfe garbage").unwrap();
    window.until("it is reported", |window| window.last_message().contains("not UTF-8"));
    assert!(window.harness.state_mut().workspace().project.is_dirty());
    window.harness.state_mut().workspace().order_command(Command::Save);
    window.until("it is saved", |window| window.last_message().starts_with("Saved"));
    assert_eq!(read(&window.path("robot.xml")), ROBOT);
}

#[test]
fn a_file_that_is_no_text_is_shown_with_its_finding_until_it_is_mended() {
    let mut window = Window::open(Some(ROBOT));
    let path = window.path("latin.xml");
    std::fs::write(&path, b"<armor version=\"1\">\n  <!-- \xe4 -->\n</armor>\n").unwrap();
    window.harness.state_mut().open(&path);
    window.settle();
    let checked = window.harness.state_mut().workspace().project.checked().clone();
    let found = checked.findings.iter().next().unwrap();
    assert_eq!(found.code.as_str(), "E0002");
    assert_eq!(found.at.as_ref().unwrap().line_column(), (2, 8));
    std::fs::write(&path, ROBOT).unwrap();
    window.until("it is read again", |window| window.has("component lamp"));
    assert!(!window.harness.state_mut().workspace().project.is_dirty());
}

/// What a designer that died has left in a folder.
fn left_behind(folder: &Path, kept: &Kept) {
    let folder = folder.join("own/recovery");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("1-0.lock"), "").unwrap();
    std::fs::write(folder.join("1-0.json"), serde_json::to_vec(kept).unwrap()).unwrap();
}

fn after_a_crash() -> Window {
    Window::open_as(Some(ROBOT), |folder, start| {
        let path = Some(folder.join("robot.xml").into_os_string());
        let text = Some(ROBOT.replace("\"lamp\"", "\"unsaved\""));
        let file = KeptFile { path, saved: ROBOT.into(), text };
        left_behind(folder, &Kept::now(vec![file]));
        start.own_folder = Some(folder.join("own"));
    })
}

#[test]
fn unsaved_work_of_a_crash_is_offered_and_brought_back() {
    let mut window = after_a_crash();
    assert!(!window.text().contains("unsaved"), "nothing is taken unasked");
    window.click("Recover");
    assert!(window.text().contains("\"unsaved\""));
    assert_eq!(read(&window.path("robot.xml")), ROBOT, "the file is as it was");
    window.harness.state_mut().workspace().project.undo();
    assert_eq!(window.text(), ROBOT);
}

#[test]
fn unsaved_work_can_be_left_for_later_or_thrown_away() {
    let mut window = after_a_crash();
    let kept = window.path("own/recovery/1-0.json");
    window.click("Later");
    assert!(kept.exists() && !window.has("Recover"));
    let mut window = after_a_crash();
    let kept = window.path("own/recovery/1-0.json");
    window.key(Key::Escape);
    assert!(kept.exists() && !window.has("Recover"), "Escape leaves it for later too");
    let mut window = after_a_crash();
    let kept = window.path("own/recovery/1-0.json");
    window.click("Discard");
    assert!(!kept.exists() && !window.has("Recover"));
}

#[test]
fn what_is_drawn_is_kept_until_it_is_saved() {
    let mut window = Window::open_as(Some(ROBOT), |folder, start| {
        start.own_folder = Some(folder.join("own"));
    });
    let kept = |window: &mut Window| {
        let entries = std::fs::read_dir(window.path("own/recovery")).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        let mut texts =
            paths.filter(|path| path.extension().is_some_and(|e| e == "json")).map(|p| read(&p));
        texts.next()
    };
    assert_eq!(kept(&mut window), None);
    rename(&mut window, "lamp", "light");
    window.until("it is kept", |window| kept(window).is_some_and(|text| text.contains("light")));
    window.harness.state_mut().workspace().order_command(Command::Save);
    window.until("it is let go", |window| kept(window).is_none());
    assert!(read(&window.path("robot.xml")).contains("light"));
}

#[test]
fn what_is_being_written_is_kept_too() {
    let mut window = Window::open_as(Some(ROBOT), |folder, start| {
        start.own_folder = Some(folder.join("own"));
    });
    window.click("component eye");
    window.click("parameter device");
    window.write("-serial");
    assert!(!window.text().contains("serial"), "the field has not been left");
    window.until("it is kept", |window| {
        let entries = std::fs::read_dir(window.path("own/recovery")).unwrap();
        let mut paths = entries.map(|entry| entry.unwrap().path());
        paths.any(|path| {
            path.extension().is_some_and(|e| e == "json") && read(&path).contains("serial")
        })
    });
    window.key(Key::Escape);
    window.until("it is let go", |window| {
        let mut entries = std::fs::read_dir(window.path("own/recovery")).unwrap();
        entries.all(|entry| entry.unwrap().path().extension().is_none_or(|e| e != "json"))
    });
    assert_eq!(window.text(), ROBOT);
}

#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn a_file_dropped_on_the_window_is_opened() {
    let mut window = Window::open(None);
    let path = window.path("dropped.xml");
    std::fs::write(&path, ROBOT).unwrap();
    window.harness.input_mut().dropped_files.push(Arc::new(Dropped(path)));
    window.settle();
    assert!(window.has("component lamp"));
}

#[test]
fn the_drawing_is_saved_as_a_picture() {
    let mut window = Window::open(Some(ROBOT));
    for (name, begins) in [("drawing.svg", &b"<svg"[..]), ("drawing.png", b"\x89PNG")] {
        window.harness.state_mut().workspace().order_command(Command::Export);
        window.settle();
        window.fill("File name", name);
        let bytes = std::fs::read(window.path(name)).unwrap();
        assert!(bytes.starts_with(begins), "{name}: {}", window.last_message());
    }
    let svg = read(&window.path("drawing.svg"));
    for word in [">eye</text>", ">arm</text>", ">target</text>"] {
        assert!(svg.contains(word), "{word} is not in the drawing");
    }
    window.harness.state_mut().workspace().order_command(Command::Export);
    window.settle();
    window.fill("File name", "drawing.pdf");
    assert!(window.last_message().contains(".svg"), "{}", window.last_message());
    window.key(Key::Escape);
}
