//! Other drawings on the same map: lighter, read only, with their names; and their list in the palette.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use armor_inspect::WakeCallback;
use armor_picture::theme::ThemeColours;
use eframe::egui::accesskit::{Node, Role};
use eframe::egui::{
    self, Align2, Color32, Painter, Rect, Response, RichText, Shape, Stroke, TextEdit, Vec2,
};

use crate::canvas::paintable;
use crate::live::running;
use crate::map_view::hit::Sight;
use crate::map_view::live::robots::ShownRobot;
use crate::map_view::model::{mission_of, placement_of};
use crate::map_view::names::publish;
use crate::map_view::other_drawings::PlacedIn;
use crate::map_view::painting::paint_note;
use crate::map_view::scene::SceneShape;
use crate::map_view::state::{MapFit, MapView};
use crate::panels::fields::is_entered;
use crate::workspace::Workspace;

/// News of the robots of others are shown within this time.
const SHOW_WITHIN: Duration = Duration::from_millis(100);
/// Pause after which the ages of poses are drawn again though nothing arrives.
const AGES_EVERY: Duration = Duration::from_secs(1);

impl MapView {
    /// Brings the drawings of others up to date.
    pub(super) fn follow_others(&mut self, ui: &egui::Ui, workspace: &Workspace) {
        let has_map = mission_of(workspace).is_some_and(|mission| mission.map.is_some());
        let placed_in = PlacedIn { has_map, placement: placement_of(workspace) };
        let is_changed = self.others.follow(placed_in, ui.input(|input| input.time));
        if is_changed && self.stays_fitted {
            self.fit = Some(MapFit::Everything);
        }
        let ctx = ui.ctx().clone();
        let wake: WakeCallback = Arc::new(move || ctx.request_repaint_after(SHOW_WITHIN));
        self.others.follow_robots(&wake, ui.input(|input| input.time));
        if self.others.robots().next().is_some() {
            ui.ctx().request_repaint_after(AGES_EVERY);
        }
    }

    /// The list in the palette: which are shown, why one is not, and a field to add one.
    pub(super) fn show_others(&mut self, ui: &mut egui::Ui, workspace: &mut Workspace) {
        ui.strong("Other drawings");
        let mut gone = None;
        for (number, other) in self.others.list.iter_mut().enumerate() {
            ui.horizontal(|ui| {
                let name = paintable(ui.ctx(), &other.name).into_owned();
                let shown = ui.checkbox(&mut other.is_shown, &name);
                shown
                    .on_hover_text(other.path.display().to_string())
                    .accessible_name(format!("other drawing: {name}"));
                let button = ui.small_button("x").on_hover_text("Remove it from this map");
                if button.accessible_name(format!("remove the drawing {name}")).clicked() {
                    gone = Some(number);
                }
            });
            if let Err(why) = &other.scene {
                let why = format!("not shown: {why}");
                ui.label(RichText::new(paintable(ui.ctx(), &why)).weak().small());
            }
        }
        if let Some(number) = gone {
            self.others.list.remove(number);
        }
        let field = TextEdit::singleline(&mut self.others.typed).hint_text("a file, Enter");
        let field = ui.add(field.desired_width(f32::INFINITY));
        let field = field.accessible_name("file of another drawing");
        if is_entered(ui, &field) {
            self.add_other(workspace);
        }
        let button = ui.button("Running systems");
        let button =
            button.on_hover_text("Adds the drawings of your systems that run on this host");
        if button.clicked() {
            self.add_running(workspace);
        }
    }

    fn add_other(&mut self, workspace: &mut Workspace) {
        let typed = self.others.typed.trim().to_owned();
        if typed.is_empty() {
            return;
        }
        let path = workspace.project.folder().join(&typed);
        let is_open = workspace.project.path().is_some_and(|open| is_same_file(open, &path));
        let result = match (path.is_file(), is_open) {
            (false, _) => Err(format!("there is no file {}", path.display())),
            (_, true) => Err(format!("{typed} is the open file")),
            _ => self.others.add(&path, typed, None),
        };
        match result {
            Ok(()) => self.others.typed.clear(),
            Err(why) => workspace.messages.warn(why),
        }
    }

    fn add_running(&mut self, workspace: &mut Workspace) {
        let records = match running() {
            Ok(records) => records,
            Err(error) => return workspace.messages.warn(error.to_string()),
        };
        let mut count = 0;
        for record in records {
            let path = record.resolve(&record.file);
            if workspace.project.path().is_some_and(|open| is_same_file(open, &path)) {
                continue;
            }
            let (name, registry) =
                (format!("{} (runs)", record.system), record.registry.to_string());
            count += usize::from(self.others.add(&path, name, Some(registry)).is_ok());
        }
        if count == 0 {
            workspace.messages.warn("No other system of yours runs on this host.");
        }
    }

    /// Paints them beneath the drawing of the open file.
    pub(super) fn paint_others(&self, painter: &Painter, colours: &ThemeColours) {
        let colour = colours.weak.gamma_multiply(0.7);
        for (name, scene) in self.others.shown() {
            let sight = Sight { scene, ..self.sight() };
            for entry in sight.items() {
                paint_other(painter, &sight, &entry.shape, colour);
            }
            if let Some(at) = anchor_of(&sight) {
                paint_note(painter, at, Align2::LEFT_BOTTOM, name, colours);
            }
        }
        let now_s = painter.ctx().input(|input| input.time);
        for (name, robot, pose) in self.others.robots() {
            let trail: Vec<_> = robot.trail.iter().map(|at| self.sight().at(*at)).collect();
            painter.add(Shape::line(trail, Stroke::new(1.5, colour)));
            let label = robot_text(name, robot, now_s);
            self.paint_robot_as(painter, colours, (robot, pose, colours.weak, &label), now_s);
        }
    }

    /// Publishes their names.
    pub(super) fn describe_others(&self, ctx: &egui::Context, response: &Response) {
        for (number, (name, scene)) in self.others.shown().enumerate() {
            let sight = Sight { scene, ..self.sight() };
            for entry in sight.items() {
                let area = Rect::from_center_size(sight.anchor(&entry.shape), Vec2::splat(18.0));
                if !self.window.intersects(area) {
                    continue;
                }
                let label = format!("{name}: {}", entry.label);
                let id = response.id.with(("other", number, entry.label.as_str()));
                publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
            }
        }
        let now_s = ctx.input(|input| input.time);
        for (number, (name, robot, pose)) in self.others.robots().enumerate() {
            let area = Rect::from_center_size(self.sight().at(pose.at), Vec2::splat(18.0));
            let label = format!("robot of {}", robot_text(name, robot, now_s));
            let id = response.id.with(("other robot", number));
            publish(ctx, id, &label, area, |node: &mut Node| node.set_role(Role::ListItem));
        }
    }
}

/// `fleet (runs): red, seen 4 s ago`.
fn robot_text(name: &str, robot: &ShownRobot, now_s: f64) -> String {
    let age_s = robot.age_s(now_s).filter(|_| robot.is_old(now_s));
    let seen = age_s.map(|age_s| format!(", seen {age_s:.0} s ago")).unwrap_or_default();
    format!("{name}: {}{seen}", robot.route)
}

/// Where the name of a drawing is: at its first item that is a leg, or at its first.
fn anchor_of(sight: &Sight<'_>) -> Option<egui::Pos2> {
    let items = || sight.items();
    let leg = items().find(|entry| matches!(entry.shape, SceneShape::Leg { .. }));
    leg.or_else(|| items().next()).map(|entry| sight.anchor(&entry.shape))
}

fn paint_other(painter: &Painter, sight: &Sight<'_>, shape: &SceneShape, colour: Color32) {
    let stroke = Stroke::new(1.5, colour);
    match shape {
        SceneShape::Zone { outline, .. } => {
            let corners: Vec<_> = outline.corners().into_iter().map(|at| sight.at(at)).collect();
            painter.add(Shape::closed_line(corners, stroke));
        }
        SceneShape::Line { points, .. } => {
            let points: Vec<_> = points.iter().map(|at| sight.at(*at)).collect();
            painter.extend(Shape::dashed_line(&points, stroke, 6.0, 4.0));
        }
        SceneShape::Leg { from: Some(from), to } => {
            let [from, to] = sight.leg_ends(*from, *to);
            painter.arrow(from, to - from, stroke);
        }
        SceneShape::Leg { from: None, .. } | SceneShape::Stop { .. } => {}
        SceneShape::Point(at) | SceneShape::Rally(at) | SceneShape::Symbol { at, .. } => {
            painter.circle_stroke(sight.at(*at), 4.0, stroke);
        }
    }
}

fn is_same_file(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}
