//! The screen: the map in the middle, the panels next to it. Shows a [`Console`] and returns the
//! commands that the operator orders; its own state is only the view.

mod area;
mod camera;
pub(crate) mod colours;
mod keys;
mod layers;
mod map_viewport;
mod marks;
mod new_buttons;
mod notices;
pub(crate) mod open_parts;
mod panel;
mod questions;
mod strip;
mod tiles;

use armor_picture::theme::ThemeColours;
use eframe::egui::{
    CentralPanel, Frame, Panel as EdgePanel, Ui, UserAttentionType, ViewportCommand,
};

use crate::console::Console;
use crate::links::{ClockTimes, Freshness, InputLink};
use crate::orders::{OperatorOrder, RobotCommand};
use open_parts::OpenPart;

pub(crate) use colours::{apply_theme, colours_of, freshness_ink};
pub(crate) use panel::{SidePanel, show_rows};

/// Width of the column of panels next to the map, in points.
const COLUMN_WIDTH: f32 = 288.0;
/// A narrower map has the switches of its layers behind a button, in points.
const SMALL_WIDTH: f32 = 480.0;
/// The name of the button that resumes the mission, among the new ones; no transition is called that.
const RESUME: &str = "resume the mission";
/// Period at which ages are updated while steady data are missing, in seconds.
const AGEING_S: f32 = 0.5;

/// The view of the operator.
pub(crate) struct Screen {
    area: area::Area,
    panels: panel::PanelColumn,
    shown: layers::Layers,
    new_buttons: new_buttons::NewButtons,
}

impl Screen {
    /// Makes a screen with these panels next to the map.
    pub(crate) fn new(panels: Vec<Box<dyn SidePanel>>) -> Self {
        Self {
            area: area::Area::default(),
            panels: panel::PanelColumn::new(panels),
            shown: layers::Layers::default(),
            new_buttons: new_buttons::NewButtons::default(),
        }
    }

    /// Shows one frame, and returns the commands to send to the robot.
    pub(crate) fn show_frame(
        &mut self,
        ui: &mut Ui,
        console: &mut Console,
        now: ClockTimes,
    ) -> Vec<RobotCommand> {
        colours::choose_theme(ui.ctx(), console.is_light);
        console.watch_conditions(now);
        let mut orders = keys::read_keys(ui);
        let questions = console.mission.iter().flat_map(|mission| &mission.questions);
        let asked = questions.map(|question| question.transition.clone());
        let paused = console.mission.iter().filter(|mission| !mission.paused_by.is_empty());
        let shown = asked.chain(paused.map(|_| RESUME.to_owned()));
        if self.new_buttons.begin_frame(ui, shown, now.host_s) {
            // The window may be behind another one.
            let attention = UserAttentionType::Informational;
            ui.ctx().send_viewport_cmd(ViewportCommand::RequestUserAttention(attention));
        }
        // First, so that STOP has one place, whatever is opened or wrapped.
        EdgePanel::right("robot").resizable(false).exact_size(COLUMN_WIDTH).show(ui, |ui| {
            self.panels.show_column(ui, console, now, &mut orders);
        });
        EdgePanel::top("strip").show(ui, |ui| {
            strip::show_strip(ui, console, now);
        });
        EdgePanel::top("layers").show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                // In a small window they would leave no room for the map.
                let is_small = ui.available_width() < SMALL_WIDTH;
                if is_small && ui.button("layers").clicked() {
                    open_parts::toggle(ui.ctx(), OpenPart::Layers);
                }
                let is_open = !is_small || open_parts::is_open(ui.ctx(), OpenPart::Layers);
                if is_open && self.shown.show_switches(ui, console) {
                    ui.separator();
                }
                self.area.show_view_buttons(ui);
            });
        });
        CentralPanel::default()
            .frame(Frame::NONE.fill(ThemeColours::of_theme(console.is_light).unknown))
            .show(ui, |ui| {
                let buttons = &self.new_buttons;
                self.area.show_map(ui, console, &self.shown, buttons, now, &mut orders);
            });
        let hand = keys::read_held_direction(ui).or(self.panels.held_direction());
        orders.push(match hand {
            Some((forward, turn)) => OperatorOrder::Drive { forward, turn },
            None => OperatorOrder::LetGo,
        });
        if hand.is_some() {
            ui.ctx().request_repaint_after(keys::PERIOD);
        } else if console.connection.has_ended() {
            // Only the minutes since then change.
            let age_s = (now.host_s - console.lost_s).max(0.0) as f32;
            ui.ctx().request_repaint_after_secs(60.1 - age_s % 60.0);
        } else if shows_ages(console, now) {
            ui.ctx().request_repaint_after_secs(AGEING_S);
        }
        orders.into_iter().flat_map(|order| console.handle_order(order, now)).collect()
    }
}

/// Returns whether the passing of time alone changes the screen.
fn shows_ages(console: &Console, now: ClockTimes) -> bool {
    let ages = |link: &InputLink| link.is_steady && link.freshness(now) != Freshness::Nothing;
    console.orders.pressed().is_some()
        || console.orders.is_stopped()
        || console.connection.is_cut()
        || console.recent_refusal(now).is_some()
        || console.recent_arrival(now).is_some()
        || console.orders.goal().is_some()
        || console.mission.as_ref().is_some_and(|mission| mission.is_running)
        || console.links.iter().any(ages)
}

#[cfg(test)]
mod frame_cost;
#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod notice_tests;
#[cfg(test)]
mod tests;
