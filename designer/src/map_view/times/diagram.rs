//! The diagram: how far along its route each robot is at each time.

use armor_picture::theme::ThemeColours;
use eframe::egui::{self, Stroke};
use egui_plot::{
    Corner, FilledArea, Legend, Line, MarkerShape, Plot, PlotPoints, PlotUi, Points, VLine,
};

use crate::map_view::times::TimesStrip;
use crate::map_view::times::forecast::Forecast;

/// The name of the marks where two robots come too close, in the legend.
const TOO_CLOSE: &str = "too close";

impl TimesStrip {
    /// Shows it; returns the time of a click or a drag.
    pub(super) fn show_diagram(&self, ui: &mut egui::Ui) -> Option<f64> {
        let forecast = self.forecast()?;
        let colours = ThemeColours::of(ui.visuals());
        let plot = Plot::new("distance over time")
            .height(ui.available_height())
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_double_click_reset(false)
            .x_axis_label("s")
            .y_axis_label("m")
            .include_x(0.0)
            .include_x(self.end_s())
            .include_y(0.0)
            .legend(Legend::default().position(Corner::RightBottom));
        let shown = plot.show(ui, |shown| self.draw(shown, forecast, colours));
        let is_chosen = shown.response.clicked() || shown.response.dragged();
        shown.response.accessible_name("distance of the robots over time");
        shown.inner.filter(|_| is_chosen)
    }

    /// Draws it; returns the time at the pointer.
    fn draw(
        &self,
        shown: &mut PlotUi<'_>,
        forecast: &Forecast,
        colours: &ThemeColours,
    ) -> Option<f64> {
        let schedule = forecast.preview.schedule(self.speeds);
        for (number, robot) in forecast.preview.robots.iter().enumerate() {
            let (colour, name) = (colours.of_type(number), robot.route.as_str());
            let band = &forecast.bands[number];
            let area = FilledArea::new("", &band.times_s, &band.least_m, &band.most_m);
            shown.add(area.fill_color(colour.gamma_multiply(0.2)).allow_hover(false));
            let line = PlotPoints::from(forecast.lines[self.speeds as usize][number].clone());
            shown.line(Line::new(name, line).color(colour).width(2.0));
            let kept = forecast.preview.appointments.iter().zip(&schedule.appointments_s);
            let kept = kept.filter(|(appointment, _)| appointment.robot == number);
            let motion = &schedule.motions[number];
            let marks: Vec<_> = kept
                .filter_map(|(_, at_s)| Some([(*at_s)?, motion.distance_at((*at_s)?)?]))
                .collect();
            let marks = Points::new(name, marks).shape(MarkerShape::Diamond);
            shown.points(marks.color(colour).radius(4.5).filled(true));
            if let Some(here_m) = motion.distance_at(self.at_s) {
                let here = Points::new(name, vec![[self.at_s, here_m]]);
                shown.points(here.color(colour).radius(5.0).filled(false));
            }
        }
        let close: Vec<_> = schedule
            .encounters
            .iter()
            .flat_map(|encounter| {
                let at = |robot: usize| schedule.motions[robot].distance_at(encounter.nearest_s);
                encounter.robots.map(|robot| Some([encounter.nearest_s, at(robot)?]))
            })
            .flatten()
            .collect();
        if !close.is_empty() {
            let marks = Points::new(TOO_CLOSE, close).shape(MarkerShape::Cross);
            shown.points(marks.color(colours.error).radius(6.0));
        }
        let stroke = Stroke::new(1.0, colours.text);
        shown.vline(VLine::new("", self.at_s).stroke(stroke).allow_hover(false));
        shown.pointer_coordinate().map(|at| at.x.max(0.0))
    }
}
