//! The true positions of a rehearsal on the map, with the trails behind them.

use armor_picture::theme::ThemeColours;
use eframe::egui::accesskit::{Node, Role};
use eframe::egui::{self, Align2, Painter, Pos2, Rect, Response, Shape, Stroke, Vec2};

use crate::map_view::names::publish;
use crate::map_view::painting::paint_note;
use crate::map_view::state::MapView;
use crate::map_view::times::clock_text;

/// From the middle of a robot to its tip, in points.
const TIP: f32 = 10.0;

impl MapView {
    /// Paints where the robots truly are, while the strip is open.
    pub(in crate::map_view) fn paint_rehearsal(&self, painter: &Painter, colours: &ThemeColours) {
        if !self.times.is_open {
            return;
        }
        for (routes, robot) in &self.rehearsal.records.robots {
            let trail: Vec<Pos2> = robot.trail.iter().map(|at| self.sight().at(*at)).collect();
            painter.add(Shape::line(trail, Stroke::new(1.5, colours.accent)));
            let at = self.sight().at(robot.at);
            // The window's y points down.
            let (sin, cos) = (robot.heading_rad as f32).sin_cos();
            let (ahead, left) = (Vec2::new(cos, -sin), Vec2::new(-sin, -cos));
            let corners = vec![
                at + ahead * TIP,
                at - ahead * (TIP * 0.7) + left * (TIP * 0.7),
                at - ahead * (TIP * 0.7) - left * (TIP * 0.7),
            ];
            let edge = Stroke::new(2.0, colours.background);
            painter.add(Shape::convex_polygon(corners, colours.accent, edge));
            let text = format!("{} (true)", routes.join(", "));
            let below = at + Vec2::new(0.0, TIP + 4.0);
            paint_note(painter, below, Align2::CENTER_TOP, &text, colours);
        }
    }

    /// Publishes the names of the true positions.
    pub(in crate::map_view) fn describe_rehearsal(&self, ctx: &egui::Context, response: &Response) {
        if !self.times.is_open {
            return;
        }
        for (routes, robot) in &self.rehearsal.records.robots {
            let label =
                format!("true position of {} at {}", routes.join(", "), clock_text(robot.time_s));
            let area = Rect::from_center_size(self.sight().at(robot.at), Vec2::splat(2.0 * TIP));
            let id = response.id.with(("true position", routes));
            publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
        }
    }
}
