//! The strip of the times: when the robots of the map are where, before the mission runs. Closed, it costs
//! nothing.

mod diagram;
mod forecast;
mod list;
mod on_map;

use armor_picture::theme::{self, ThemeColours};
use armor_robotfile::Date;
use armor_robotfile::timing::SpeedChoice;
use eframe::egui::{self, DragValue, Panel, RichText, ScrollArea, Slider, TextEdit};

use crate::map_view::model::mission_of;
use crate::map_view::state::MapView;
use crate::map_view::times::forecast::{Forecast, Forecaster};
use crate::workspace::Workspace;

/// The width of the lists next to the diagram.
const LISTS_WIDTH: f32 = 400.0;

/// The strip, and what it shows.
#[derive(Default)]
pub struct TimesStrip {
    /// Whether it is open.
    pub is_open: bool,
    /// The speeds of the robots on the map.
    speeds: SpeedChoice,
    /// The time of the mission that the map shows, in seconds from its begin.
    at_s: f64,
    /// When the mission begins, as typed; empty if this is not known.
    begin: String,
    forecaster: Forecaster,
}

impl TimesStrip {
    /// Opens or closes it.
    pub fn toggle(&mut self) {
        self.is_open = !self.is_open;
        if !self.is_open {
            self.forecaster.stop();
        }
    }

    /// What is computed of the open file, or of the one before while that of this one is not ready.
    fn forecast(&self) -> Option<&Forecast> {
        self.forecaster.forecast().filter(|_| self.is_open)
    }

    fn begin_date(&self) -> Option<Date> {
        self.begin.trim().parse().ok()
    }
}

impl MapView {
    /// Shows the strip beneath the map, if it is open.
    pub(super) fn show_times(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        if !self.times.is_open {
            return;
        }
        self.rehearsal.follow(ui.ctx(), workspace);
        // The predicted robots follow the true ones.
        if let Some(time_s) =
            self.rehearsal.records.time_s().filter(|_| self.rehearsal.is_going_on())
        {
            self.times.at_s = time_s;
        }
        let configuration = workspace.project.configuration();
        let revision = workspace.project.revision();
        let begin = self.times.begin_date();
        self.times.forecaster.follow(ui.ctx(), configuration, (revision, begin));
        let panel = Panel::bottom("times of the map").resizable(true);
        let panel = panel.default_size(240.0).min_size(150.0);
        panel.show(ui, |ui| self.show_strip(ui, workspace));
    }

    fn show_strip(&mut self, ui: &mut egui::Ui, workspace: &Workspace) {
        let is_without = mission_of(workspace).is_none_or(|mission| mission.routes.is_empty());
        // It keeps its height while there is little in it.
        ui.set_min_height(ui.available_height());
        self.times.show_bar(ui);
        let may_rehearse = self.may_rehearse(workspace);
        self.rehearsal.show_bar(ui, may_rehearse);
        let text = match self.times.forecaster.forecast() {
            _ if is_without => "No route is drawn: the tool Leg draws one.",
            None if self.times.forecaster.is_computing() => "The times are being computed.",
            None => "There are no times: meetings wait for each other in a circle.",
            Some(_) => "",
        };
        if !text.is_empty() {
            ui.weak(text);
            return;
        }
        let height = ui.available_height();
        ui.horizontal_top(|ui| {
            let width = (ui.available_width() - LISTS_WIDTH).max(ui.available_width() / 2.0);
            let size = egui::vec2(width, height);
            let chosen = ui.allocate_ui(size, |ui| self.times.show_diagram(ui)).inner;
            ui.separator();
            let listed = ui.vertical(|ui| self.show_times_lists(ui)).inner;
            if let Some(at_s) = chosen.or(listed) {
                self.times.at_s = at_s;
            }
        });
    }
}

impl MapView {
    /// Whether there is a route to rehearse.
    pub(super) fn may_rehearse(&self, workspace: &Workspace) -> bool {
        mission_of(workspace).is_some_and(|mission| !mission.routes.is_empty())
    }

    /// The table of the rehearsal and the lists of the times; returns the time of the row that was clicked.
    fn show_times_lists(&self, ui: &mut egui::Ui) -> Option<f64> {
        let scroll = ScrollArea::vertical().id_salt("lists of the times").auto_shrink(false);
        let shown = scroll.show(ui, |ui| {
            let compared = self.rehearsal.show_table(ui);
            let listed = self.times.show_lists(ui);
            compared.or(listed)
        });
        shown.inner
    }
}

impl TimesStrip {
    /// The speeds, the slider and the begin.
    fn show_bar(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.strong("Times");
            for (word, speeds) in SpeedChoice::NAMED {
                let doc = match speeds {
                    SpeedChoice::Fastest => "All drives at their fastest, within their tolerance",
                    SpeedChoice::Nominal => "All drives at exactly their speeds",
                    SpeedChoice::Slowest => "All drives at their slowest, within their tolerance",
                };
                let choice = ui.selectable_label(self.speeds == speeds, word).on_hover_text(doc);
                if choice.accessible_name(format!("times: {word}")).clicked() {
                    self.speeds = speeds;
                }
            }
            let end_s = self.end_s();
            self.at_s = self.at_s.clamp(0.0, end_s.max(0.0));
            ui.spacing_mut().slider_width = (ui.available_width() - 420.0).clamp(120.0, 700.0);
            let range = 0.0..=end_s.max(0.1);
            // With its number in it, the slider would answer for the number and not for itself.
            let slider = Slider::new(&mut self.at_s, range.clone()).show_value(false).step_by(0.1);
            let slider = ui.add(slider);
            if slider.clicked() || slider.drag_started() {
                // Its arrow keys act from then on.
                slider.request_focus();
            }
            slider
                .on_hover_text("The time of the mission that the map shows (arrow keys)")
                .accessible_name("time of the mission");
            let number = DragValue::new(&mut self.at_s).range(range).suffix(" s");
            let number = ui.add(number.fixed_decimals(1).speed(0.1));
            number.on_hover_text("The same as a number").accessible_name("time as a number");
            ui.label("Begin");
            let is_wrong = !self.begin.trim().is_empty() && self.begin_date().is_none();
            let mut field = TextEdit::singleline(&mut self.begin).desired_width(150.0);
            if is_wrong {
                field = field.text_color(ThemeColours::of(ui.visuals()).error);
            }
            let field = ui.add(field.hint_text("2026-11-21T14:30:00Z"));
            field
                .on_hover_text("When the mission begins, in UTC: needed where a date is waited for")
                .accessible_name("begin of the mission");
            if is_wrong {
                let text = RichText::new("such as 2026-11-21T14:30:00Z").size(theme::SMALL);
                ui.colored_label(ThemeColours::of(ui.visuals()).error, text);
            }
        });
    }

    fn end_s(&self) -> f64 {
        let all = SpeedChoice::NAMED.iter();
        let ends = self.forecaster.forecast().map(|forecast| {
            all.map(|(_, speeds)| forecast.preview.schedule(*speeds).end_s).fold(0.0, f64::max)
        });
        ends.unwrap_or_default()
    }
}

/// A time for people: `12.3 s`, `4 min 07.0 s`.
pub(super) fn clock_text(time_s: f64) -> String {
    let tenths = (time_s * 10.0).round();
    let (minutes, rest) = ((tenths / 600.0).floor(), tenths % 600.0 / 10.0);
    if minutes >= 1.0 { format!("{minutes} min {rest:04.1} s") } else { format!("{rest:.1} s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_short() {
        let texts = [0.0, 12.34, 59.96, 247.0].map(clock_text);
        assert_eq!(texts, ["0.0 s", "12.3 s", "1 min 00.0 s", "4 min 07.0 s"]);
    }
}
