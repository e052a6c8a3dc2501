//! STOP, and its release.

use crate::screen::colours_of;
use armor_picture::theme;
use eframe::egui::{Button, RichText, Stroke, Ui, vec2};

use crate::console::Console;
use crate::links::ClockTimes;
use crate::orders::OperatorOrder;
use crate::ports::panel_kind::PanelKind;
use crate::screen::SidePanel;

pub(super) const PANEL: PanelKind = PanelKind { inputs: &[], make: || Box::new(StopPanel) };

/// Height of STOP, in points: to be hit in a hurry.
const STOP_HEIGHT: f32 = 62.0;
/// Height of the state below it, in points: that of two lines.
const STATE_HEIGHT: f32 = 40.0;

struct StopPanel;

impl SidePanel for StopPanel {
    fn name(&self) -> &'static str {
        "stop"
    }

    fn is_pinned(&self) -> bool {
        true
    }

    fn show_contents(
        &mut self,
        ui: &mut Ui,
        console: &Console,
        _: ClockTimes,
    ) -> Vec<OperatorOrder> {
        let mut orders = Vec::new();
        let colours = colours_of(ui);
        let is_stopped = console.orders.is_stopped() && !console.connection.has_ended();
        let text = RichText::new("STOP").size(theme::LARGE).strong().color(theme::ON_STOP);
        let stroke = Stroke::new(if is_stopped { 3.0 } else { 0.0 }, colours.warning);
        let button = Button::new(text).fill(theme::STOP).stroke(stroke);
        let width = ui.available_width();
        let response = ui.add_sized(vec2(width, STOP_HEIGHT), button);
        if response.on_hover_text("stops the robot until Release is clicked (Space)").clicked() {
            orders.push(OperatorOrder::Stop);
        }
        // As high with one line as with two: what is below must not move under a finger.
        ui.vertical(|ui| {
            ui.set_min_height(STATE_HEIGHT);
            // Release is over the map: a second click at STOP never releases.
            if console.connection.is_cut() {
                let text = "no connection: STOP is sent when it returns";
                ui.colored_label(colours.error, RichText::new(text).strong());
            } else if let Err(why) = console.connection.check_orders() {
                ui.colored_label(colours.warning, format!("no robot connected: {why}"));
            } else if is_stopped {
                ui.colored_label(colours.warning, RichText::new("Release: see the map").strong());
            } else {
                ui.weak("or press Space");
            }
            if let Some(warning) = console.delivery_warning() {
                ui.colored_label(colours.error, warning);
            }
        });
        orders
    }
}
