//! The rehearsal in the strip of the times: its button and speeds, and the table of its steps.

use armor_picture::theme::ThemeColours;
use eframe::egui::{self, Button, Grid, RichText};

use super::{ComparedStep, MapRehearsal, RehearsalEnd, RehearsalSpeed};
use crate::canvas::paintable;
use crate::commands::{Command, about};
use crate::map_view::times::clock_text;

impl MapRehearsal {
    /// Shows the button, the speeds and how it stands. `may`: whether there is a route to rehearse.
    pub fn show_bar(&mut self, ui: &mut egui::Ui, may: bool) {
        ui.horizontal_wrapped(|ui| {
            let is_going_on = self.is_going_on();
            let button = Button::new("Rehearse");
            let button = ui.add_enabled(may && !is_going_on, button);
            if button.on_hover_text(about(Command::Rehearse).doc).clicked() {
                self.request();
            }
            for (name, _, speed) in RehearsalSpeed::NAMED {
                let choice = ui.selectable_label(self.speed == speed, name);
                let choice = choice.on_hover_text("How many times faster than real time");
                if choice.accessible_name(format!("rehearse at {name}")).clicked() {
                    self.speed = speed;
                }
            }
            if is_going_on && ui.button("Stop").accessible_name("stop the rehearsal").clicked() {
                self.stop();
            }
            let text = self.describe();
            if !text.is_empty() {
                let text = paintable(ui.ctx(), &text).into_owned();
                match self.records.end.as_ref() {
                    Some(end) => {
                        let colours = ThemeColours::of(ui.visuals());
                        let is_good = end.is_as_predicted;
                        ui.colored_label(if is_good { colours.good } else { colours.error }, text);
                    }
                    None => drop(ui.label(text)),
                }
            }
        });
    }

    fn describe(&self) -> String {
        if self.is_wanted {
            return "It begins when the file is saved.".to_owned();
        }
        match (&self.records.end, self.records.time_s()) {
            (Some(end), _) => describe_end(end),
            (None, Some(time_s)) if self.is_running() => {
                format!("rehearsing, {}", clock_text(time_s))
            }
            (None, None) if self.is_running() => "starting".to_owned(),
            _ => self.failure().unwrap_or_default(),
        }
    }

    /// Shows the table of the steps; returns the time of the row that was clicked.
    pub fn show_table(&self, ui: &mut egui::Ui) -> Option<f64> {
        let colours = ThemeColours::of(ui.visuals());
        for text in &self.records.breaches {
            ui.colored_label(colours.error, paintable(ui.ctx(), text));
        }
        let chosen =
            if self.records.steps.is_empty() { None } else { self.show_steps(ui, colours) };
        for text in &self.records.messages {
            ui.weak(paintable(ui.ctx(), text));
        }
        chosen
    }

    fn show_steps(&self, ui: &mut egui::Ui, colours: &ThemeColours) -> Option<f64> {
        let mut chosen = None;
        ui.strong("Rehearsal");
        Grid::new("steps of the rehearsal").num_columns(4).striped(true).show(ui, |ui| {
            for heading in ["step", "predicted", "driven", ""] {
                ui.weak(heading);
            }
            ui.end_row();
            for step in &self.records.steps {
                let [name, predicted, driven, bounds] = row_of(step);
                let label = paintable(ui.ctx(), &name).into_owned();
                if ui.selectable_label(false, label).clicked() {
                    chosen = step.driven_s.or(chosen);
                }
                ui.label(predicted);
                ui.label(driven);
                let bounds = RichText::new(paintable(ui.ctx(), &bounds));
                ui.label(if step.is_within { bounds } else { bounds.color(colours.error) });
                ui.end_row();
            }
        });
        ui.separator();
        chosen
    }
}

/// `red.l1`, `10.0 s`, `11.0 s (+10.0 %)`, `kept`.
fn row_of(step: &ComparedStep) -> [String; 4] {
    let time = |time_s: Option<f64>| time_s.map_or("-".to_owned(), clock_text);
    let share = step.difference.map(|share| format!(" ({:+.1} %)", share * 100.0));
    [
        format!("{}.{}", step.route, step.step),
        time(step.nominal_s),
        time(step.driven_s) + &share.unwrap_or_default(),
        step.bounds.clone(),
    ]
}

fn describe_end(end: &RehearsalEnd) -> String {
    let how = match end.outcome.as_deref() {
        Some("goal") => "at its goal",
        Some("safe") => "in its safe place",
        Some("failed") => "failed",
        _ => "not over",
    };
    let proven = end.proven_latest_s.map(|latest_s| format!(", proven: {}", clock_text(latest_s)));
    let after = clock_text(end.after_s);
    format!("{how} after {after}{} ({}×)", proven.unwrap_or_default(), end.speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_both_times_and_their_difference() {
        let mut step = ComparedStep {
            route: "red".into(),
            step: "l1".into(),
            nominal_s: Some(10.0),
            driven_s: Some(11.0),
            difference: Some(0.1),
            bounds: "kept".into(),
            is_within: true,
        };
        assert_eq!(row_of(&step), ["red.l1", "10.0 s", "11.0 s (+10.0 %)", "kept"]);
        (step.driven_s, step.difference) = (None, None);
        assert_eq!(row_of(&step)[2], "-");
        let end = RehearsalEnd {
            outcome: Some("goal".into()),
            after_s: 61.0,
            proven_latest_s: Some(300.0),
            is_as_predicted: true,
            speed: 5.0,
        };
        let text = "at its goal after 1 min 01.0 s, proven: 5 min 00.0 s (5×)";
        assert_eq!(describe_end(&end), text);
    }
}
