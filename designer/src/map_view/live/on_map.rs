//! The robots, their trails, done and coming legs, and the tracks, painted over the map; and their names. What
//! a colour means, a form repeats: a done leg has ticks, the present one is an arrow, a coming one dashes.

use armor_picture::theme::ThemeColours;
use armor_robotfile::timing::StepStand;
use eframe::egui::accesskit::{Node, Role};
use eframe::egui::{self, Align2, Color32, Painter, Pos2, Rect, Response, Shape, Stroke, Vec2};

use crate::map_view::live::LiveMap;
use crate::map_view::live::robots::{RobotPose, ShownRobot};
use crate::map_view::live::tracks::ShownTrack;
use crate::map_view::live::words::{late_text, stand_text};
use crate::map_view::mesh_batch::MeshBatch;
use crate::map_view::names::publish;
use crate::map_view::painting::paint_note;
use crate::map_view::state::MapView;

/// Least radius of a robot in the window.
const LEAST_RADIUS: f32 = 8.0;
/// Distance and half the length of the ticks of a done leg.
const TICKS: (f32, f32) = (14.0, 4.0);
/// Height of the octagon of a track's symbol.
const TRACK_HEIGHT: f32 = 28.0;
/// A track's line of velocity leads to where it is after so many seconds.
const AHEAD_S: f64 = 5.0;

impl MapView {
    /// Paints what is observed of the system.
    pub(in crate::map_view) fn paint_live(&mut self, painter: &Painter, colours: &ThemeColours) {
        if !self.live.is_open {
            return;
        }
        let now_s = painter.ctx().input(|input| input.time);
        self.paint_steps(painter, colours);
        for (number, robot) in self.live.robots.iter().enumerate() {
            let trail: Vec<_> = robot.trail.iter().map(|at| self.sight().at(*at)).collect();
            if trail.len() > 1 {
                let colour = colours.of_type(number).gamma_multiply(0.8);
                painter.add(Shape::line(trail, Stroke::new(2.0, colour)));
            }
            let path = robot.path.iter().map(|at| self.sight().at(*at)).collect::<Vec<_>>();
            if path.len() > 1 {
                painter.extend(Shape::dotted_line(&path, colours.of_type(number), 6.0, 1.5));
            }
        }
        self.paint_tracks(painter, colours, now_s);
        for (number, robot) in self.live.robots.iter().enumerate() {
            if let Some(pose) = robot.pose {
                self.paint_robot(painter, colours, (number, robot, pose), now_s);
            }
        }
    }

    fn paint_steps(&self, painter: &Painter, colours: &ThemeColours) {
        let mut batch = MeshBatch::new(painter, self.keeps_lines);
        for step in self.live.progress.iter().flat_map(|progress| &progress.steps) {
            let [Some(from), Some(to)] = step.ends_at else { continue };
            if from == to {
                continue;
            }
            let ends = self.sight().leg_ends(from, to);
            match step.stand {
                StepStand::Done => add_done(&mut batch, ends, colours.good),
                StepStand::Current => {
                    let [from, to] = ends;
                    let middle = from + (to - from) * 0.5;
                    let stroke = Stroke::new(5.0, colours.accent);
                    batch.add_shape(Shape::line_segment(ends, stroke), 1.0);
                    batch.paint(painter);
                    painter.arrow(middle, (to - from).normalized() * 14.0, stroke);
                }
                StepStand::Coming => {
                    batch.add_dashes(ends, Stroke::new(3.5, colours.weak), 8.0, 7.0);
                }
            }
        }
        batch.paint(painter);
    }

    fn paint_robot(
        &self,
        painter: &Painter,
        colours: &ThemeColours,
        (number, robot, pose): (usize, &ShownRobot, RobotPose),
        now_s: f64,
    ) {
        let is_old = robot.is_old(now_s);
        let colour = if is_old { colours.weak } else { colours.of_type(number) };
        let label = self.live.label_of(number, robot, now_s);
        self.paint_robot_as(painter, colours, (robot, pose, colour, &label), now_s);
    }

    /// Paints a robot in a colour, with a text.
    pub(in crate::map_view) fn paint_robot_as(
        &self,
        painter: &Painter,
        colours: &ThemeColours,
        (robot, pose, colour, label): (&ShownRobot, RobotPose, Color32, &str),
        now_s: f64,
    ) {
        let at = self.sight().at(pose.at);
        let radius = ((robot.radius_m * self.camera.scale()) as f32).max(LEAST_RADIUS);
        let is_old = robot.is_old(now_s);
        let stroke = Stroke::new(2.5, colour);
        // The window's y axis points down.
        let ahead = Vec2::new(pose.yaw_rad.cos() as f32, -pose.yaw_rad.sin() as f32);
        painter.circle_stroke(at, radius, Stroke::new(5.0, colours.background));
        if is_old {
            let rim: Vec<_> = (0..=32)
                .map(|part| at + radius * Vec2::angled(part as f32 * std::f32::consts::TAU / 32.0))
                .collect();
            painter.extend(Shape::dashed_line(&rim, stroke, 4.0, 4.0));
        } else {
            painter.circle(at, radius, colour.gamma_multiply(0.5), stroke);
        }
        painter.line_segment([at, at + ahead * (radius + 8.0)], stroke);
        let text = at - Vec2::new(0.0, radius + 10.0);
        paint_note(painter, text, Align2::CENTER_BOTTOM, label, colours);
    }

    fn paint_tracks(&mut self, painter: &Painter, colours: &ThemeColours, now_s: f64) {
        let mut symbols = MeshBatch::new(painter, self.keeps_lines);
        let mut names = Vec::new();
        let mut pictures = std::mem::take(&mut self.live_symbols);
        for (id, track) in self.live.tracks.tracks() {
            let at = self.sight().at(track.at);
            if !self.window.expand(TRACK_HEIGHT).contains(at) {
                continue;
            }
            let visibility = track.visibility(now_s).max(0.15);
            if track.speed_mps() > 0.0 {
                let ahead =
                    track.velocity_mps.map(|mps| (mps * AHEAD_S * self.camera.scale()) as f32);
                let ends = [at, at + Vec2::new(ahead[0], -ahead[1])];
                let line = Shape::line_segment(ends, Stroke::new(1.5, colours.text));
                symbols.add_shape(line, visibility);
            }
            match pictures.find(&track.sidc) {
                Some(picture) => symbols.add_symbol(&picture, at, TRACK_HEIGHT, visibility),
                // A code without a meaning: a cross in a circle.
                None => unknown_mark(at, colours.text)
                    .into_iter()
                    .for_each(|shape| symbols.add_shape(shape, visibility)),
            }
            names.push((at, track_text(id, track, now_s), visibility));
        }
        self.live_symbols = pictures;
        symbols.paint(painter);
        for (at, text, visibility) in names {
            let below = at + Vec2::new(0.0, TRACK_HEIGHT * 0.8);
            let font = egui::FontId::proportional(armor_picture::theme::SMALL);
            let ink = colours.text.gamma_multiply(visibility.max(0.6));
            painter.text(below, Align2::CENTER_TOP, text, font, ink);
        }
    }

    /// Publishes the names of robots and tracks.
    pub(in crate::map_view) fn describe_live(&self, ctx: &egui::Context, response: &Response) {
        if !self.live.is_open {
            return;
        }
        let now_s = ctx.input(|input| input.time);
        let square = |at: Pos2| Rect::from_center_size(at, Vec2::splat(2.0 * LEAST_RADIUS));
        for (number, robot) in self.live.robots.iter().enumerate() {
            let Some(pose) = robot.pose else { continue };
            let label = format!("robot {}", self.live.label_of(number, robot, now_s));
            let area = square(self.sight().at(pose.at));
            let id = response.id.with(("live robot", number));
            publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
        }
        for step in self
            .live
            .progress
            .iter()
            .flat_map(|progress| progress.steps.iter().map(move |step| (&progress.route, step)))
        {
            let (route, step) = step;
            let [Some(from), Some(to)] = step.ends_at else { continue };
            let stand = match step.stand {
                StepStand::Done => "done",
                StepStand::Current => "under way",
                StepStand::Coming => "coming",
            };
            let [from, to] = self.sight().leg_ends(from, to);
            let label = format!("step {} of {route}: {stand}", step.step);
            let id = response.id.with(("live step", route, &step.step));
            publish(ctx, id, &label, square(from + (to - from) * 0.5), |node: &mut Node| {
                node.set_role(Role::ListItem);
            });
        }
        for (number, (name, track)) in self.live.tracks.tracks().enumerate() {
            let label = format!("track {}", track_text(name, track, now_s));
            let id = response.id.with(("live track", number));
            let area = square(self.sight().at(track.at));
            publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
        }
    }
}

impl LiveMap {
    /// `red, l1, 2.0 s late`; of an old pose its age instead.
    fn label_of(&self, number: usize, robot: &ShownRobot, now_s: f64) -> String {
        if let Some(age_s) = robot.age_s(now_s).filter(|_| robot.is_old(now_s)) {
            return format!("{}, seen {age_s:.0} s ago", robot.route);
        }
        let Some(progress) = self.progress.get(number) else { return robot.route.clone() };
        let late = progress.late_s().map(|late_s| format!(", {}", late_text(late_s)));
        format!("{}, {}{}", robot.route, stand_text(progress), late.unwrap_or_default())
    }
}

/// Adds a line with ticks across it.
fn add_done(batch: &mut MeshBatch, [from, to]: [Pos2; 2], colour: Color32) {
    batch.add_shape(Shape::line_segment([from, to], Stroke::new(3.5, colour)), 1.0);
    let (length, along) = ((to - from).length(), (to - from).normalized());
    let across = along.rot90() * TICKS.1;
    let count = (length / TICKS.0).floor().min(500.0) as usize;
    for number in 1..=count {
        let at = from + along * TICKS.0 * number as f32;
        let tick = [at - across, at + across];
        batch.add_shape(Shape::line_segment(tick, Stroke::new(1.5, colour)), 1.0);
    }
}

/// `7, 3.2 m/s, 4 s old`.
fn track_text(id: &str, track: &ShownTrack, now_s: f64) -> String {
    let speed = match track.speed_mps() {
        mps if mps > 0.0 => format!(", {mps:.1} m/s"),
        _ => String::new(),
    };
    let age_s = track.age_s(now_s);
    let age = if age_s >= 1.0 { format!(", {age_s:.0} s old") } else { String::new() };
    format!("{id}{speed}{age}")
}

fn unknown_mark(at: Pos2, colour: Color32) -> [Shape; 3] {
    let (radius, stroke) = (TRACK_HEIGHT * 0.4, Stroke::new(1.5, colour));
    let arm = radius * 0.6;
    let line =
        |up: f32| Shape::line_segment([at + Vec2::new(-arm, up), at + Vec2::new(arm, -up)], stroke);
    [Shape::circle_stroke(at, radius, stroke), line(arm), line(-arm)]
}
