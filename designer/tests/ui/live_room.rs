//! What can be read in the live view of a small window: the drawings share its height by what their
//! texts need, and the panel beneath gives way.

use std::path::Path;

use armor_inspect::log::LogLine;
use armor_inspect::{MissionLook, ObservedLink, ParameterClient, SystemPicture};
use armor_marking::Marking;
use eframe::egui::{Key, Modifiers, Rect, Vec2, vec2};
use egui_kittest::kittest::Queryable;

use crate::ui::drawings::{letter_sizes, shipped_kinds, texts};
use crate::ui::{Window, live};

/// The window of a small laptop.
const SMALL: Vec2 = vec2(1280.0, 800.0);

const SYSTEM: &str = "drawing of the running system";
const MISSION: &str = "drawing of the running mission";

fn link(from: &str, to: &str, rate_hz: f64) -> ObservedLink {
    ObservedLink {
        from: from.into(),
        to: to.into(),
        type_name: "Pose".into(),
        keep: "latest".into(),
        transport: "unix".into(),
        connected: true,
        paused: false,
        sent: 100,
        skipped: 0,
        history_dropped: 0,
        dropped: 0,
        lost: 0,
        queued: 0,
        waiting: 0,
        received: 100,
        rate_hz: Some(rate_hz),
        problem: String::new(),
    }
}

/// The robot of missions/office.xml while it explores, in a window of this size.
fn exploring(size: Vec2) -> Window {
    let mut window = Window::open_sized(size, None, |_, start| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions/office.xml");
        start.file = Some(file);
        start.kinds = Some(shipped_kinds().unwrap_or_default());
    });
    let links = [
        link("simulator.scan", "mapper.scan", 12.0),
        link("planner.path", "driver.path", 3.0),
        link("driver.velocity", "simulator.velocity", 17.0),
    ];
    let mut picture = SystemPicture::default();
    picture.links.extend(links);
    let marking = Marking { mission: "office".into(), enabled: Vec::new(), ..live::marking() };
    let session = &mut window.harness.state_mut().workspace().live;
    let parameters = ParameterClient::still(live::parameters(), None);
    session.show_still(picture, MissionLook::of(marking), parameters).unwrap();
    window.click("view: Live");
    window.settle();
    window
}

fn area(window: &Window, drawing: &str) -> Rect {
    window.harness.get_by_label(drawing).rect()
}

/// Whether this text is painted within the drawing.
fn is_painted(window: &Window, drawing: &str, text: &str) -> bool {
    let area = area(window, drawing);
    texts(window).iter().any(|(painted, at)| painted == text && area.contains_rect(*at))
}

#[test]
fn ports_rates_and_places_of_a_whole_robot_are_readable_in_a_small_window() {
    for size in [SMALL, vec2(1360.0, 860.0), vec2(1920.0, 1080.0)] {
        let window = exploring(size);
        for text in ["simulator", "trajectory", "odometry", "override", "12 Hz", "3.0 Hz", "17 Hz"]
        {
            assert!(is_painted(&window, SYSTEM, text), "{size}: {text}");
        }
        for text in ["explore", "explored", "late", "lost", "home"] {
            assert!(is_painted(&window, MISSION, text), "{size}: {text}");
        }
    }
}

#[test]
fn the_panel_beneath_is_a_line_with_the_newest_one_until_it_is_opened() {
    let mut window = exploring(SMALL);
    let log = window.harness.state_mut().workspace().live.log.clone();
    log.push(LogLine::own_line("driver", "ERROR", "the motor is hot"));
    log.push(LogLine::own_line("driver", "WARN", "slower"));
    log.push(LogLine::own_line("driver", "WARN", "slower still"));
    window.settle();
    assert!(window.has("1 error") && window.has("2 warnings"));
    assert!(window.has("driver: slower still") && !window.has("words in lines"));

    let before = area(&window, SYSTEM).height();
    window.click("live: Log");
    assert!(window.has("words in lines") && !window.has("1 error"));
    assert!(area(&window, SYSTEM).height() < before);
    window.click("live: fold");
    assert!(!window.has("words in lines"));
    assert_eq!(area(&window, SYSTEM).height(), before);

    // Where there is room, it is open.
    assert!(exploring(vec2(1920.0, 1080.0)).has("words in lines"));
}

#[test]
fn the_border_between_the_drawings_is_moved_by_pointer_and_keys() {
    let mut window = exploring(SMALL);
    let border = "border between system and mission";
    let first = window.at(border);
    window.drag(first, first - vec2(0.0, 120.0));
    window.settle();
    assert!((window.at(border).y - (first.y - 120.0)).abs() < 3.0, "{:?}", window.at(border));
    let gap = area(&window, MISSION).top() - area(&window, SYSTEM).bottom();
    assert!((0.0..8.0).contains(&gap), "{gap}");

    window.harness.get_by_label(border).focus();
    window.settle();
    let before = window.at(border).y;
    window.keys(Modifiers::NONE, Key::ArrowDown);
    window.settle();
    assert!(window.at(border).y > before + 5.0);
    // It stays within the window however far it is dragged.
    let at = window.at(border);
    window.drag(at, at - vec2(0.0, 2000.0));
    window.settle();
    assert!(area(&window, SYSTEM).height() >= 80.0);

    window.double_click(border);
    assert!((window.at(border).y - first.y).abs() < 1.0);
}

#[test]
fn no_letter_is_smaller_than_can_be_read() {
    for size in [SMALL, vec2(690.0, 500.0)] {
        let mut window = exploring(size);
        for view in ["view: Live", "view: System", "view: Mission", "view: Map"] {
            window.click(view);
            window.settle();
            let sizes = letter_sizes(&window);
            assert!(sizes.len() > 10, "{view}");
            for (text, letters) in sizes.iter().filter(|(text, _)| !text.is_empty()) {
                assert!(*letters >= 11.0, "{size}, {view}: {letters} pt: {text}");
            }
        }
    }
}
