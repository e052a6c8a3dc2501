//! A block: its title, its kind, its ports, what is missing.

use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Pos2, Rect, Shape as Painted, Stroke, StrokeKind, Vec2,
    vec2,
};

use crate::canvas::diagram::DiagramId;
use crate::canvas::hit::Hit;
use crate::canvas::labels::{ALONE, Label, draw};
use crate::canvas::node::{Badge, DiagramNode, Mark, NodeShape, Outline};
use crate::canvas::paint::frame::PaintFrame;
use crate::canvas::rules::JoinRules;
use crate::canvas::state::Canvas;
use crate::canvas::viewport::{DETAIL, PLAIN};
use armor_picture::theme::{HEADING, LEAST_TEXT, SMALL, mix};

/// Space between the edge of a block and its text.
pub(super) const PAD: f32 = 10.0;

impl<Id: DiagramId> Canvas<Id> {
    pub(super) fn paint_node(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        number: usize,
        rules: &dyn JoinRules,
    ) {
        let node = &frame.diagram.nodes[number];
        let is_selected = self.selection.contains(node.item);
        let shift = if is_selected { frame.shift } else { Vec2::ZERO };
        let area = self.viewport.area_to_window(self.rect, node.rect.translate(shift));
        match node.shape {
            NodeShape::Block => self.paint_block(frame, node, area, is_selected, number),
            NodeShape::Place { .. } | NodeShape::Bar => {
                self.paint_net_node(frame, node, area, is_selected, number);
            }
        }
        if frame.zoom >= DETAIL {
            self.paint_ports(frame, number, shift, rules);
        }
        // Both stand next to a bar, which is too narrow for them.
        let margin = if node.shape == NodeShape::Bar { 14.0 * frame.zoom } else { 0.0 };
        let marked = area.expand2(vec2(margin, 0.0));
        if let Some(badge) = &node.badge
            && frame.zoom > PLAIN
        {
            self.paint_badge(frame, marked, badge, node.shape);
        }
        paint_mark(frame, node, marked);
    }

    fn paint_block(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        node: &DiagramNode<Id>,
        area: Rect,
        is_selected: bool,
        number: usize,
    ) {
        let colours = frame.colours;
        let is_hovered = frame.hovered == Some(Hit::Node(number));
        let mut fill =
            if is_hovered { mix(colours.block, colours.text, 0.05) } else { colours.block };
        let line = self.border(frame, node, is_selected);
        if frame.zoom < PLAIN {
            if is_selected {
                fill = colours.accent;
            } else if let Some(tint) = node.look.tint {
                fill = mix(fill, tint, 0.35);
            }
            frame.painter.rect(area, 0.0, fill, Stroke::new(1.0, line.color), StrokeKind::Inside);
            return;
        }
        let round = CornerRadius::same((7.0 * frame.zoom).clamp(1.0, 14.0) as u8);
        if node.look.outline == Outline::Dashed {
            frame.painter.rect_filled(area, round, mix(fill, colours.background, 0.6));
            dashed(frame, area, line);
        } else {
            frame.painter.rect(area, round, fill, line, StrokeKind::Inside);
        }
        if let Some(tint) = node.look.tint {
            let bar = Rect::from_min_size(area.min, vec2(area.width(), 4.0 * frame.zoom));
            let top = CornerRadius { sw: 0, se: 0, ..round };
            frame.painter.rect_filled(bar, top, tint);
        }
        self.paint_texts(frame, node, area);
    }

    fn border(
        &self,
        frame: &PaintFrame<'_, Id>,
        node: &DiagramNode<Id>,
        is_selected: bool,
    ) -> Stroke {
        let colours = frame.colours;
        let colour = match frame.mark_colour(node.mark) {
            _ if is_selected => colours.accent,
            Some(marked) => marked,
            None => colours.outline,
        };
        let width = match node.look.outline {
            _ if is_selected => 2.0,
            Outline::Strong => 2.5,
            _ => 1.0,
        };
        Stroke::new(width, colour)
    }

    fn paint_texts(&mut self, frame: &PaintFrame<'_, Id>, node: &DiagramNode<Id>, area: Rect) {
        let (colours, zoom) = (frame.colours, frame.zoom);
        let text = if node.look.is_dim { colours.weak } else { colours.text };
        let width = area.width() - 2.0 * PAD * zoom;
        let write = |text: &str, size: f32, (y, room): (f32, f32), colour: Color32| {
            let at = area.min + vec2(PAD, y) * zoom;
            let label = Label { text, size, room, width, colour, anchor: Align2::LEFT_CENTER };
            draw(frame.painter, zoom, at, label);
        };
        write(&node.title, HEADING, (18.0, ALONE), text);
        write(&node.subtitle, SMALL, (35.0, 17.0), colours.weak);
        for (n, line) in node.lines.iter().enumerate() {
            let colour = if line.is_weak { colours.weak } else { text };
            write(&line.text, SMALL, (52.0 + 16.0 * n as f32, 16.0), colour);
        }
    }

    /// The number of what is missing: ArMoR's, at the upper right.
    pub(super) fn paint_badge(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        area: Rect,
        badge: &Badge,
        shape: NodeShape,
    ) {
        // Less than this cannot be read.
        let size = 18.0 * frame.zoom.clamp(0.9, 1.3);
        let width = size.max(badge.text.chars().count() as f32 * size * 0.55 + size * 0.4);
        // Mostly above the block, so that it does not cover the name.
        let aside = match shape {
            // A word at a bar would cover its mark: it begins at the middle of the bar.
            NodeShape::Bar => width * 0.5 - area.width() * 0.5,
            _ => -width * 0.35,
        };
        let at = area.right_top() + vec2(aside, -size * 0.4);
        let pill = Rect::from_center_size(at, vec2(width, size));
        let tint = badge.tint.unwrap_or(frame.colours.error);
        frame.painter.rect_filled(pill, size / 2.0, tint);
        frame.painter.text(
            pill.center(),
            Align2::CENTER_CENTER,
            &badge.text,
            FontId::proportional(((size * 0.72 * 2.0).round() / 2.0).max(LEAST_TEXT)),
            if frame.colours.is_dark { Color32::BLACK } else { Color32::WHITE },
        );
    }
}

/// A sign next to what is wrong, so that it is visible without its colour.
fn paint_mark<Id: DiagramId>(frame: &PaintFrame<'_, Id>, node: &DiagramNode<Id>, area: Rect) {
    let Some(colour) = frame.mark_colour(node.mark) else { return };
    if frame.zoom < PLAIN {
        return;
    }
    let size = 9.0 * frame.zoom.clamp(0.55, 1.3);
    let at = area.left_top() + vec2(size * 0.2, 0.0);
    let triangle = vec![
        at + vec2(0.0, -size),
        at + vec2(size * 0.95, size * 0.7),
        at + vec2(-size * 0.95, size * 0.7),
    ];
    let edge = Stroke::new(1.5, frame.colours.background);
    frame.painter.add(Painted::convex_polygon(triangle, colour, edge));
    let ink = if frame.colours.is_dark { Color32::BLACK } else { Color32::WHITE };
    let line = |from: f32, to: f32| [at + vec2(0.0, size * from), at + vec2(0.0, size * to)];
    frame.painter.line_segment(line(-0.45, 0.15), Stroke::new(size * 0.2, ink));
    frame.painter.circle_filled(at + vec2(0.0, size * 0.42), size * 0.13, ink);
    if node.mark == Mark::Error {
        frame.painter.line_segment(
            [at + vec2(-size, size * 0.95), at + vec2(size, size * 0.95)],
            Stroke::new(size * 0.2, colour),
        );
    }
}

/// A broken line around an area.
pub(super) fn dashed<Id: DiagramId>(frame: &PaintFrame<'_, Id>, area: Rect, line: Stroke) {
    let corners: [Pos2; 5] = [
        area.left_top(),
        area.right_top(),
        area.right_bottom(),
        area.left_bottom(),
        area.left_top(),
    ];
    frame.painter.extend(Painted::dashed_line(&corners, line, 6.0, 4.0));
}
