//! The palette of the system: all kinds, searched by typing, dragged into the drawing.

use std::sync::Arc;

use armor_wire::manifest::Manifest;
use eframe::egui::text::LayoutJob;
use eframe::egui::{self, FontId, Galley, Key, Modifiers, Rect, ScrollArea, Sense, TextEdit};

use crate::diagram_pane::show_dragged;
use crate::panels::fields::is_entered;
use crate::panels::pick;
use crate::system::{docs, robot};
use crate::workspace::Workspace;
use armor_picture::theme;

/// Space around the texts of an entry.
const MARGIN: egui::Vec2 = egui::vec2(6.0, theme::NEAR);
/// Most lines of what a kind does; the tooltip has all of it.
const SUMMARY_LINES: usize = 3;

/// A kind that is dragged from the palette.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DraggedKind(pub String);

/// The palette.
#[derive(Debug, Default)]
pub struct SystemPalette {
    typed: String,
}

impl SystemPalette {
    /// Shows it; returns the kind that is to be added.
    pub(super) fn show(&mut self, ui: &mut egui::Ui, workspace: &Workspace) -> Option<String> {
        ui.add_space(theme::NEAR);
        ui.strong("Components");
        let field = TextEdit::singleline(&mut self.typed).hint_text("Search");
        let field = ui.add(field.desired_width(f32::INFINITY)).accessible_name("Search components");
        let kinds: Vec<_> = workspace.project.kinds().iter().collect();
        let found = pick::sorted(&self.typed, &kinds, |kind| (&kind.kind, &kind.summary));
        let found: Vec<_> = found.into_iter().map(|(_, kind)| kind).collect();
        let enter = is_entered(ui, &field);
        let mut wanted = found.first().filter(|_| enter).map(|kind| kind.kind.clone());
        if kinds.is_empty() {
            ui.weak("No component kinds: the program armor lists them.");
        } else if found.is_empty() {
            ui.weak("no match");
        }
        let mut chosen = None;
        let robot = robot::entry(workspace.project.kinds());
        let robot = robot.filter(|robot| {
            let robot = [robot];
            !pick::sorted(&self.typed, &robot, |it| (&it.kind, &it.summary)).is_empty()
        });
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            // Behind the kinds if they are searched for: its summary names some of them.
            let is_first = self.typed.trim().is_empty();
            let mut show_robot = |ui: &mut egui::Ui, is_here: bool| {
                if let Some(robot) = robot.as_ref().filter(|_| is_here) {
                    ui.add_space(theme::NEAR);
                    ui.weak("whole robots");
                    if self.entry(ui, workspace, robot) {
                        wanted = Some(robot.kind.clone());
                    }
                }
            };
            show_robot(ui, is_first);
            for is_stock in [true, false] {
                let part: Vec<_> = found
                    .iter()
                    .filter(|kind| workspace.project.kinds().is_stock(&kind.kind) == is_stock)
                    .collect();
                if part.is_empty() {
                    continue;
                }
                ui.add_space(theme::NEAR);
                ui.weak(if is_stock { "part of Armor" } else { "from component directories" });
                for kind in part {
                    if self.entry(ui, workspace, kind) {
                        chosen = Some(kind.kind.clone());
                    }
                }
            }
            show_robot(ui, !is_first);
        });
        chosen.or(wanted)
    }

    /// One kind; returns whether it is to be added.
    fn entry(&self, ui: &mut egui::Ui, workspace: &Workspace, kind: &Manifest) -> bool {
        let lines = lay_out(ui, kind, ui.available_width() - 2.0 * MARGIN.x);
        let height = lines.iter().map(|line| line.size().y).sum::<f32>() + 2.0 * MARGIN.y;
        let size = egui::vec2(ui.available_width(), height);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        paint(ui, rect, &response, lines);
        let name = format!("kind {}", kind.kind);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
        response.dnd_set_drag_payload(DraggedKind(kind.kind.clone()));
        if response.dragged() {
            show_dragged(ui, &kind.kind);
        }
        let enter =
            response.has_focus() && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Enter));
        let origin = workspace.project.kinds().origin(&kind.kind);
        let twice = response.double_clicked();
        response.on_hover_ui(|ui| docs::show(ui, kind, origin));
        twice || enter
    }
}

/// Lays out the kind, and below it what it does, in the width of the list.
fn lay_out(ui: &egui::Ui, kind: &Manifest, width: f32) -> [Arc<Galley>; 2] {
    let weak = ui.visuals().weak_text_color();
    let parts = [
        (kind.kind.as_str(), theme::BODY, ui.visuals().strong_text_color(), 1),
        (kind.summary.as_str(), theme::SMALL, weak, SUMMARY_LINES),
    ];
    parts.map(|(text, size, colour, most)| {
        let text = crate::text::paintable(ui.ctx(), text).into_owned();
        let mut job = LayoutJob::simple(text, FontId::proportional(size), colour, width);
        job.wrap.max_rows = most;
        ui.painter().layout_job(job)
    })
}

/// Draws an entry.
fn paint(ui: &egui::Ui, rect: Rect, response: &egui::Response, lines: [Arc<Galley>; 2]) {
    if response.hovered() || response.has_focus() {
        let fill = ui.style().interact(response).weak_bg_fill;
        ui.painter().rect_filled(rect, theme::CORNER, fill);
    }
    let mut at = rect.min + MARGIN;
    for line in lines {
        let height = line.size().y;
        ui.painter().galley(at, line, ui.visuals().text_color());
        at.y += height;
    }
}
