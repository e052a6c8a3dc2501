//! The small map of the drawing: it shows the visible part, and dragging on it moves the view.

use eframe::egui::{self, Mesh, PointerButton, Pos2, Rect, Stroke, StrokeKind, Vec2};

use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::node::Mark;
use crate::canvas::state::Canvas;
use armor_picture::theme::ThemeColours;

/// The largest it gets, in points.
const SIZE: Vec2 = Vec2::new(180.0, 120.0);
/// Its distance from the corner of the window.
const MARGIN: f32 = 12.0;

/// The map: where it is in the window, and what part of the drawing it shows.
struct Overview {
    rect: Rect,
    area: Rect,
}

impl Overview {
    fn scale(&self) -> f32 {
        self.rect.width() / self.area.width().max(1.0)
    }

    fn to_window(&self, at: Pos2) -> Pos2 {
        self.rect.min + (at - self.area.min) * self.scale()
    }

    fn to_drawing(&self, at: Pos2) -> Pos2 {
        self.area.min + (at - self.rect.min) / self.scale()
    }
}

impl<Id: DiagramId> Canvas<Id> {
    /// The map, unless the whole drawing is shown anyway.
    fn map(&self, diagram: &Diagram<Id>) -> Option<Overview> {
        let bounds = diagram.bounds().filter(|_| diagram.nodes.len() > 1)?;
        let shown = self.viewport.shown(self.rect);
        if shown.contains_rect(bounds) || self.rect.width() < 3.0 * SIZE.x {
            return None;
        }
        let area = bounds.union(shown).expand(20.0);
        let scale = (SIZE.x / area.width()).min(SIZE.y / area.height());
        let size = area.size() * scale;
        let corner = self.rect.max - Vec2::splat(MARGIN);
        Some(Overview { rect: Rect::from_min_max(corner - size, corner), area })
    }

    /// Whether the pointer is on the map; dragging there moves the view.
    pub(super) fn drag_map(
        &mut self,
        ui: &egui::Ui,
        diagram: &Diagram<Id>,
        response: &egui::Response,
    ) -> bool {
        let Some(map) = self.map(diagram).filter(|_| !self.is_busy()) else { return false };
        let pressed = ui.input(|i| i.pointer.press_origin());
        let is_pressed =
            pressed.is_some_and(|at| map.rect.contains(at)) && response.is_pointer_button_down_on();
        if is_pressed
            && ui.input(|i| i.pointer.button_down(PointerButton::Primary))
            && let Some(at) = ui.input(|i| i.pointer.latest_pos())
        {
            self.viewport.centre = map.to_drawing(at);
        }
        is_pressed || response.hover_pos().is_some_and(|at| map.rect.contains(at))
    }

    pub(super) fn paint_map(
        &self,
        painter: &egui::Painter,
        diagram: &Diagram<Id>,
        colours: &ThemeColours,
    ) {
        let Some(map) = self.map(diagram) else { return };
        let paper = colours.background.gamma_multiply(0.92);
        painter.rect_filled(map.rect.expand(4.0), 4.0, paper);
        let edge = Stroke::new(1.0, colours.outline);
        painter.rect_stroke(map.rect.expand(4.0), 4.0, edge, StrokeKind::Outside);
        let mut dots = Mesh::default();
        for node in &diagram.nodes {
            let area =
                Rect::from_min_max(map.to_window(node.rect.min), map.to_window(node.rect.max));
            let size = area.size().max(Vec2::splat(1.5));
            let colour = match node.mark {
                _ if self.selection.contains(node.item) => colours.accent,
                Mark::Error => colours.error,
                Mark::Warning => colours.warning,
                Mark::None => colours.outline,
            };
            dots.add_colored_rect(Rect::from_min_size(area.min, size), colour);
        }
        painter.add(dots);
        let shown = self.viewport.shown(self.rect).intersect(map.area);
        let frame = Rect::from_min_max(map.to_window(shown.min), map.to_window(shown.max));
        painter.rect_stroke(frame, 2.0, Stroke::new(1.5, colours.accent), StrokeKind::Inside);
    }
}
