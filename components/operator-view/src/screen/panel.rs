//! Beside the map: STOP, the mission's buttons, how the robot is, a stick to drive with, each link.

use eframe::egui::{
    Button, Color32, Grid, Pos2, Rect, RichText, ScrollArea, Sense, Stroke, Ui, Vec2, vec2,
};

use super::colours;
use crate::console::Console;
use crate::links::{Freshness, Link, Now};
use crate::orders::Order;

/// Height of STOP, in points: to be hit in a hurry.
const STOP: f32 = 62.0;
/// Side of the pad, in points.
const PAD: f32 = 108.0;
/// Letting go of the pad within this share of its radius of the middle is no movement.
const DEAD: f64 = 0.08;

/// What the panel keeps between frames.
#[derive(Default)]
pub(super) struct SidePanel {
    held: Option<(f64, f64)>,
}

impl SidePanel {
    /// Where the pad is held to, as shares of the limits.
    pub(super) fn held(&self) -> Option<(f64, f64)> {
        self.held
    }

    /// Shows it. STOP stays in sight, whatever else there is to read.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        now: Now,
        orders: &mut Vec<Order>,
    ) {
        ui.add_space(6.0);
        stop(ui, console, orders);
        ui.separator();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            buttons(ui, console, now, orders);
            robot(ui, console, orders);
            ui.separator();
            self.pad(ui, console);
            ui.separator();
            links(ui, console, now);
        });
    }

    /// A stick: how far it is drawn from the middle says how fast.
    fn pad(&mut self, ui: &mut Ui, console: &Console) {
        ui.horizontal(|ui| {
            let (rect, response) = ui.allocate_exact_size(Vec2::splat(PAD), Sense::drag());
            let response = response.accessible_name("stick");
            let radius = PAD / 2.0 - 8.0;
            let pointer = response.interact_pointer_pos().filter(|_| response.dragged());
            let has_focus = ui.input(|input| input.focused);
            self.held = pointer.filter(|_| has_focus).and_then(|at| share(rect, at, radius));
            let painter = ui.painter();
            let stroke = Stroke::new(1.5, colours::WEAK);
            painter.circle(rect.center(), radius, colours::CANVAS, stroke);
            let (forward, turn) = self.held.unwrap_or_default();
            let knob = rect.center() - vec2(turn as f32, forward as f32) * radius;
            let colour = if self.held.is_some() { colours::LATE } else { colours::WEAK };
            painter.circle_filled(knob, 13.0, colour);
            ui.vertical(|ui| {
                let (orders, limits) = (&console.orders, console.orders.limits);
                match (orders.is_stopped(), orders.is_driving()) {
                    (true, _) => ui.colored_label(colours::LATE, "stopped"),
                    (_, true) => ui.colored_label(colours::LATE, "driving"),
                    _ => ui.label("drive by hand"),
                };
                ui.small(format!("up to {:.2} m/s", limits.speed_mps));
                ui.small(format!("{:.0}°/s", limits.turn_radps.to_degrees()));
                ui.small("W A S D, arrows");
                ui.small("or the stick");
            });
        });
    }
}

/// How far from the middle the pointer is, as shares: ahead, to the left.
fn share(pad: Rect, at: Pos2, radius: f32) -> Option<(f64, f64)> {
    let away = (pad.center() - at) / radius;
    let length = away.length().max(1.0);
    let part = |of: f32| {
        let share = f64::from(of / length);
        if share.abs() < DEAD { 0.0 } else { share }
    };
    let is_finite = away.x.is_finite() && away.y.is_finite();
    is_finite.then(|| (part(away.y), part(away.x)))
}

fn stop(ui: &mut Ui, console: &Console, orders: &mut Vec<Order>) {
    let is_stopped = console.orders.is_stopped();
    let text = RichText::new("STOP").size(30.0).strong().color(Color32::WHITE);
    let stroke = Stroke::new(if is_stopped { 3.0 } else { 0.0 }, colours::LATE);
    let button = Button::new(text).fill(colours::STOP).stroke(stroke);
    let width = ui.available_width();
    let response = ui.add_sized(vec2(width, STOP), button);
    if response.on_hover_text("the robot stands until it is released (Space)").clicked() {
        orders.push(Order::Stop);
    }
    // Its own place, so that a second click at STOP never releases.
    ui.horizontal(|ui| {
        if is_stopped {
            ui.colored_label(colours::LATE, RichText::new("STOPPED").strong());
            if ui.button("Release").on_hover_text("the robot may drive again").clicked() {
                orders.push(Order::Release);
            }
        } else {
            ui.weak("Space stops, too");
        }
    });
    if let Some(unheard) = console.unheard() {
        ui.colored_label(colours::GONE, unheard);
    }
}

/// The mission's own orders.
fn buttons(ui: &mut Ui, console: &Console, now: Now, orders: &mut Vec<Order>) {
    if console.buttons.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        for name in &console.buttons {
            if ui.button(name).on_hover_text("tells the mission").clicked() {
                orders.push(Order::Press(name.clone()));
            }
        }
    });
    if let Some((name, at_s)) = console.orders.pressed() {
        let ago_s = (now.host_s - at_s).max(0.0);
        ui.weak(format!("{name}: told {}", ago(ago_s)));
    }
    ui.separator();
}

fn robot(ui: &mut Ui, console: &Console, orders: &mut Vec<Order>) {
    let scene = &console.scene;
    Grid::new("robot").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        };
        if console.is_linked("odometry") {
            row("speed", scene.velocity.map_or("-".into(), |(mps, _)| format!("{mps:.2} m/s")));
            let turn = |(_, radps): (f64, f64)| format!("{:.0}°/s", radps.to_degrees());
            row("turn", scene.velocity.map_or("-".into(), turn));
        }
        if let Some(robot) = scene.robot() {
            row("place", format!("{:.2}, {:.2} m", robot.x_m, robot.y_m));
            row("heading", format!("{:.0}°", robot.yaw_rad.to_degrees()));
        } else if scene.is_localised {
            row("place", "not known".into());
        }
        if let Some((off_m, off_rad)) = scene.drift() {
            row("odometry off", format!("{off_m:.2} m, {:.0}°", off_rad.to_degrees()));
        }
        if console.is_linked("battery") {
            row("battery", battery(console));
        }
        if let Some(mapping) = &scene.mapping {
            let (effective, all) = (mapping.effective, mapping.particles);
            row("particles", format!("{effective:.1} of {all} effective"));
            row("scans match", format!("{:.0} %", 100.0 * mapping.score));
            row("loops closed", mapping.closures.to_string());
            row("a scan takes", format!("{:.1} ms", 1e3 * mapping.update_s));
            if mapping.dropped > 0 {
                row("scans dropped", mapping.dropped.to_string());
            }
        }
    });
    if let Some(goal) = console.orders.goal() {
        ui.horizontal(|ui| {
            let place = goal.place;
            let far = scene.robot().map(|robot| robot.point().distance_m(place.point()));
            let far = far.map_or(String::new(), |far_m| format!(", {far_m:.1} m away"));
            ui.label(format!("goal {:.2}, {:.2}{far}", place.x_m, place.y_m));
            if ui.small_button("cancel").clicked() {
                orders.push(Order::Cancel);
            }
        });
    }
}

fn battery(console: &Console) -> String {
    let Some(battery) = &console.scene.battery else { return "-".into() };
    let charge = battery.charge.map(|charge| format!("{:.0} %", 100.0 * charge));
    let volts = battery.volts.map(|volts| format!("{volts:.1} V"));
    let charging = battery.is_charging.then(|| "charging".to_owned());
    let parts: Vec<_> = [charge, volts, charging].into_iter().flatten().collect();
    if parts.is_empty() { "not measured".into() } else { parts.join(", ") }
}

/// Each input: how often it comes, what was lost, how old the newest is.
fn links(ui: &mut Ui, console: &Console, now: Now) {
    if console.links.is_empty() {
        ui.weak("no input is linked");
        return;
    }
    Grid::new("links").num_columns(4).spacing(vec2(10.0, 2.0)).striped(true).show(ui, |ui| {
        for title in ["input", "rate", "lost", "age"] {
            ui.weak(title);
        }
        ui.end_row();
        for link in &console.links {
            ui.label(link.input).on_hover_text(&link.data);
            ui.label(rate(link.rate_hz(now)));
            let lost = if link.lost > 0 { colours::LATE } else { colours::TEXT };
            ui.colored_label(lost, link.lost.to_string());
            let age = ui.colored_label(colour(link, now), age(link.age_s(now)));
            if let Some(problem) = &link.problem {
                age.on_hover_text(problem);
            }
            ui.end_row();
            if let Some(problem) = &link.problem {
                ui.colored_label(colours::GONE, "!").on_hover_text(problem);
                ui.end_row();
            }
        }
    });
}

fn colour(link: &Link, now: Now) -> Color32 {
    if link.is_steady || link.freshness(now) == Freshness::Nothing {
        colours::of(link.freshness(now))
    } else {
        colours::TEXT
    }
}

fn rate(rate_hz: f64) -> String {
    match rate_hz {
        rate if rate < 0.05 => "-".into(),
        rate if rate < 9.95 => format!("{rate:.1} Hz"),
        rate => format!("{rate:.0} Hz"),
    }
}

fn ago(ago_s: f64) -> String {
    match ago_s {
        ago_s if ago_s < 60.0 => format!("{ago_s:.0} s ago"),
        ago_s => format!("{:.0} min ago", (ago_s / 60.0).floor()),
    }
}

fn age(age_s: Option<f64>) -> String {
    match age_s {
        None => "none yet".into(),
        Some(age_s) if age_s < 60.0 => format!("{age_s:.1} s"),
        Some(age_s) => format!("{:.0} min", (age_s / 60.0).floor()),
    }
}
