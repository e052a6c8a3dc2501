//! A stick to drive with: its distance from the middle is the speed.

use crate::screen::colours_of;
use eframe::egui::{Pos2, Rect, Sense, Stroke, Ui, Vec2, vec2};

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::SidePanel;

pub(super) const PANEL: PanelKind =
    PanelKind { inputs: &[], make: || Box::new(StickPanel::default()) };

/// Side of the pad, in points.
const PAD: f32 = 108.0;
/// Within this share of the radius around the middle the stick means no movement.
const DEAD_SHARE: f64 = 0.08;

#[derive(Default)]
struct StickPanel {
    held: Option<(f64, f64)>,
}

impl SidePanel for StickPanel {
    fn name(&self) -> &'static str {
        "stick"
    }

    fn is_pinned(&self) -> bool {
        // A thumb is on it: what comes and goes above must not move it.
        true
    }

    fn held_direction(&self) -> Option<(f64, f64)> {
        self.held
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let colours = colours_of(ui);
        ui.horizontal(|ui| {
            self.show_pad(ui);
            ui.vertical(|ui| {
                let (orders, limits) = (&console.orders, console.orders.limits);
                match (orders.is_stopped(), orders.is_driving()) {
                    _ if console.connection.check_orders().is_err() => {
                        ui.colored_label(colours.warning, "no robot to drive")
                    }
                    (true, _) => ui.colored_label(colours.warning, "stopped"),
                    (_, true) => ui.colored_label(colours.warning, "driving"),
                    _ => ui.label("drive by hand"),
                };
                ui.small(format!("up to {:.2} m/s", limits.speed_mps));
                ui.small(format!("{:.0}°/s", limits.turn_radps.to_degrees()));
                ui.small("W A S D, arrows");
                ui.small("or the stick");
            });
        });
        Vec::new()
    }
}

impl StickPanel {
    fn show_pad(&mut self, ui: &mut Ui) {
        let (rect, response) = ui.allocate_exact_size(Vec2::splat(PAD), Sense::drag());
        let response = response.accessible_name("stick");
        let colours = colours_of(ui);
        let radius = PAD / 2.0 - 8.0;
        let pointer = response.interact_pointer_pos().filter(|_| response.dragged());
        // A window without the focus may miss the release of the button, so the stick is released.
        let has_focus = ui.input(|input| input.focused);
        self.held = pointer.filter(|_| has_focus).and_then(|at| direction_of(rect, at, radius));
        let painter = ui.painter();
        let stroke = Stroke::new(1.5, colours.weak);
        painter.circle(rect.center(), radius, colours.unknown, stroke);
        let (forward, turn) = self.held.unwrap_or_default();
        let knob = rect.center() - vec2(turn as f32, forward as f32) * radius;
        let colour = if self.held.is_some() { colours.warning } else { colours.weak };
        painter.circle_filled(knob, 13.0, colour);
    }
}

/// Returns how far from the middle the pointer is, as shares of the radius: ahead, to the left.
fn direction_of(pad: Rect, at: Pos2, radius: f32) -> Option<(f64, f64)> {
    let away = (pad.center() - at) / radius;
    let length = away.length().max(1.0);
    let part = |of: f32| {
        let share = f64::from(of / length);
        if share.abs() < DEAD_SHARE { 0.0 } else { share }
    };
    let is_finite = away.x.is_finite() && away.y.is_finite();
    is_finite.then(|| (part(away.y), part(away.x)))
}
