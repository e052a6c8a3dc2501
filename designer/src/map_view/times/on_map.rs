//! The robots on the map at the time of the slider, and the marks where two come too close.

use armor_geo::{MapPoint, MapSegment};
use armor_picture::theme::ThemeColours;
use armor_robotfile::timing::RobotEncounter;
use eframe::egui::accesskit::{Node, Role};
use eframe::egui::{self, Align2, Painter, Pos2, Rect, Response, Stroke, Vec2};

use crate::map_view::names::publish;
use crate::map_view::painting::paint_note;
use crate::map_view::state::MapView;
use crate::map_view::times::clock_text;
use crate::map_view::tools::Tool;

/// Least radius of a robot in the window: it is visible however small the map is shown.
const LEAST_RADIUS: f32 = 7.0;
/// Radius of the mark where two robots come too close.
const MARK_RADIUS: f32 = 9.0;

impl MapView {
    /// The encounters at the speeds that are shown.
    fn encounters(&self) -> &[RobotEncounter] {
        let forecast = self.times.forecast();
        forecast.map_or(&[][..], |it| &it.preview.schedule(self.times.speeds).encounters)
    }

    /// Paints the robots where they are at the time of the slider, and marks encounters.
    pub(in crate::map_view) fn paint_times(&self, painter: &Painter, colours: &ThemeColours) {
        let Some(forecast) = self.times.forecast() else { return };
        for encounter in self.encounters() {
            let at = self.mark_of(encounter);
            let halo = Stroke::new(5.0, colours.background);
            let stroke = Stroke::new(2.0, colours.error);
            let arm = MARK_RADIUS * 0.6;
            for stroke in [halo, stroke] {
                painter.circle_stroke(at, MARK_RADIUS, stroke);
                for up in [arm, -arm] {
                    let ends = [at + Vec2::new(-arm, up), at + Vec2::new(arm, -up)];
                    painter.line_segment(ends, stroke);
                }
            }
        }
        let schedule = forecast.preview.schedule(self.times.speeds);
        for (number, robot) in forecast.preview.robots.iter().enumerate() {
            let Some(at) = schedule.motions[number].position_at(self.times.at_s) else { continue };
            let at = self.sight().at(at);
            let colour = colours.of_type(number);
            let radius = ((robot.radius_m * self.camera.scale()) as f32).max(LEAST_RADIUS);
            painter.circle_stroke(at, radius, Stroke::new(5.0, colours.background));
            painter.circle(at, radius, colour.gamma_multiply(0.45), Stroke::new(2.5, colour));
            let text = at + Vec2::new(0.0, -radius - 3.0);
            paint_note(painter, text, Align2::CENTER_BOTTOM, &robot.route, colours);
        }
    }

    /// Goes to the time of the encounter whose mark is clicked. Returns whether one is.
    pub(in crate::map_view) fn click_encounter(&mut self, response: &Response) -> bool {
        if !self.times.is_open || self.tool != Tool::Select || !response.clicked() {
            return false;
        }
        let Some(at) = response.interact_pointer_pos() else { return false };
        let near = self.encounters().iter().filter_map(|encounter| {
            let apart = self.mark_of(encounter).distance(at);
            (apart <= MARK_RADIUS + 2.0).then_some((apart, encounter.nearest_s))
        });
        let nearest = near.min_by(|one, other| one.0.total_cmp(&other.0));
        let Some((_, at_s)) = nearest else { return false };
        response.request_focus();
        self.times.at_s = at_s;
        true
    }

    /// Publishes the names of the robots and the marks.
    pub(in crate::map_view) fn describe_times(&self, ctx: &egui::Context, response: &Response) {
        let Some(forecast) = self.times.forecast() else { return };
        let schedule = forecast.preview.schedule(self.times.speeds);
        let when = clock_text(self.times.at_s);
        for (number, robot) in forecast.preview.robots.iter().enumerate() {
            let Some(at) = schedule.motions[number].position_at(self.times.at_s) else { continue };
            let label = format!("robot {} at {when}", robot.route);
            let area = Rect::from_center_size(self.sight().at(at), Vec2::splat(2.0 * LEAST_RADIUS));
            let id = response.id.with(("robot", number));
            publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
        }
        for (number, encounter) in self.encounters().iter().enumerate() {
            let routes = encounter.robots.map(|robot| &forecast.preview.robots[robot].route);
            let at_s = clock_text(encounter.nearest_s);
            let label = format!("mark of {} and {} at {at_s}", routes[0], routes[1]);
            let area = Rect::from_center_size(self.mark_of(encounter), Vec2::splat(18.0));
            let id = response.id.with(("encounter", number));
            publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::Button));
        }
    }

    /// Where an encounter is marked: between the robots.
    fn mark_of(&self, encounter: &RobotEncounter) -> Pos2 {
        let [one, other]: [MapPoint; 2] = encounter.at;
        self.sight().at(MapSegment::new(one, other).point_at(0.5))
    }
}
