//! The live view of a recording, with its time line: everything by its accessible name.

use std::sync::Arc;

use armor_designer::live::{FoundMarks, MarkKind, Playback, TimeMark};
use armor_inspect::{MissionLook, ParameterClient, SystemPicture};
use armor_recording::playback::PlaybackState;
use armor_sdk::configuration::ParameterList;
use armor_sdk::control::PlaybackOrder;
use eframe::egui::{Key, Modifiers, Vec2};
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
    <transition name="seen" from="explore" to="home" on="arm.done"/>
  </mission>
</armor>
"#;

fn mark(at_s: f64, kind: MarkKind, text: &str) -> TimeMark {
    TimeMark { at_s: 1000.0 + at_s, seek_s: 1000.0 + at_s, kind, text: text.into() }
}

fn found() -> FoundMarks {
    let marks = vec![
        mark(1.0, MarkKind::Firing, "began"),
        mark(20.0, MarkKind::Report, "arm is done"),
        mark(20.5, MarkKind::Firing, "seen"),
        mark(40.0, MarkKind::Failure, "arm failed: no path"),
        mark(50.0, MarkKind::Loss, "eye.target: 3 messages lost"),
    ];
    FoundMarks {
        marks: Arc::new(marks),
        span_s: Some((1000.0, 1060.0)),
        files: Arc::new(vec![("robot.xml".into(), ROBOT.into())]),
        progress: 1.0,
        is_complete: true,
        ..FoundMarks::default()
    }
}

fn state() -> PlaybackState {
    PlaybackState {
        stamp: 1010.0,
        from: 1000.0,
        to: 1060.0,
        at: 10.0,
        speed: 1.0,
        paused: true,
        recording: "/data/drive.mcap".into(),
        components: vec!["arm".into(), "executive".into(), "eye".into()],
        ..PlaybackState::default()
    }
}

/// A window that plays a recording, which stands at 10 s of 60 s.
fn playing_a(found: FoundMarks, state: PlaybackState) -> Window {
    let mut window = Window::open(None);
    let live = &mut window.harness.state_mut().workspace().live;
    let list = ParameterList { version: 1, refused: false, parameters: Vec::new() };
    let parameters = ParameterClient::still(list, None);
    live.show_still(SystemPicture::default(), MissionLook::default(), parameters).unwrap();
    live.show_playback(Playback::still("/data/drive.mcap".as_ref(), true, found), state);
    window.click("view: Live");
    window
}

fn playing() -> Window {
    playing_a(found(), state())
}

/// The orders that the player was given since the last call.
fn ordered(window: &mut Window) -> Vec<PlaybackOrder> {
    let live = &window.harness.state_mut().workspace().live;
    live.player().map(armor_recording::playback::PlayerRemote::take_given).unwrap_or_default()
}

fn seek(at_s: f64) -> PlaybackOrder {
    PlaybackOrder::Seek { at_s }
}

#[test]
fn what_was_recorded_is_drawn_and_not_the_open_file() {
    let window = playing();
    assert!(window.has("robot.xml, as drive.mcap has it"));
    for label in ["component eye", "place explore", "transition seen"] {
        let found = window.harness.query_all_by_label_contains(label).count();
        assert!(found > 0, "{label}");
    }
}

#[test]
fn the_buttons_order_the_player() {
    let mut window = playing();
    assert!(window.has("0:10.0 / 1:00.0") && window.has("paused"));
    for (label, order) in [
        ("time line: Play", PlaybackOrder::Resume),
        ("time line: Step", PlaybackOrder::Step { time_s: 0.0 }),
        ("time line: Begin", seek(0.0)),
        ("time line: End", seek(60.0)),
        ("Loop", PlaybackOrder::Loop { on: true }),
    ] {
        window.click(label);
        assert_eq!(ordered(&mut window), [order], "{label}");
    }
    window.click("speed");
    window.click("10 ×");
    assert_eq!(ordered(&mut window), [PlaybackOrder::Speed { factor: 10.0 }]);
    let live = &window.harness.state_mut().workspace().live;
    live.player().unwrap().set_state(PlaybackState { paused: false, ..state() });
    window.settle();
    window.click("time line: Pause");
    assert_eq!(ordered(&mut window), [PlaybackOrder::Pause]);
}

#[test]
fn the_keys_of_the_time_line_act_while_it_has_the_focus() {
    let mut window = playing();
    window.click("time line");
    ordered(&mut window);
    for (modifiers, key, order) in [
        (Modifiers::NONE, Key::Space, PlaybackOrder::Resume),
        (Modifiers::NONE, Key::ArrowRight, seek(11.0)),
        (Modifiers::SHIFT, Key::ArrowLeft, seek(0.0)),
        (Modifiers::NONE, Key::Home, seek(0.0)),
        (Modifiers::NONE, Key::End, seek(60.0)),
        (Modifiers::NONE, Key::PageDown, seek(20.5)),
        (Modifiers::NONE, Key::PageUp, seek(1.0)),
        (Modifiers::NONE, Key::F9, PlaybackOrder::Resume),
        (Modifiers::NONE, Key::F10, PlaybackOrder::Step { time_s: 0.0 }),
    ] {
        window.keys(modifiers, key);
        assert_eq!(ordered(&mut window), [order], "{key:?}");
    }
}

#[test]
fn in_a_drawing_and_in_a_list_the_keys_keep_their_meaning() {
    let mut window = playing();
    let drawing = window.at("drawing of the running system") + Vec2::new(0.0, 90.0);
    window.click_at(drawing);
    for key in [Key::Space, Key::ArrowRight, Key::Home, Key::End] {
        window.key(key);
    }
    assert_eq!(ordered(&mut window), []);
    window.key(Key::F9);
    assert_eq!(ordered(&mut window), [PlaybackOrder::Resume], "this key is not the drawing's");
    window.click("time line");
    ordered(&mut window);
    window.keys(Modifiers::COMMAND, Key::P);
    window.key(Key::Space);
    window.key(Key::Home);
    assert_eq!(ordered(&mut window), [], "the list of commands is open");
}

#[test]
fn a_click_on_the_track_goes_to_that_moment_and_on_a_mark_to_the_mark() {
    let mut window = playing();
    let track = window.harness.get_by_label("time line").rect();
    let x_of = |at_s: f32| track.left() + 10.0 + (track.width() - 20.0) * at_s / 60.0;
    let at = |at_s: f32| eframe::egui::pos2(x_of(at_s), track.top() + 8.0);
    window.click_at(at(30.0));
    let given = ordered(&mut window);
    let [PlaybackOrder::Seek { at_s }] = given.as_slice() else { panic!("{given:?}") };
    assert!((at_s - 30.0).abs() < 0.1, "{at_s}");
    assert!(window.has("0:30.0 / 1:00.0"), "the chosen moment is shown until the player is there");
    window.click_at(at(20.4));
    assert_eq!(ordered(&mut window), [seek(20.5)], "the firing next to it");
    window.drag(at(30.0), at(45.0));
    let last = ordered(&mut window).pop();
    let Some(PlaybackOrder::Seek { at_s }) = last else { panic!("{last:?}") };
    assert!((at_s - 45.0).abs() < 0.1, "{at_s}");
}

#[test]
fn choosing_a_firing_goes_to_its_moment_and_selects_its_transition() {
    let mut window = playing();
    window.click("live: Marks");
    for label in [
        "firing began at 0:01.0",
        "report arm is done at 0:20.0",
        "failure arm failed: no path at 0:40.0",
        "loss eye.target: 3 messages lost at 0:50.0",
    ] {
        assert!(window.has(label), "{label}");
    }
    window.click("firing seen at 0:20.5");
    assert_eq!(ordered(&mut window), [seek(20.5)]);
    let heading = window.harness.query_all_by_label_contains("seen").count();
    assert!(heading >= 3, "the transition is selected, and its heading shown: {heading}");
}

#[test]
fn the_legend_hides_kinds_of_marks() {
    let mut window = playing();
    window.click("live: Marks");
    assert!(window.has("marks: Firings 2") && window.has("marks: Losses 1"));
    window.click("marks: Reports 1");
    assert!(!window.has("report arm is done at 0:20.0"));
    assert!(window.has("firing began at 0:01.0"));
    window.click("marks: Reports 1");
    assert!(window.has("report arm is done at 0:20.0"));
}

#[test]
fn what_is_wrong_with_a_recording_is_stated() {
    let trouble = FoundMarks {
        trouble:
            "/data/drive.mcap cannot be read as a recording: it does not begin as an MCAP file does"
                .into(),
        is_complete: true,
        ..FoundMarks::default()
    };
    let window = playing_a(trouble, PlaybackState::default());
    assert!(window.has(
        "/data/drive.mcap cannot be read as a recording: it does not begin as an MCAP file does"
    ));
    let bare = FoundMarks {
        files: Arc::default(),
        notes: vec!["it has no system file: the components are listed at the left".into()],
        ..found()
    };
    let window = playing_a(bare, state());
    let text = "drive.mcap has no system file: its components are listed at the left";
    assert!(window.has(text));
    let note = "Note: it has no system file: the components are listed at the left";
    assert!(window.has(note));
    assert!(window.harness.query_by_label_contains("component eye").is_none());
}

#[test]
fn without_the_program_armor_the_reason_is_stated() {
    let mut window = Window::open(None);
    let missing = window.path("drive.mcap");
    let ctx = window.harness.ctx.clone();
    window.harness.state_mut().ask_to_open(missing, &ctx);
    window.settle();
    // There is no `armor` next to this test, or it does not find the file.
    let message = window.last_message();
    let stated = message.contains("the program `armor` was not found");
    if !stated {
        window.until("the reason", |window| {
            window.harness.query_by_label_contains("cannot be read: No such file").is_some()
        });
    }
}

#[test]
fn a_recording_is_chosen_from_the_menu() {
    let mut window = Window::open(None);
    std::fs::write(window.path("drive.mcap"), "no recording").unwrap();
    std::fs::write(window.path("robot.xml"), ROBOT).unwrap();
    window.keys(Modifiers::COMMAND | Modifiers::SHIFT, Key::O);
    assert!(window.has("Open a recording"));
    window.key(Key::Escape);
    assert!(!window.has("Open a recording"));
}
