//! The lists next to the diagram: where two robots come too close, and the appointments with the chances
//! that they are kept.

use armor_picture::theme::ThemeColours;
use armor_robotfile::timing::{
    Appointment, CHANCE_DRAWS, DrawnChance, MissionPreview, PreviewSchedule, RobotEncounter,
};
use eframe::egui::{self, RichText};

use crate::canvas::paintable;
use crate::map_view::times::forecast::Forecast;
use crate::map_view::times::{TimesStrip, clock_text};

impl TimesStrip {
    /// Shows them; returns the time of the row that was clicked.
    pub(super) fn show_lists(&self, ui: &mut egui::Ui) -> Option<f64> {
        let forecast = self.forecast()?;
        let schedule = forecast.preview.schedule(self.speeds);
        self.show_rows(ui, forecast, schedule)
    }

    fn show_rows(
        &self,
        ui: &mut egui::Ui,
        forecast: &Forecast,
        schedule: &PreviewSchedule,
    ) -> Option<f64> {
        let colours = ThemeColours::of(ui.visuals());
        let (preview, mut chosen) = (&forecast.preview, None);
        for (robot, step) in schedule.open_robots() {
            let robot = &preview.robots[robot];
            let step = robot.steps.get(step).map_or("its beginning", String::as_str);
            let text = format!("Where {} is from {step} on is not known.", robot.route);
            ui.colored_label(colours.warning, paintable(ui.ctx(), &text));
        }
        if preview.robots.len() > 1 {
            ui.strong("Too close");
            if schedule.encounters.is_empty() {
                ui.weak(format!("No two robots at the {} times.", self.speeds.word()));
            }
            for encounter in &schedule.encounters {
                let text = encounter_text(preview, encounter);
                let text = RichText::new(paintable(ui.ctx(), &text)).color(colours.error);
                if ui.selectable_label(self.is_at(encounter.nearest_s), text).clicked() {
                    chosen = Some(encounter.nearest_s);
                }
            }
            self.show_meeting_chances(ui, forecast);
        }
        ui.strong("Appointments");
        if preview.appointments.is_empty() {
            ui.weak("No meeting, and no step with a limit.");
        }
        for (appointment, at_s) in preview.appointments.iter().zip(&schedule.appointments_s) {
            let text = appointment_text(preview, appointment, *at_s);
            let is_here = at_s.is_some_and(|at_s| self.is_at(at_s));
            let name =
                RichText::new(paintable(ui.ctx(), &text)).color(colours.of_type(appointment.robot));
            if ui.selectable_label(is_here, name).clicked() {
                chosen = chosen.or(*at_s);
            }
            for limit in &appointment.limits {
                let chance = forecast.chances.as_ref().map(|chances| chances.limits[*limit]);
                let words = &preview.limits[*limit].words;
                ui.weak(paintable(ui.ctx(), &format!("    {words}: {}", chance_text(chance))));
            }
        }
        if preview.limits.len() > 1 {
            let all = forecast.chances.as_ref().map(|chances| chances.all);
            ui.weak(format!("All limits: {}", chance_text(all)));
        }
        if !preview.limits.is_empty() {
            ui.weak(format!("Of {CHANCE_DRAWS} draws of all speeds, with the 95 % interval."));
        }
        chosen
    }

    /// In how many draws two robots come too close.
    fn show_meeting_chances(&self, ui: &mut egui::Ui, forecast: &Forecast) {
        let Some(chances) = &forecast.chances else { return };
        for (robots, chance) in &chances.encounters {
            let [one, other] = robots.map(|robot| &forecast.preview.robots[robot].route);
            let text =
                format!("{one} and {other} at any speeds: {}", chance_text(Some(Some(*chance))));
            ui.weak(paintable(ui.ctx(), &text));
        }
    }

    fn is_at(&self, time_s: f64) -> bool {
        (self.at_s - time_s).abs() < 0.05
    }
}

/// `red and blue, 0.12 m at 5.0 s (l1, b1)`.
fn encounter_text(preview: &MissionPreview, encounter: &RobotEncounter) -> String {
    let [one, other] = encounter.robots.map(|robot| &preview.robots[robot]);
    let step = |number: usize| {
        let robot = &preview.robots[encounter.robots[number]];
        encounter.steps[number].and_then(|step| robot.steps.get(step)).map_or("-", String::as_str)
    };
    let (near_m, at) = (encounter.nearest_m, clock_text(encounter.nearest_s));
    let steps = format!("{}, {}", step(0), step(1));
    format!("{} and {}, {near_m:.2} m at {at} ({steps})", one.route, other.route)
}

fn appointment_text(
    preview: &MissionPreview,
    appointment: &Appointment,
    at_s: Option<f64>,
) -> String {
    let route = &preview.robots[appointment.robot].route;
    let with = appointment.with.as_ref().map(|with| format!(" with {with}")).unwrap_or_default();
    let at = at_s.map_or("not known".to_owned(), clock_text);
    format!("{route}.{}{with}: {at}", appointment.step)
}

/// None while it is computed; within it, none where it is not known.
fn chance_text(chance: Option<Option<DrawnChance>>) -> String {
    let percent = |share: f64| format!("{:.1}", share * 100.0);
    match chance {
        None => "…".to_owned(),
        Some(None) => "not known".to_owned(),
        Some(Some(chance)) => {
            let [low, high] = chance.interval().map(percent);
            format!("{} % ({low} to {high})", percent(chance.share()))
        }
    }
}
