//! The screen as a person meets it: by accessible names, keys and the pointer, without a display.

mod scale;

use armor_grid::Pose2;
use armor_picture::theme;
use eframe::egui::accesskit::Role;
use eframe::egui::epaint::ClippedShape;
use eframe::egui::{Event as Input, Key, Modifiers, PointerButton, Pos2, Shape, Vec2, pos2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

use super::*;
use crate::connection::{RunEnd, SystemConnection};
use crate::links::SequenceNumber;
use crate::map::MapLayout;
use crate::orders::OperatorEvent;
use crate::scene::{LocatedPose, SceneError};

const SIZE: Vec2 = Vec2::new(1000.0, 700.0);
const ZERO: RobotCommand = RobotCommand::Velocity { forward_mps: 0.0, turn_radps: 0.0 };

const FIRST: SequenceNumber = SequenceNumber { instance: 1, sequence: 0 };

pub(super) struct TestScreen {
    pub(super) console: Console,
    pub(super) screen: Screen,
    pub(super) now: ClockTimes,
    commands: Vec<RobotCommand>,
}

pub(super) type ViewWindow = Harness<'static, TestScreen>;

fn layout() -> MapLayout {
    let corner = Pose2::new(-5.0, -5.0, 0.0);
    MapLayout { corner, resolution_m: 0.1, width: 100, height: 100 }
}

/// A robot at (1, 0) on a map of 10 × 10 m around the origin, all inputs linked.
pub(super) fn test_screen() -> TestScreen {
    let mut console = Console { robot_radius_m: 0.2, ..Console::default() };
    for (input, is_steady) in [("map", false), ("pose", true), ("scan", true), ("image", true)] {
        console.links.push(InputLink::new(input, format!("robot.{input}"), is_steady));
    }
    console.scene.map.replace(1.0, layout(), vec![0; 10_000]).unwrap();
    let pose = Pose2::new(1.0, 0.0, 0.0);
    let covariance_m2 = [0.04, 0.0, 0.01];
    console.scene.set_located(LocatedPose { stamp_s: 1.0, pose, covariance_m2 }).unwrap();
    let now = ClockTimes { host_s: 1.0, system_s: 1.0 };
    for input in ["map", "pose", "scan"] {
        console.record_arrival(input, now, 1.0, FIRST, Ok(()));
    }
    TestScreen {
        console,
        screen: Screen::new(crate::ports::make_panels()),
        now,
        commands: Vec::new(),
    }
}

pub(super) fn window_of(test_screen: TestScreen, size: Vec2) -> ViewWindow {
    let mut harness = Harness::builder()
        .with_size(size)
        .with_max_steps(8)
        .with_step_dt(1.0 / 60.0)
        .build_ui_state(
            |ui, test_screen: &mut TestScreen| {
                let TestScreen { console, screen, now, commands } = test_screen;
                for command in screen.show_frame(ui, console, *now) {
                    console.record_sent(&command, 1, *now);
                    commands.push(command);
                }
            },
            test_screen,
        );
    apply_theme(&harness.ctx);
    harness.run_steps(3);
    harness
}

fn window() -> ViewWindow {
    window_of(test_screen(), SIZE)
}

/// Takes the commands sent since the last call.
pub(super) fn take_commands(window: &mut ViewWindow) -> Vec<RobotCommand> {
    std::mem::take(&mut window.state_mut().commands)
}

fn events(window: &mut ViewWindow) -> Vec<OperatorEvent> {
    let orders = &mut window.state_mut().console.orders;
    std::iter::from_fn(|| orders.take_event()).collect()
}

/// A moment passes.
pub(super) fn wait(window: &mut ViewWindow, seconds: f64) {
    window.state_mut().now.host_s += seconds;
    window.run_steps(1);
}

pub(super) fn button(window: &mut ViewWindow, at: Pos2, button: PointerButton, pressed: bool) {
    let modifiers = Modifiers::NONE;
    window.event(Input::PointerButton { pos: at, button, pressed, modifiers });
    window.run_steps(1);
}

/// Presses in one place, moves, and lets go in another.
pub(super) fn stroke(window: &mut ViewWindow, with: PointerButton, from: Pos2, to: Pos2) {
    window.hover_at(from);
    window.run_steps(1);
    button(window, from, with, true);
    for share in [0.3, 0.7, 1.0] {
        window.hover_at(from + (to - from) * share);
        window.run_steps(1);
    }
    button(window, to, with, false);
    window.run_steps(1);
}

/// The map is fitted: its middle is in the middle of the area.
const MIDDLE: Pos2 = pos2(356.0, 405.0);

#[test]
fn stop_is_sent_immediately_and_stays_until_release_is_clicked() {
    let mut window = window();
    assert!(window.query_by_label("Release").is_none(), "there is nothing to release");
    window.get_by_label("STOP").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(true)]);
    window.get_by_label("STOP sent");
    window.get_by_label("STOP").click();
    window.run_steps(2);
    assert_eq!(
        take_commands(&mut window),
        [RobotCommand::Stop(true)],
        "a second click does not release"
    );
    window.get_by_label("Release").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(false)]);
    assert_eq!(events(&mut window), [OperatorEvent::Stopped, OperatorEvent::Released]);
}

#[test]
fn space_stops_whatever_has_the_focus_and_never_releases() {
    let mut window = window();
    window.key_press(Key::Space);
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(true)]);
    window.get_by_label("Release").focus();
    window.run_steps(1);
    window.key_press(Key::Space);
    window.key_press_modifiers(Modifiers::SHIFT, Key::Space);
    window.run_steps(2);
    assert!(window.state().console.orders.is_stopped());
    assert!(!take_commands(&mut window).contains(&RobotCommand::Stop(false)));
}

#[test]
fn held_keys_drive_and_a_released_key_sends_zero_once() {
    let mut window = window();
    window.key_down(Key::W);
    window.key_down(Key::ArrowLeft);
    window.run_steps(1);
    let fast = RobotCommand::Velocity { forward_mps: 0.5, turn_radps: 1.0 };
    assert_eq!(take_commands(&mut window).last(), Some(&fast), "both keys together");
    wait(&mut window, 0.06);
    assert_eq!(take_commands(&mut window), [fast], "sent again while they are held");
    window.key_up(Key::ArrowLeft);
    window.run_steps(1);
    assert_eq!(
        take_commands(&mut window),
        [RobotCommand::Velocity { forward_mps: 0.5, turn_radps: 0.0 }]
    );
    window.key_up(Key::W);
    window.run_steps(1);
    assert_eq!(take_commands(&mut window), [ZERO]);
    wait(&mut window, 1.0);
    assert_eq!(take_commands(&mut window), []);
    assert_eq!(events(&mut window), [OperatorEvent::Driving]);
}

#[test]
fn a_window_that_loses_the_focus_stops_driving() {
    let mut window = window();
    window.key_down(Key::S);
    window.run_steps(1);
    assert_eq!(
        take_commands(&mut window),
        [RobotCommand::Velocity { forward_mps: -0.5, turn_radps: 0.0 }]
    );
    window.event(Input::WindowFocused(false));
    window.input_mut().focused = false;
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [ZERO]);
}

#[test]
fn the_stick_drives_while_it_is_held_and_not_during_stop() {
    let mut window = window();
    let pad = window.get_by_label("stick").rect();
    let up = pad.center() - Vec2::new(0.0, 200.0);
    window.hover_at(pad.center());
    window.run_steps(1);
    button(&mut window, pad.center(), PointerButton::Primary, true);
    window.hover_at(up);
    window.run_steps(2);
    let last = take_commands(&mut window).pop();
    assert_eq!(last, Some(RobotCommand::Velocity { forward_mps: 0.5, turn_radps: 0.0 }));
    window.key_press(Key::Space);
    wait(&mut window, 0.1);
    assert_eq!(take_commands(&mut window), [RobotCommand::Stop(true), ZERO]);
    wait(&mut window, 0.1);
    assert_eq!(take_commands(&mut window), [], "the stick is still held, without effect");
    button(&mut window, up, PointerButton::Primary, false);
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn a_click_on_the_map_is_a_goal_and_a_right_click_deletes_it() {
    let mut window = window();
    stroke(&mut window, PointerButton::Primary, MIDDLE, MIDDLE);
    let commands = take_commands(&mut window);
    let [RobotCommand::Goal { place, .. }] = commands[..] else { panic!("{commands:?}") };
    assert!(place.point().distance_m(Default::default()) < 0.3, "{place:?}");
    let back = place.yaw_rad.abs() - std::f64::consts::PI;
    assert!(back.abs() < 0.5, "it comes from the right: {place:?}");
    window.get_by_label_contains("m away");
    stroke(&mut window, PointerButton::Secondary, MIDDLE, MIDDLE);
    assert_eq!(window.state().console.orders.goal(), None);
    assert_eq!(events(&mut window), [OperatorEvent::Goal]);
}

#[test]
fn a_stroke_is_a_goal_with_a_heading_unless_esc_cancels_it() {
    let mut window = window();
    stroke(&mut window, PointerButton::Primary, MIDDLE, MIDDLE - Vec2::new(0.0, 80.0));
    let commands = take_commands(&mut window);
    let [RobotCommand::Goal { place, .. }] = commands[..] else { panic!("{commands:?}") };
    assert!((place.yaw_rad - std::f64::consts::FRAC_PI_2).abs() < 0.01, "upwards: {place:?}");
    window.key_press(Key::Escape);
    window.run_steps(1);
    assert_eq!(window.state().console.orders.goal(), None);
    window.hover_at(MIDDLE);
    button(&mut window, MIDDLE, PointerButton::Primary, true);
    window.hover_at(MIDDLE + Vec2::new(60.0, 0.0));
    window.run_steps(2);
    window.key_press(Key::Escape);
    window.run_steps(1);
    button(&mut window, MIDDLE + Vec2::new(60.0, 0.0), PointerButton::Primary, false);
    assert_eq!(take_commands(&mut window), [], "it was cancelled while it was drawn");
}

#[test]
fn a_click_at_the_cameras_image_sends_the_robot_nowhere() {
    let mut window = window();
    let at = window.get_by_label("no image yet").rect().center();
    stroke(&mut window, PointerButton::Primary, at, at);
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn the_right_button_moves_the_map_and_sends_the_robot_nowhere() {
    let mut window = window();
    let before = window.state().screen.area.centre();
    stroke(&mut window, PointerButton::Secondary, MIDDLE, MIDDLE + Vec2::new(100.0, 0.0));
    let after = window.state().screen.area.centre();
    assert!(after.x_m < before.x_m - 0.5, "{before:?} {after:?}");
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn only_linked_inputs_appear_and_missing_data_are_marked() {
    let mut window = window();
    window.get_by_role_and_label(Role::CheckBox, "scan");
    assert!(window.query_by_label("particles").is_none());
    window.get_by_label_contains("no data yet: image").click();
    window.run_steps(2);
    window.get_by_label("none yet");
    window.get_by_label("no image yet");
    wait(&mut window, 7.0);
    assert!(window.query_all_by_label("7.0 s").count() >= 2, "scan and pose");
}

#[test]
fn a_button_of_the_mission_is_sent_once_and_shown() {
    let mut test_screen = test_screen();
    test_screen.console.buttons = vec!["explore".into(), "home".into()];
    let mut window = window_of(test_screen, SIZE);
    window.get_by_label("home").click();
    window.run_steps(3);
    assert_eq!(events(&mut window), [OperatorEvent::Pressed("home".into())]);
    wait(&mut window, 4.0);
    window.get_by_label("home: sent 4 s ago");
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn an_image_error_is_shown_in_its_place() {
    let mut window = window();
    let broken = crate::photo::decode_photo("jpeg", b"no").expect_err("no image");
    let now = window.state().now;
    window.state_mut().console.record_arrival(
        "image",
        now,
        1.0,
        FIRST,
        Err(SceneError::Photo(broken)),
    );
    window.run_steps(1);
    window.get_by_label_contains("the image is no JPEG");
}

#[test]
fn a_layer_that_is_switched_off_is_not_painted() {
    let is_scan = |shape: &&ClippedShape| matches!(&shape.shape, Shape::Mesh(mesh) if mesh.vertices.len() == 4 * 30);
    let painted = |window: &ViewWindow| window.output().shapes.iter().filter(is_scan).count();
    let mut window = window();
    let points = vec![armor_grid::Point2::new(1.0, 1.0); 30];
    window.state_mut().console.scene.scan.points = points;
    window.run_steps(1);
    assert_eq!(painted(&window), 1);
    window.get_by_role_and_label(Role::CheckBox, "scan").click();
    window.run_steps(2);
    assert_eq!(painted(&window), 0);
}

#[test]
fn on_a_small_screen_stop_and_release_are_visible() {
    let mut window = window_of(test_screen(), Vec2::new(560.0, 360.0));
    window.key_press(Key::Space);
    window.run_steps(2);
    for name in ["STOP", "Release"] {
        let rect = window.get_by_label(name).rect();
        assert!(rect.min.y > 0.0 && rect.max.y < 300.0 && rect.max.x <= 560.0, "{name}: {rect:?}");
    }
}

#[test]
fn nothing_is_repainted_without_a_change() {
    let mut test_screen = test_screen();
    test_screen.console.links.retain(|link| !link.is_steady);
    let mut window = window_of(test_screen, SIZE);
    window.run_steps(2);
    let delay = window.output().viewport_output.values().map(|out| out.repaint_delay).min();
    assert_eq!(delay, Some(std::time::Duration::MAX));
}

#[test]
fn a_host_that_is_cut_off_is_framed_and_named_with_its_clock_and_what_runs_there() {
    use armor_inspect::run_control::{HostLink, HostReport};
    use armor_inspect::{SystemEvent, SystemPicture};

    let report = |host: &str, link| HostReport {
        host: host.into(),
        link,
        reason: String::new(),
        for_s: 7.0,
        clock_offset_s: Some(-0.002),
        clock_error_s: Some(0.001),
    };
    let mut picture = SystemPicture::default();
    let reports = vec![report("arm", HostLink::CutOff), report("base", HostLink::Connected)];
    picture.handle_event(SystemEvent::Hosts(reports), std::time::Duration::ZERO);
    let mut shown = test_screen();
    shown.console.readings.store(crate::ports::HostsReading::of(&picture));
    let window = window_of(shown, Vec2::new(1000.0, 1400.0));
    for label in ["! host arm", "cut off for 7.0 s", "host base"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
    assert_eq!(window.query_all_by_label("connected").count(), 2, "the host and the screen");
    let clock = "its clock is 2.0 ms behind that of the launcher's host, ± 1.0 ms";
    assert_eq!(window.query_all_by_label(clock).count(), 2);
    assert!(self::window().query_by_label_contains("host").is_none(), "without other hosts");
}

#[test]
fn the_table_of_links_shows_transport_skipped_and_lost_of_both_ends() {
    use armor_inspect::{ObservedLink, SystemPicture};

    let link = |to: &str, transport: &str, counts: [u64; 3]| {
        let [skipped, lost, dropped] = counts;
        ObservedLink {
            from: "robot.data".into(),
            to: to.into(),
            type_name: String::new(),
            keep: "latest".into(),
            transport: transport.into(),
            connected: true,
            paused: false,
            sent: 0,
            dropped,
            skipped,
            history_dropped: 0,
            lost,
            queued: 0,
            waiting: 0,
            received: 0,
            rate_hz: None,
            problem: String::new(),
        }
    };
    let links = vec![
        link("view.map_updates", "udp→tcp", [0, 31, 4]),
        link("view.scan", "shm", [4711, 0, 0]),
        link("view2.scan", "unix", [815, 0, 0]),
    ];
    let mut picture = SystemPicture::default();
    picture.links = links;
    let mut shown = test_screen();
    let widest = InputLink::new("map_updates", "robot.map_updates".into(), false);
    shown.console.links.push(widest);
    // A pull leaves gaps, which are no losses.
    let number = SequenceNumber { instance: 1, sequence: 4712 };
    shown.console.record_arrival("scan", shown.now, 1.0, number, Ok(()));
    let mut window = window_of(shown, Vec2::new(1000.0, 1400.0));
    window.get_by_label_contains("links, no data yet").click();
    window.run_steps(2);
    for label in ["via", "skipped", "lost"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
    assert!(window.query_by_label("4711").is_some(), "without reports, gaps count as lost");
    let reading = crate::ports::LinksReading::of(&picture, "view");
    window.state_mut().console.readings.store(reading);
    window.run_steps(2);
    for label in ["udp>tcp", "35", "shm", "4711"] {
        assert_eq!(window.query_all_by_label(label).count(), 1, "{label}");
    }
    assert!(window.query_by_label("815").is_none(), "of another component");
    let right = |label| window.query_all_by_label(label).next().unwrap().rect().max.x;
    assert!(
        right("skipped") < right("lost") && right("none yet") <= 1000.0,
        "the table fits: {}",
        right("none yet")
    );
}

#[test]
fn a_new_frame_is_shown_until_the_operator_acknowledges_it() {
    let mut test_screen = test_screen();
    test_screen.console.frame_seen("map");
    let mut window = window_of(test_screen, SIZE);
    stroke(&mut window, PointerButton::Primary, MIDDLE, MIDDLE);
    assert_eq!(take_commands(&mut window).len(), 1);
    window.get_by_label_contains("m away");
    let console = &mut window.state_mut().console;
    console.scene.set_path([Pose2::IDENTITY].into_iter());
    console.scene.set_trajectory(1.0, [Pose2::IDENTITY].into_iter());
    console.frame_seen("map#3f2a");
    let scene = &console.scene;
    assert!(
        scene.map.is_empty() && scene.path.is_empty() && scene.trajectory_points().count() == 0
    );
    assert_eq!(scene.robot(), None, "its place on the new map is not known yet");
    window.run_steps(2);
    window.get_by_label_contains("The map has a new origin");
    assert!(window.query_by_label_contains("m away").is_none());
    let console = &mut window.state_mut().console;
    console.scene.map.replace(2.0, layout(), vec![0; 10_000]).unwrap();
    window.run_steps(2);
    let lower = MIDDLE + Vec2::new(0.0, 100.0);
    stroke(&mut window, PointerButton::Primary, lower, lower);
    assert_eq!(take_commands(&mut window), [], "this click may be meant for the map before");
    window.get_by_label("Acknowledge").click();
    window.run_steps(3);
    assert!(window.query_by_label_contains("The map has a new origin").is_none());
    assert_eq!(take_commands(&mut window), [], "the click at the banner is no goal");
    stroke(&mut window, PointerButton::Primary, lower, lower);
    let commands = take_commands(&mut window);
    let [RobotCommand::Goal { frame, .. }] = &commands[..] else { panic!("{commands:?}") };
    assert_eq!(&**frame, "map#3f2a");
    let expected = [OperatorEvent::Goal, OperatorEvent::FrameChanged, OperatorEvent::Goal];
    assert_eq!(events(&mut window), expected);
}

/// Sets every cell of a map of 10 × 10 m by its place.
pub(super) fn set_cells(window: &mut ViewWindow, cell: impl Fn(f64, f64) -> i8) {
    let place = |index: usize| (index as f64 + 0.5) * 0.1 - 5.0;
    let cells = (0..10_000).map(|n| cell(place(n % 100), place(n / 100))).collect();
    window.state_mut().console.scene.map.replace(2.0, layout(), cells).unwrap();
    window.run_steps(2);
}

fn click_at(window: &mut ViewWindow, x_m: f64, y_m: f64) -> Vec<RobotCommand> {
    let at = window.state().screen.area.on_screen(armor_grid::Point2::new(x_m, y_m));
    stroke(window, PointerButton::Primary, at, at);
    take_commands(window)
}

fn refusal(window: &ViewWindow) -> String {
    let node = window.get_by_label_contains("refused: ");
    node.accesskit_node().value().or(node.accesskit_node().label()).unwrap_or_default()
}

#[test]
fn a_goal_that_cannot_be_reached_is_refused_at_the_click_with_its_reason() {
    let mut window = window();
    set_cells(&mut window, |x_m, y_m| match () {
        () if x_m < -3.0 => -1,
        // A closed room around (3, -3).
        () if (x_m - 2.0).abs() < 0.1 || (x_m > 2.0 && (y_m + 2.0).abs() < 0.1) => 100,
        () => 0,
    });
    for (x_m, y_m, why) in [
        (-4.0, 0.0, "this place is unknown"),
        (2.0, 0.0, "there is an obstacle"),
        (3.0, -3.0, "obstacles enclose it"),
        (-6.0, 0.0, "off the map"),
    ] {
        assert_eq!(click_at(&mut window, x_m, y_m), [], "{why}");
        assert!(refusal(&window).contains(why), "{}", refusal(&window));
        let at = window.state().screen.area.on_screen(armor_grid::Point2::new(x_m, y_m));
        assert!(
            painted_texts(&window)
                .iter()
                .any(|(text, place)| { text.contains(why) && place.distance(at) < 400.0 }),
            "{why}: at the place of the click"
        );
    }
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    assert!(window.query_by_label_contains("refused: ").is_none(), "it was accepted");
    assert_eq!(events(&mut window), [OperatorEvent::Goal]);
}

/// The texts that are painted, and where.
fn painted_texts(window: &ViewWindow) -> Vec<(String, Pos2)> {
    fn walk(shape: &Shape, texts: &mut Vec<(String, Pos2)>) {
        match shape {
            Shape::Text(text) => texts.push((text.galley.text().to_owned(), text.pos)),
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| walk(shape, texts)),
            _ => {}
        }
    }
    let mut texts = Vec::new();
    window.output().shapes.iter().for_each(|shape| walk(&shape.shape, &mut texts));
    texts
}

pub(super) fn shows(window: &ViewWindow, text: &str) -> bool {
    painted_texts(window).iter().any(|(painted, _)| painted.contains(text))
}

#[test]
fn during_stop_and_before_a_map_a_goal_is_refused_with_the_reason() {
    let mut window = window();
    window.key_press(Key::Space);
    window.run_steps(2);
    take_commands(&mut window);
    assert_eq!(click_at(&mut window, 0.0, -2.0), []);
    assert!(refusal(&window).contains("STOP is active"));
    window.get_by_label("Release").click();
    window.run_steps(2);
    take_commands(&mut window);
    wait(&mut window, 7.0);
    assert!(!shows(&window, "STOP is active"), "it is shown for a while");
    let map = std::mem::take(&mut window.state_mut().console.scene.map);
    window.state_mut().console.scene.map = map.emptied();
    window.run_steps(1);
    assert!(shows(&window, "no map yet: waiting for robot.map"));
    // Screen readers read what is over the map, too.
    window.get_by_label("no map yet: waiting for robot.map");
    assert_eq!(click_at(&mut window, 0.0, -2.0), []);
    assert!(refusal(&window).contains("there is no map yet"));
}

#[test]
fn a_goal_without_a_path_for_a_second_is_reported_at_the_goal_and_in_the_panel() {
    let mut test_screen = test_screen();
    test_screen.console.links.push(InputLink::new("path", "planner.path".into(), false));
    let mut window = window_of(test_screen, SIZE);
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    wait(&mut window, 0.5);
    assert!(!shows(&window, "no path to the goal"));
    wait(&mut window, 1.0);
    window.get_by_label_contains("no path to the goal");
    let count =
        painted_texts(&window).iter().filter(|(text, _)| text.contains("no path to")).count();
    assert_eq!(count, 2, "at the goal and in the panel");
    let state = window.state_mut();
    let goal = Pose2::new(0.0, -2.0, 0.0);
    state.console.scene.set_path([Pose2::IDENTITY, goal].into_iter());
    state.console.record_arrival("path", state.now, 1.0, FIRST, Ok(()));
    window.run_steps(1);
    assert!(!shows(&window, "no path to the goal"));
    window.get_by_label_contains("1 alert");
}

#[test]
fn stopped_is_a_banner_over_the_map_and_release_is_far_from_stop() {
    let mut window = window();
    window.key_press(Key::Space);
    window.run_steps(2);
    let banner = window.get_by_label("STOP sent").rect();
    let map = window.state().screen.area.place();
    assert!(map.contains_rect(banner), "{banner:?}");
    let (stop, release) =
        (window.get_by_label("STOP").rect(), window.get_by_label("Release").rect());
    assert!(map.contains_rect(release) && !map.intersects(stop));
    assert!(release.distance_to_pos(stop.center()) > 150.0, "{stop:?} {release:?}");
    assert!(theme::contrast(theme::STOP, theme::RELEASE) > 1.0 && theme::STOP != theme::RELEASE);
}

fn goal_end() -> RunEnd {
    RunEnd { why: "the mission reached its goal".into(), is_normal: true }
}

#[test]
fn without_a_connection_stop_is_kept_and_the_screen_shows_that_the_robot_may_move() {
    let mut window = window();
    let now = window.state().now;
    let hint = "view is given up; `armor restart view` starts it again";
    window.state_mut().console.cut_connection("rover", hint, now);
    window.run_steps(2);
    let lost = "the connection to the robot's screen component is lost; the robot may be moving";
    for text in [lost, hint, "OLD"] {
        assert!(shows(&window, text), "{text}");
    }
    assert!(!shows(&window, "ended"), "that is not known");
    window.key_press(Key::Space);
    window.run_steps(1);
    // Nothing confirms it.
    window.state_mut().console.stop.begin_again(2.0);
    window.run_steps(1);
    assert!(shows(&window, "STOP not delivered: the robot may be moving"));
    assert!(window.query_by_label("Release").is_none());
    let state = window.state_mut();
    state.console.connection = SystemConnection::Live { system: "rover".into() };
    state.console.record_stop(true, 1, state.now);
    window.run_steps(2);
    assert!(shows(&window, "STOP sent") && !shows(&window, "STOP not delivered"));
    window.get_by_label("Release");
}

#[test]
fn the_robot_stands_only_when_its_data_show_it() {
    let mut shown = test_screen();
    shown.console.links.push(InputLink::new("odometry", "base.odometry".into(), true));
    let mut window = window_of(shown, SIZE);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(!shows(&window, "STOPPED"));
    let mut sequence = 0;
    let mut measure = |window: &mut ViewWindow, mps: f64| {
        sequence += 1;
        let state = window.state_mut();
        state.console.scene.velocity = Some((mps, 0.0));
        let number = SequenceNumber { instance: 1, sequence };
        state.console.record_arrival("odometry", state.now, 1.0, number, Ok(()));
        window.run_steps(2);
    };
    measure(&mut window, 0.25);
    assert!(shows(&window, "STOP sent") && shows(&window, "the robot still moves: 0.25 m/s"));
    measure(&mut window, 0.0);
    assert!(shows(&window, "STOPPED") && shows(&window, "the robot stands"));
    wait(&mut window, 9.0);
    assert!(shows(&window, "STOP sent") && shows(&window, "the data are old"));
}

#[test]
fn an_ended_run_has_no_time_that_passes() {
    use crate::mission::MissionState;

    let mut shown = test_screen();
    shown.console.links.push(InputLink::new("path", "planner.path".into(), false));
    let is_running = true;
    shown.console.mission = Some(MissionState { is_running, ..MissionState::default() });
    let mut window = window_of(shown, SIZE);
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    wait(&mut window, 4.0);
    let now = window.state().now;
    window.state_mut().console.end_system("rover", goal_end(), now);
    let alerts = window.state().console.alerts.count_new();
    wait(&mut window, 50.0);
    assert!(shows(&window, "no path to the goal for 4 s") && shows(&window, " 0:05"));
    let boxes = painted_texts(&window).iter().filter(|(text, _)| text.contains("no path")).count();
    assert_eq!(boxes, 1, "only in the panel, and not over the map");
    assert_eq!(window.state().console.alerts.count_new(), alerts, "the end is normal");
}

#[test]
fn a_press_and_a_release_within_a_frame_are_a_click() {
    let mut window = window();
    window.hover_at(MIDDLE);
    window.run_steps(1);
    for pressed in [true, false] {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        window.event(Input::PointerButton { pos: MIDDLE, button, pressed, modifiers });
    }
    window.run_steps(2);
    assert_eq!(take_commands(&mut window).len(), 1);
}

#[test]
fn a_new_question_moves_no_button_and_takes_no_click_that_was_begun_before() {
    use crate::mission::{MissionQuestion, MissionState};

    let mut shown = test_screen();
    shown.console.mission = Some(MissionState::default());
    let mut window = window_of(shown, SIZE);
    let places = |window: &ViewWindow| {
        ["light", "alerts", "STOP"].map(|name| window.get_by_label(name).rect())
    };
    let before = places(&window);
    let question = MissionQuestion {
        transition: "turn-back".into(),
        answer_by_at_s: None,
        unanswered: "decline".into(),
    };
    if let Some(mission) = &mut window.state_mut().console.mission {
        mission.questions.push(question);
    }
    window.run_steps(2);
    assert_eq!(places(&window), before);
    window.get_by_label("Confirm").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [], "it was meant for something else");
    wait(&mut window, 0.6);
    window.get_by_label("Confirm").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window).len(), 1);
}

#[test]
fn the_banner_of_stop_shows_with_what_release_continues() {
    let mut shown = test_screen();
    shown.console.buttons = vec!["explore".into()];
    let mut window = window_of(shown, SIZE);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(!shows(&window, "the robot continues"));
    window.get_by_label("explore").click();
    window.run_steps(2);
    assert!(shows(&window, "Release: the robot continues with explore"));
    window.get_by_label("Release").click();
    window.run_steps(2);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert!(!shows(&window, "the robot continues"), "that was the STOP before");
}

#[test]
fn a_reached_goal_is_shown_and_a_cancelled_one_is_not() {
    let mut window = window();
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!shows(&window, "goal reached"));
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    let alerts = window.state().console.alerts.count_new();
    let state = window.state_mut();
    let pose = Pose2::new(0.0, -2.0, 0.0);
    let located = LocatedPose { stamp_s: 2.0, pose, covariance_m2: [0.0; 3] };
    state.console.scene.set_located(located).unwrap();
    state.console.record_arrival("pose", state.now, 2.0, FIRST, Ok(()));
    window.run_steps(2);
    assert!(shows(&window, "goal reached"));
    assert_eq!(window.state().console.alerts.count_new(), alerts);
    wait(&mut window, 7.0);
    assert!(!shows(&window, "goal reached"));
}

#[test]
fn a_pause_is_shown_with_what_still_moves() {
    use crate::mission::MissionState;

    let mut shown = test_screen();
    shown.console.mission = Some(MissionState {
        paused_by: "ruth".into(),
        frozen: vec!["explorer".into(), "homing".into()],
        ..MissionState::default()
    });
    let mut window = window_of(shown, SIZE);
    assert!(shows(&window, "PAUSED"));
    assert!(shows(&window, "by ruth: the mission waits (explorer, homing stand still)."));
    assert!(shows(&window, "You can still move the robot: set a goal, or drive by hand."));
    window.get_by_label("Resume").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [], "it has only just appeared");
    wait(&mut window, 0.6);
    window.get_by_label("Resume").click();
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [RobotCommand::Resume]);
}

#[test]
fn a_question_lies_over_the_map_and_not_over_the_camera_image() {
    use crate::mission::{MissionQuestion, MissionState};

    let question = MissionQuestion {
        transition: "turn-back".into(),
        answer_by_at_s: None,
        unanswered: "decline".into(),
    };
    let mut shown = test_screen();
    shown.console.mission = Some(MissionState {
        questions: vec![question],
        paused_by: "ruth".into(),
        ..MissionState::default()
    });
    let mut window = window_of(shown, SIZE);
    window.run_steps(2);
    let image = window.get_by_role(Role::Image).rect();
    for label in ["The mission asks:", "turn-back?", "Confirm", "Decline", "Resume", "PAUSED"] {
        let rect = window.get_by_label(label).rect();
        assert!(!rect.intersects(image), "{label} at {rect:?} covers the image at {image:?}");
    }
    let text = window.get_by_label("turn-back?").rect();
    assert!(text.height() > 25.0, "it can be read from some distance: {text:?}");
}

#[test]
fn a_system_that_has_ended_stays_on_the_screen_as_old_and_takes_no_orders() {
    let mut window = window();
    window.key_down(Key::W);
    window.run_steps(1);
    take_commands(&mut window);
    let now = window.state().now;
    window.state_mut().console.end_system("rover", goal_end(), now);
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), [], "what is held is let go");
    window.key_up(Key::W);
    window.state_mut().console.orders.handle_order(OperatorOrder::Stop, 1.0);
    wait(&mut window, 65.0);
    assert!(!shows(&window, "STOPPED"), "whether the robot stands is not known");
    window.state_mut().console.orders.handle_order(OperatorOrder::Release, 1.0);
    for text in ["rover has ended", "the mission reached its goal.", "are 1 min old", "OLD"] {
        assert!(shows(&window, text), "{text}");
    }
    assert!(!window.state().console.scene.map.is_empty(), "the last map stays");
    assert!(!shows(&window, "nothing for"), "one reason is enough");
    window.run_steps(3);
    let delay = window.output().viewport_output.values().map(|out| out.repaint_delay).min();
    assert!(delay > Some(std::time::Duration::from_secs(50)), "a frame a minute: {delay:?}");
    assert_eq!(click_at(&mut window, 0.0, -2.0), []);
    assert!(refusal(&window).contains("rover has ended"));
    window.key_press(Key::Space);
    window.run_steps(2);
    assert_eq!(take_commands(&mut window), []);
    assert!(!window.state().console.orders.is_stopped());
}

#[test]
fn before_a_system_the_screen_shows_what_it_waits_for() {
    let mut test_screen = test_screen();
    let what = "armor run rover.xml".to_owned();
    test_screen.console =
        Console { connection: SystemConnection::Awaited { what }, ..Console::default() };
    let window = window_of(test_screen, SIZE);
    assert!(shows(&window, "waiting for\narmor run rover.xml"));
    assert!(shows(&window, "waiting for a system"));
}

#[test]
fn the_heading_is_shown_while_it_is_drawn() {
    let mut window = window();
    window.hover_at(MIDDLE);
    button(&mut window, MIDDLE, PointerButton::Primary, true);
    window.hover_at(MIDDLE - Vec2::new(0.0, 60.0));
    window.run_steps(2);
    assert!(shows(&window, "heading 90°"));
    button(&mut window, MIDDLE - Vec2::new(0.0, 60.0), PointerButton::Primary, false);
    window.run_steps(1);
    assert!(!shows(&window, "heading"));
}

#[test]
fn the_strip_shows_robot_mission_questions_and_battery() {
    use crate::mission::{MissionQuestion, MissionState};
    use crate::readings::BatteryReading;

    let mut test_screen = test_screen();
    let question = MissionQuestion {
        transition: "turn-back".into(),
        answer_by_at_s: Some(80.0),
        unanswered: "decline".into(),
    };
    test_screen.console.robot_name = "rover".into();
    test_screen.console.mission = Some(MissionState {
        name: "survey".into(),
        stage: "playing".into(),
        now_at_s: 61.0,
        is_running: true,
        places: vec!["explore".into(), "watch".into()],
        questions: vec![question],
        received_s: 1.0,
        ..MissionState::default()
    });
    let charge = Some(0.15);
    let battery = BatteryReading { charge, volts: None, is_charging: false };
    test_screen.console.readings.store(battery);
    let mut window = window_of(test_screen, SIZE);
    wait(&mut window, 4.0);
    for text in ["rover", "connected", "explore, watch", "survey 1:05"] {
        window.get_by_label_contains(text);
    }
    window.get_by_label_contains("turn-back? (decline in 15 s)");
    window.get_by_role_and_label(Role::ProgressIndicator, "battery 15 %");
    window.get_by_label("Decline").click();
    window.run_steps(2);
    let transition = "turn-back".to_owned();
    let answer = RobotCommand::Answer { transition, is_confirmed: false };
    assert_eq!(take_commands(&mut window), [answer]);
}

#[test]
fn alerts_are_listed_with_their_time_until_they_are_acknowledged_and_escape_closes_the_list() {
    let mut window = window();
    wait(&mut window, 10.0);
    let place = window.get_by_label("STOP").rect();
    window.get_by_label_contains("2 alerts").click();
    window.run_steps(2);
    assert_eq!(window.get_by_label("STOP").rect(), place, "it has one place");
    wait(&mut window, 5.0);
    assert!(shows(&window, "no data at scan") && shows(&window, "0:05 ago"));
    window.get_by_label("Acknowledge all").click();
    window.run_steps(2);
    assert_eq!(window.state().console.alerts.count_new(), 0);
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(!shows(&window, "no data at scan"), "closed");
    assert!(window.state().console.orders.goal().is_some(), "it was meant for the list");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert!(window.state().console.orders.goal().is_none());
}

#[test]
fn the_image_is_moved_by_dragging_and_large_after_a_click() {
    let mut window = window();
    let before = window.get_by_label("no image yet").rect();
    let by = Vec2::new(-150.0, 120.0);
    stroke(&mut window, PointerButton::Primary, before.center(), before.center() + by);
    let moved = window.get_by_label("no image yet").rect();
    assert!(moved.center().distance(before.center() + by) < 20.0, "{before:?} {moved:?}");
    stroke(&mut window, PointerButton::Primary, moved.center(), moved.center());
    window.run_steps(2);
    let large = window.get_by_label("no image yet").rect();
    assert!(large.width() > 1.8 * moved.width(), "{moved:?} {large:?}");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(window.get_by_label("no image yet").rect(), moved);
    assert_eq!(take_commands(&mut window), []);
}

#[test]
fn the_theme_changes_by_a_button() {
    let mut window = window();
    window.get_by_label("light").click();
    window.run_steps(3);
    assert!(!window.ctx.global_style().visuals.dark_mode);
    window.get_by_label("dark").click();
    window.run_steps(3);
    assert!(window.ctx.global_style().visuals.dark_mode);
}

#[test]
fn what_can_be_operated_has_a_name_for_screen_readers() {
    let mut test_screen = test_screen();
    test_screen.console.buttons = vec!["explore".into()];
    let mut window = window_of(test_screen, Vec2::new(1000.0, 1400.0));
    window.get_by_label("area of the map");
    window.get_by_label("keys and pointer").click();
    window.run_steps(2);
    window.get_by_label_contains("Space: STOP");
    for role in [Role::Button, Role::CheckBox] {
        for node in window.query_all_by_role(role) {
            let name = node.accesskit_node().label().unwrap_or_default();
            assert!(name.chars().any(char::is_alphabetic), "`{name}` at {:?}", node.rect());
        }
    }
}

#[test]
fn what_is_touched_is_large_enough_and_no_text_is_small() {
    let mut test_screen = test_screen();
    test_screen.console.buttons = vec!["explore".into(), "home".into()];
    test_screen.console.frame_seen("map");
    let mut window = window_of(test_screen, Vec2::new(1000.0, 1400.0));
    assert_eq!(click_at(&mut window, 0.0, -2.0).len(), 1);
    window.key_press(Key::Space);
    window.get_by_label("alerts").click();
    window.run_steps(3);
    for role in [Role::Button, Role::CheckBox] {
        for node in window.query_all_by_role(role) {
            let (rect, name) = (node.rect(), node.accesskit_node().label().unwrap_or_default());
            let least = theme::TOUCH - 0.01;
            assert!(rect.height() >= least && rect.width() >= least, "{name}: {rect:?}");
        }
    }
    fn check(shape: &Shape) {
        match shape {
            Shape::Text(text) => {
                for section in &text.galley.job.sections {
                    let size = section.format.font_id.size;
                    assert!(size >= 11.0, "{size}: {}", text.galley.text());
                }
            }
            Shape::Vec(shapes) => shapes.iter().for_each(check),
            _ => {}
        }
    }
    window.output().shapes.iter().for_each(|shape| check(&shape.shape));
}
