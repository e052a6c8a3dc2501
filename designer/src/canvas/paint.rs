//! Painting the drawing: only what is shown, with less detail the smaller it is.

mod block;
mod frame;
mod net;
mod port;
mod wire;

use eframe::egui::{
    self, Align2, Color32, CornerRadius, Mesh, Pos2, Rect, Shape, Stroke, StrokeKind, Vec2, pos2,
};

use crate::canvas::diagram::{Diagram, DiagramId};
use crate::canvas::gesture::Gesture;
use crate::canvas::gesture::PendingWire;
use crate::canvas::hit::{CORNER, GROUP_TITLE, Hit};
use crate::canvas::labels::{ALONE, Label, SMALLEST, draw, measure, paintable};
use crate::canvas::node::{Decoration, PortAt};
use crate::canvas::paint::frame::PaintFrame;
use crate::canvas::rules::JoinRules;
use crate::canvas::snap::GRID;
use crate::canvas::state::Canvas;
use crate::canvas::viewport::PLAIN;
use armor_picture::theme::{BODY, HEADING, LEAST_TEXT, ThemeColours, mix};

/// Space around the text of a hint.
const HINT_MARGIN: Vec2 = Vec2::new(7.0, 4.0);

impl<Id: DiagramId> Canvas<Id> {
    pub(super) fn paint(
        &mut self,
        ui: &egui::Ui,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
        hovered: Option<Hit>,
        colours: &ThemeColours,
    ) {
        let painter = ui.painter().with_clip_rect(self.rect.intersect(ui.clip_rect()));
        painter.rect_filled(self.rect, 0.0, colours.background);
        self.labels.clear();
        let pending = self.pending(diagram, rules);
        let frame = PaintFrame {
            painter: &painter,
            diagram,
            colours,
            shift: self.gesture.shift(),
            hovered: hovered.filter(|_| !self.is_busy()),
            zoom: self.viewport.zoom,
            pending,
        };
        if self.has_dots {
            self.paint_grid(&frame);
        }
        let margin = if frame.shift == Vec2::ZERO { 0.0 } else { frame.shift.length() };
        let shown = self.viewport.shown(self.rect).expand(margin + 10.0);
        for (n, decoration) in diagram.decorations.iter().enumerate().filter(|(_, d)| !d.is_note) {
            self.paint_decoration(&frame, n, decoration);
        }
        self.reserve_bar_texts(&frame, shown);
        for wire in self.grid.wires_in(shown, diagram.wires.len()) {
            self.paint_wire(&frame, wire);
        }
        for node in self.grid.nodes_in(shown, diagram.nodes.len()) {
            if shown.intersects(diagram.nodes[node].rect) {
                self.paint_node(&frame, node, rules);
            }
        }
        for (n, decoration) in diagram.decorations.iter().enumerate().filter(|(_, d)| d.is_note) {
            self.paint_decoration(&frame, n, decoration);
        }
        self.paint_grips(&frame);
        self.paint_gesture(&frame, rules);
        if self.minimap {
            self.paint_map(&painter, diagram, colours);
        }
    }

    /// The wire that is being dragged: its port, and the one that it would end at.
    fn pending(
        &self,
        diagram: &Diagram<Id>,
        rules: &dyn JoinRules,
    ) -> Option<(PendingWire, Option<PortAt>)> {
        let Gesture::Wire { from, to, taken, .. } = self.gesture else { return None };
        let wire = PendingWire { from, taken };
        let fits = |port| port != from && wire.may_end(rules, port).is_ok();
        Some((wire, self.drop_port(diagram, to, &fits).filter(|port| *port != from)))
    }

    fn paint_grid(&self, frame: &PaintFrame<'_, Id>) {
        let mut step = GRID * 2.0;
        while step * frame.zoom < 20.0 {
            step *= 2.0;
        }
        let shown = self.viewport.shown(self.rect);
        let first = |from: f32| (from / step).ceil() * step;
        let side = 1.6;
        // There are thousands of them: one mesh costs a tenth of as many shapes.
        let mut dots = Mesh::default();
        let mut y = first(shown.min.y);
        while y < shown.max.y {
            let mut x = first(shown.min.x);
            while x < shown.max.x {
                let at = self.to_window(pos2(x, y));
                let dot = Rect::from_center_size(at, Vec2::splat(side));
                dots.add_colored_rect(dot, frame.colours.grid);
                x += step;
            }
            y += step;
        }
        frame.painter.add(dots);
    }

    fn paint_decoration(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        number: usize,
        decoration: &Decoration<Id>,
    ) {
        let is_selected = self.selection.contains(decoration.item);
        let mut area = decoration.rect;
        if let Gesture::Resize { number: n, rect } = &self.gesture
            && *n == number
        {
            area = *rect;
        } else if is_selected {
            area = area.translate(frame.shift);
        }
        let area = self.viewport.area_to_window(self.rect, area);
        if !area.intersects(self.rect) {
            return;
        }
        let colours = frame.colours;
        let (fill, line) = if decoration.is_note {
            (colours.note, mix(colours.note, colours.text, 0.2))
        } else {
            (colours.group, colours.grid)
        };
        let line = if is_selected { colours.accent } else { line };
        let stroke = Stroke::new(if is_selected { 2.0 } else { 1.0 }, line);
        let round = CornerRadius::same((6.0 * frame.zoom).clamp(0.0, 12.0) as u8);
        frame.painter.rect(area, round, fill, stroke, StrokeKind::Inside);
        if decoration.is_note {
            self.paint_note(frame, area, &decoration.text);
        } else {
            let title = Label {
                text: &decoration.text,
                size: HEADING,
                room: ALONE,
                width: area.width() - 16.0 * frame.zoom,
                colour: colours.weak,
                anchor: Align2::LEFT_CENTER,
            };
            let at = area.min + Vec2::new(10.0, GROUP_TITLE / 2.0) * frame.zoom;
            draw(frame.painter, frame.zoom, at, title);
        }
        if self.is_editable && frame.zoom > PLAIN {
            for reach in [0.35, 0.65] {
                let from = area.max - Vec2::new(CORNER * reach, 3.0) * frame.zoom;
                let to = area.max - Vec2::new(3.0, CORNER * reach) * frame.zoom;
                frame.painter.line_segment([from, to], Stroke::new(1.0, colours.weak));
            }
        }
    }

    fn paint_note(&mut self, frame: &PaintFrame<'_, Id>, area: Rect, text: &str) {
        let size = BODY * frame.zoom;
        if size < SMALLEST {
            return;
        }
        let shown = paintable(frame.painter.ctx(), text).into_owned();
        let font = egui::FontId::proportional(((size * 2.0).round() / 2.0).max(LEAST_TEXT));
        let inner = area.shrink(9.0 * frame.zoom);
        let galley = frame.painter.layout(shown, font, frame.colours.text, inner.width().max(10.0));
        frame.painter.with_clip_rect(inner.intersect(frame.painter.clip_rect())).galley(
            inner.min,
            galley,
            frame.colours.text,
        );
    }

    /// Paints the gesture at the pointer.
    fn paint_gesture(&mut self, frame: &PaintFrame<'_, Id>, rules: &dyn JoinRules) {
        let colours = frame.colours;
        match self.gesture.clone() {
            Gesture::Band { from, to, .. } => {
                let area = Rect::from_two_pos(self.to_window(from), self.to_window(to));
                let stroke = Stroke::new(1.0, colours.accent);
                let fill = colours.accent.gamma_multiply(0.12);
                frame.painter.rect(area, 0.0, fill, stroke, StrokeKind::Inside);
            }
            Gesture::Wire { to, .. } => self.paint_pending(frame, to, rules),
            _ => {}
        }
    }

    /// Shows a hint next to the pointer.
    fn paint_hint(&mut self, frame: &PaintFrame<'_, Id>, at: Pos2, text: &str, colour: Color32) {
        let label = Label {
            text,
            size: BODY,
            room: ALONE,
            width: 420.0,
            colour,
            anchor: Align2::LEFT_CENTER,
        };
        // It stays in the drawing, also at its right edge.
        let paper = HINT_MARGIN + Vec2::splat(1.0);
        let text_size = measure(frame.painter, 1.0, label).unwrap_or_default();
        let most = self.rect.max - text_size - paper - Vec2::new(0.0, text_size.y);
        let at = (at + Vec2::new(18.0, 18.0)).min(most).max(self.rect.min + paper);
        let shape = frame.painter.add(Shape::Noop);
        if let Some(rect) = draw(frame.painter, 1.0, at, label) {
            let stroke = Stroke::new(1.0, colour);
            let paper = frame.colours.block;
            let back = egui::epaint::RectShape::new(
                rect.expand2(HINT_MARGIN),
                4.0,
                paper,
                stroke,
                StrokeKind::Outside,
            );
            frame.painter.set(shape, back);
        }
    }
}
