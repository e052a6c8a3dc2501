//! Random gestures and keys against a model of the operator's orders: no command is sent that the
//! hands did not give, none is lost, and the screen shows STOP, goal and driving as the model has them.

use std::collections::BTreeSet;

use armor_grid::{Point2, Pose2};
use eframe::egui::{
    Event as Input, Key, MouseWheelSource, MouseWheelUnit, PointerButton, Pos2, TouchPhase, Vec2,
    vec2,
};
use egui_kittest::kittest::Queryable;

use super::tests::{
    ViewWindow, button, set_cells, stroke, take_commands, test_screen, wait, window_of,
};
use super::*;
use crate::connection::SystemConnection;
use crate::scene::LocatedPose;

/// High enough that no panel has to be scrolled.
const SIZE: Vec2 = Vec2::new(1000.0, 1200.0);
/// Actions of one sequence.
const ACTIONS: usize = 60;

const KEYS: [(Key, f64, f64); 5] = [
    (Key::W, 1.0, 0.0),
    (Key::S, -1.0, 0.0),
    (Key::ArrowLeft, 0.0, 1.0),
    (Key::D, 0.0, -1.0),
    (Key::ArrowUp, 1.0, 0.0),
];

/// What the operator has ordered, as the sequence of gestures defines it.
#[derive(Debug)]
struct Model {
    is_stopped: bool,
    goal: Option<(Point2, Option<f64>)>,
    is_frame_new: bool,
    is_cut: bool,
    has_focus: bool,
    held: BTreeSet<usize>,
    /// The parts that are open, the last opened last.
    open: Vec<&'static str>,
    epoch: u32,
}

/// What the commands of one action have to be.
#[derive(Debug, Default)]
struct Expected {
    stops: Vec<bool>,
    goals: usize,
    /// Whether the stick drove in between.
    has_driven: bool,
}

impl Model {
    /// The direction of the held keys, if they drive the robot.
    fn direction(&self) -> Option<(f64, f64)> {
        if self.is_stopped || self.is_cut || !self.has_focus || self.held.is_empty() {
            return None;
        }
        let sum = |of: fn(&(Key, f64, f64)) -> f64| {
            self.held.iter().map(|n| of(&KEYS[*n])).sum::<f64>().clamp(-1.0, 1.0)
        };
        Some((sum(|key| key.1), sum(|key| key.2)))
    }

    fn order_stop(&mut self, expected: &mut Expected) {
        (self.is_stopped, self.goal) = (true, None);
        expected.stops.push(true);
    }

    fn accepts_goals(&self) -> bool {
        !self.is_stopped && !self.is_frame_new && !self.is_cut
    }

    /// Escape closes what was opened last, or deletes the goal.
    fn escape(&mut self) {
        if self.open.pop().is_none() {
            self.goal = None;
        }
    }

    fn toggle(&mut self, part: &'static str) {
        let count = self.open.len();
        self.open.retain(|open| *open != part);
        if self.open.len() == count {
            self.open.push(part);
        }
    }
}

/// A wall with free cells behind it at the left, and unknown cells at the right.
fn cell(x_m: f64, _: f64) -> i8 {
    match () {
        () if (x_m + 3.0).abs() < 0.1 => 100,
        () if x_m > 3.0 => -1,
        () => 0,
    }
}

/// A point of the map, and whether the robot can be sent there.
fn choose_point(random: &mut fastrand::Rng) -> (Point2, bool) {
    let y_m = 9.0 * random.f64() - 4.5;
    match random.u8(..6) {
        0 => (Point2::new(-4.5 + random.f64(), y_m), false),
        1 => (Point2::new(3.5 + random.f64(), y_m), false),
        _ => (Point2::new(-2.5 + 5.0 * random.f64(), y_m), true),
    }
}

/// The point on the screen, if it is on the map and nothing lies over it.
fn find_on_screen(window: &ViewWindow, point: Point2) -> Option<Pos2> {
    let area = &window.state().screen.area;
    let at = area.on_screen(point);
    let image = window.query_by_label("no image yet");
    let is_image = image.is_some_and(|image| image.rect().expand(4.0).contains(at));
    let is_free = area.place().shrink(40.0).contains(at) && !area.is_covered(at) && !is_image;
    is_free.then_some(at)
}

/// Clicks a button by the beginning of its name; returns whether it is shown.
fn click_button(window: &mut ViewWindow, name: &str) -> bool {
    let Some(found) = window.query_by_label(name) else { return false };
    let at = found.rect().center();
    stroke(window, PointerButton::Primary, at, at);
    true
}

/// The alerts' button has the number of those that are new.
fn click_alerts(window: &mut ViewWindow) {
    let count = window.state().console.alerts.count_new();
    let name = match count {
        0 => "alerts".to_owned(),
        1 => "1 alert".to_owned(),
        count => format!("{count} alerts"),
    };
    assert!(click_button(window, &name), "{name}");
}

fn locate_robot(window: &mut ViewWindow, model: &mut Model, at: Point2) {
    // The goal of a click is exact to a point of the screen: at this distance either is right.
    if model.goal.is_some_and(|(goal, _)| (goal.distance_m(at) - 0.3).abs() < 0.1) {
        return;
    }
    let state = window.state_mut();
    state.now.host_s += 0.1;
    let pose = Pose2::new(at.x_m, at.y_m, 0.0);
    let stamp_s = state.now.host_s;
    let located = LocatedPose { stamp_s, pose, covariance_m2: [0.01, 0.0, 0.01] };
    state.console.scene.set_located(located).unwrap();
    let number = crate::links::SequenceNumber { instance: 1, sequence: (stamp_s * 1e3) as u64 };
    state.console.record_arrival("pose", state.now, stamp_s, number, Ok(()));
    let is_there = |(goal, yaw_rad): (Point2, Option<f64>)| {
        goal.distance_m(at) <= 0.3 && yaw_rad.is_none_or(|yaw_rad| yaw_rad.abs() <= 0.26)
    };
    if model.goal.is_some_and(is_there) {
        model.goal = None;
    }
    window.run_steps(1);
}

fn act(window: &mut ViewWindow, model: &mut Model, random: &mut fastrand::Rng) -> Expected {
    let mut expected = Expected::default();
    match random.u8(..26) {
        0 => {
            window.key_press(Key::Space);
            window.run_steps(1);
            model.order_stop(&mut expected);
        }
        1 => {
            assert!(click_button(window, "STOP"));
            model.order_stop(&mut expected);
        }
        2 | 3 => {
            let is_shown = click_button(window, "Release");
            assert_eq!(is_shown, model.is_stopped && !model.is_cut, "Release");
            if is_shown {
                model.is_stopped = false;
                expected.stops.push(false);
            }
        }
        4..=7 => {
            let n = random.usize(..KEYS.len());
            if model.has_focus && model.held.insert(n) {
                window.key_down(KEYS[n].0);
            } else if model.held.remove(&n) {
                window.key_up(KEYS[n].0);
            }
            window.run_steps(1);
        }
        8..=12 => {
            let (point, is_reachable) = choose_point(random);
            let Some(at) = find_on_screen(window, point) else { return expected };
            let end = at + vec2(0.0, -60.0);
            let has_heading = random.bool() && !window.state().screen.area.is_covered(end);
            stroke(window, PointerButton::Primary, at, if has_heading { end } else { at });
            if model.accepts_goals() && is_reachable {
                let yaw_rad = has_heading.then_some(std::f64::consts::FRAC_PI_2);
                model.goal = Some((point, yaw_rad));
                expected.goals = 1;
            } else {
                let console = &window.state().console;
                let refusal = console.recent_refusal(window.state().now);
                assert!(refusal.is_some(), "no reason is shown at {point:?}: {model:?}");
            }
        }
        13 => {
            let Some(at) = find_on_screen(window, choose_point(random).0) else { return expected };
            stroke(window, PointerButton::Secondary, at, at);
            model.goal = None;
        }
        14 => {
            window.key_press(Key::Escape);
            window.run_steps(1);
            model.escape();
        }
        15 => {
            click_alerts(window);
            model.toggle("alerts");
        }
        16 => {
            assert!(click_button(window, "keys and pointer"));
            model.toggle("help");
        }
        17 => {
            model.epoch += 1;
            (model.goal, model.is_frame_new) = (None, true);
            let frame = format!("map#{:04x}", model.epoch);
            window.state_mut().console.frame_seen(&frame);
            set_cells(window, cell);
            locate_robot(window, model, Point2::new(1.0, 0.0));
        }
        18 | 19 => {
            let is_shown = click_button(window, "Acknowledge");
            assert_eq!(is_shown, model.is_frame_new, "Acknowledge");
            model.is_frame_new = false;
        }
        20 => {
            if click_button(window, "home") && !model.is_cut {
                model.goal = None;
            }
        }
        21 => {
            model.has_focus = !model.has_focus;
            // A release would not be reported while another window has the keyboard.
            model.held.clear();
            window.input_mut().focused = model.has_focus;
            window.event(Input::WindowFocused(model.has_focus));
            window.run_steps(2);
        }
        22 => {
            let Some(at) = find_on_screen(window, choose_point(random).0) else { return expected };
            if random.bool() {
                window.hover_at(at);
                window.event(Input::MouseWheel {
                    unit: MouseWheelUnit::Point,
                    source: MouseWheelSource::Wheel,
                    delta: vec2(0.0, if random.bool() { 40.0 } else { -40.0 }),
                    phase: TouchPhase::Move,
                    modifiers: Default::default(),
                });
                window.run_steps(4);
            } else {
                let by = vec2(80.0 * random.f32() - 40.0, 80.0 * random.f32() - 40.0);
                stroke(window, PointerButton::Middle, at, at + by);
            }
        }
        23 => {
            let pad = window.get_by_label("stick").rect();
            window.hover_at(pad.center());
            window.run_steps(1);
            button(window, pad.center(), PointerButton::Primary, true);
            window.hover_at(pad.center() - vec2(30.0, 40.0));
            window.run_steps(2);
            let drives = !model.is_stopped && !model.is_cut && model.has_focus;
            assert_eq!(window.state().console.orders.is_driving(), drives, "by the stick");
            button(window, pad.center(), PointerButton::Primary, false);
            window.run_steps(1);
            expected.has_driven = drives;
        }
        24 => {
            let now = window.state().now;
            let console = &mut window.state_mut().console;
            model.is_cut = !model.is_cut;
            if model.is_cut {
                console.cut_connection("rover", "view is gone", now);
            } else {
                console.connection = SystemConnection::Live { system: "rover".into() };
            }
            window.run_steps(1);
        }
        _ => {
            let at = choose_point(random);
            locate_robot(window, model, if at.1 { at.0 } else { Point2::new(0.0, 0.0) });
            wait(window, 0.1 + random.f64());
        }
    }
    expected
}

/// The commands of one action are those that the model expects.
fn check_commands(
    commands: &[RobotCommand],
    expected: &Expected,
    before: Option<(f64, f64)>,
    after: Option<(f64, f64)>,
    context: &str,
) {
    let stops = commands.iter().filter_map(|command| match command {
        RobotCommand::Stop(is_on) => Some(*is_on),
        _ => None,
    });
    assert_eq!(stops.collect::<Vec<_>>(), expected.stops, "{context}: {commands:?}");
    let goals = commands.iter().filter(|command| matches!(command, RobotCommand::Goal { .. }));
    assert_eq!(goals.count(), expected.goals, "{context}: {commands:?}");
    let answers = commands.iter().filter(|it| matches!(it, RobotCommand::Answer { .. }));
    assert_eq!(answers.count(), 0, "{context}: {commands:?}");
    let velocities: Vec<_> = commands
        .iter()
        .filter_map(|command| match command {
            RobotCommand::Velocity { forward_mps, turn_radps } => Some((*forward_mps, *turn_radps)),
            _ => None,
        })
        .collect();
    let given = |direction: Option<(f64, f64)>| {
        direction.map(|(forward, turn)| (0.5 * forward, 1.0 * turn))
    };
    for velocity in &velocities {
        let is_given = expected.has_driven
            || *velocity == (0.0, 0.0)
            || [given(before), given(after)].contains(&Some(*velocity));
        assert!(is_given, "{context}: {velocity:?} of {before:?}, {after:?}");
    }
    if after.is_none() && (before.is_some() || expected.has_driven) {
        assert_eq!(velocities.last(), Some(&(0.0, 0.0)), "{context}: the robot is let go");
    }
    if after.is_none() && before.is_none() && !expected.has_driven {
        assert_eq!(velocities, [], "{context}: no hand drives");
    }
    if after.is_some() && after != before {
        assert_eq!(velocities.last(), given(after).as_ref(), "{context}");
    }
}

fn check_screen(window: &ViewWindow, model: &Model, context: &str) {
    let state = window.state();
    let orders = &state.console.orders;
    assert_eq!(orders.is_stopped(), model.is_stopped, "{context}: STOP");
    assert_eq!(orders.is_frame_new(), model.is_frame_new, "{context}: frame");
    assert_eq!(orders.is_driving(), model.direction().is_some(), "{context}: driving");
    let is_shown = window.query_by_label("Release").is_some();
    assert_eq!(is_shown, model.is_stopped && !model.is_cut, "{context}: Release");
    let goal = orders.goal().map(|goal| goal.place);
    assert_eq!(goal.is_some(), model.goal.is_some(), "{context}: {goal:?}");
    if let (Some(goal), Some((point, yaw_rad))) = (goal, model.goal) {
        let away = goal.point().distance_m(point) * f64::from(state.screen.area.points_per_metre());
        assert!(away < 2.0, "{context}: the goal is {away} points from the click");
        let off_rad = yaw_rad.map_or(0.0, |yaw_rad| (goal.yaw_rad - yaw_rad).abs());
        assert!(off_rad < 0.1, "{context}: {goal:?}");
    }
    for (part, name) in [(OpenPart::Alerts, "alerts"), (OpenPart::Help, "help")] {
        let is_open = open_parts::is_open(&window.ctx, part);
        assert_eq!(is_open, model.open.contains(&name), "{context}: {name}");
    }
}

/// Prints the seed of a sequence that fails.
struct SeedOfFailure(u64);

impl Drop for SeedOfFailure {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("ARMOR_SEED={} ARMOR_SEQUENCES=1 repeats it", self.0);
        }
    }
}

/// `ARMOR_SEQUENCES` is the number of sequences, `ARMOR_SEED` the seed of the first.
#[test]
fn random_gestures_send_what_the_hands_order_and_nothing_else() {
    let number = |name: &str, default| {
        std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
    };
    let (sequences, first): (u64, u64) = (number("ARMOR_SEQUENCES", 12), number("ARMOR_SEED", 1));
    for seed in first..first + sequences {
        let _seed = SeedOfFailure(seed);
        let mut random = fastrand::Rng::with_seed(seed);
        let mut shown = test_screen();
        shown.console.buttons = vec!["explore".into(), "home".into()];
        shown.console.frame_seen("map");
        let mut window = window_of(shown, SIZE);
        set_cells(&mut window, cell);
        let mut model = Model {
            is_stopped: false,
            goal: None,
            is_frame_new: false,
            is_cut: false,
            has_focus: true,
            held: BTreeSet::new(),
            open: Vec::new(),
            epoch: 0,
        };
        for action in 0..ACTIONS {
            let before = model.direction();
            let was_cut = model.is_cut;
            let expected = act(&mut window, &mut model, &mut random);
            let context = format!("action {action}: {model:?}");
            let after = model.direction();
            let commands = take_commands(&mut window);
            // Where the connection is lost, nothing can be sent any more.
            let before = before.filter(|_| was_cut || !model.is_cut);
            check_commands(&commands, &expected, before, after, &context);
            check_screen(&window, &model, &context);
        }
    }
}
