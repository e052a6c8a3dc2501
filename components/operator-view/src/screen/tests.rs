//! The screen as a person meets it: by accessible names, keys and the pointer, without a display.

mod display;
mod driving;
mod goals;
mod mission;
mod scale;
mod stop;
mod system;

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

/// Sets every cell of a map of 10 × 10 m by its place.
pub(super) fn set_cells(window: &mut ViewWindow, cell: impl Fn(f64, f64) -> i8) {
    let place = |index: usize| (index as f64 + 0.5) * 0.1 - 5.0;
    let cells = (0..10_000).map(|n| cell(place(n % 100), place(n / 100))).collect();
    window.state_mut().console.scene.map.replace(2.0, layout(), cells).unwrap();
    window.run_steps(2);
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

fn goal_end() -> RunEnd {
    RunEnd { why: "the mission reached its goal".into(), is_normal: true }
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
