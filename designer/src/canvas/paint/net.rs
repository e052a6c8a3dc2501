//! The nodes of a net: places as pills with their tokens, transitions as bars.

use eframe::egui::{Align, Align2, Pos2, Rect, Shape as Painted, Stroke, StrokeKind, Vec2, vec2};

use crate::canvas::diagram::DiagramId;
use crate::canvas::hit::Hit;
use crate::canvas::labels::{ALONE, Label, draw, measure};
use crate::canvas::node::{BAR_LINE, BAR_TEXT, DiagramNode, NodeShape, Outline};
use crate::canvas::paint::frame::PaintFrame;
use crate::canvas::state::Canvas;
use crate::canvas::viewport::PLAIN;
use armor_picture::theme::{BODY, LEAST_TEXT, SMALL, mix};

/// Distance from dot to dot of a dotted border, in points.
const DOT_STEP: f32 = 4.5;
/// Pieces of each half circle of that border.
const PILL_PIECES: usize = 12;
/// From line to line in a place.
const LINE: f32 = 16.0;
/// Least height of a line beneath a bar, in points.
const LEAST_LINE: f32 = 15.0;
/// Most tokens that are drawn as dots; more are a number.
const MAX_DOTS: u32 = 4;

impl<Id: DiagramId> Canvas<Id> {
    pub(super) fn paint_net_node(
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
        if let Some(tint) = node.look.tint {
            fill = mix(fill, tint, 0.3);
        }
        let colour = match frame.mark_colour(node.mark) {
            _ if is_selected => colours.accent,
            Some(marked) => marked,
            None => node.look.tint.unwrap_or(colours.outline),
        };
        let width = if is_selected || node.look.outline == Outline::Strong { 2.5 } else { 1.5 };
        let line = Stroke::new(width, colour);
        let is_derived = node.look.is_derived;
        match node.shape {
            NodeShape::Place { tokens, is_goal, is_safety } => {
                let radius = area.height() / 2.0;
                if is_derived && frame.zoom > PLAIN {
                    frame.painter.rect_filled(area, radius, fill);
                    paint_dotted_pill(frame, area, line);
                } else {
                    frame.painter.rect(area, radius, fill, line, StrokeKind::Inside);
                }
                let inner = area.shrink(4.0 * frame.zoom);
                if is_goal && frame.zoom > PLAIN {
                    let thin = Stroke::new(1.0, colour);
                    frame.painter.rect_stroke(inner, radius, thin, StrokeKind::Inside);
                }
                if is_safety && frame.zoom > PLAIN {
                    super::block::dashed(frame, area.expand(3.0 * frame.zoom), line);
                }
                self.paint_place_texts(frame, node, area);
                self.paint_tokens(frame, area, tokens);
            }
            NodeShape::Bar | NodeShape::Block => {
                let ink = if node.look.is_dim { colours.outline } else { colours.text };
                let ink = if is_selected { colours.accent } else { ink };
                let ink = frame.mark_colour(node.mark).filter(|_| !is_selected).unwrap_or(ink);
                let ink = node.look.tint.filter(|_| !is_selected).unwrap_or(ink);
                let round = 2.0 * frame.zoom;
                if is_derived && frame.zoom > PLAIN {
                    let edge = Stroke::new(2.0, ink);
                    let paper = colours.background;
                    frame.painter.rect(area, round, paper, edge, StrokeKind::Inside);
                } else {
                    frame.painter.rect_filled(area, round, ink);
                }
                if is_hovered {
                    let halo = Stroke::new(1.0, colours.accent);
                    frame.painter.rect_stroke(area.expand(3.0), round, halo, StrokeKind::Outside);
                }
                self.paint_bar_texts(frame, number);
            }
        }
    }

    fn paint_place_texts(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        node: &DiagramNode<Id>,
        area: Rect,
    ) {
        let (colours, zoom) = (frame.colours, frame.zoom);
        let width = area.width() - area.height() * 0.6;
        let rows = 1 + node.lines.len() + usize::from(!node.subtitle.is_empty());
        // The name alone stands in the middle.
        let rows = if LINE * zoom < LEAST_TEXT - 0.5 { 1 } else { rows };
        let top = area.center().y - (rows as f32 - 1.0) * LINE / 2.0 * zoom;
        let title = (&node.title, BODY, colours.text);
        let subtitle = (&node.subtitle, SMALL, colours.weak);
        let lines = node.lines.iter().map(|line| (&line.text, SMALL, colours.weak));
        let texts =
            [title, subtitle].into_iter().chain(lines).filter(|(text, ..)| !text.is_empty());
        for (n, (text, size, colour)) in texts.enumerate() {
            let room = if n == 0 { ALONE } else { LINE };
            let at = vec2(area.center().x, top + LINE * n as f32 * zoom).to_pos2();
            let anchor = Align2::CENTER_CENTER;
            draw(frame.painter, zoom, at, Label { text, size, room, width, colour, anchor });
        }
    }

    /// Finds out which lines of the texts of bars have room at this size: a line that would cover
    /// another text or a node is left out, with those after it. The tooltip has all of them.
    pub(super) fn reserve_bar_texts(&mut self, frame: &PaintFrame<'_, Id>, shown: Rect) {
        self.bar_lines.clear();
        for number in self.grid.nodes_in(shown, frame.diagram.nodes.len()) {
            let mut areas = Vec::new();
            for (at, label) in self.bar_labels(frame, number) {
                let Some(size) = measure(frame.painter, frame.zoom, label) else { break };
                let area = label.anchor.anchor_size(at, size);
                let is_covered = self.labels.iter().any(|other| other.intersects(area))
                    || self.covers_node(frame, number, area);
                if is_covered {
                    break;
                }
                areas.push(area);
            }
            let count = areas.len();
            self.labels.extend(areas);
            self.bar_lines.insert(number, count);
        }
    }

    /// Whether an area of the window covers a node other than this one.
    fn covers_node(&self, frame: &PaintFrame<'_, Id>, own: usize, area: Rect) -> bool {
        let nodes = &frame.diagram.nodes;
        let area = Rect::from_min_max(self.to_drawing(area.min), self.to_drawing(area.max));
        let shift = |n: &usize| self.shift_of(frame, *n) - self.shift_of(frame, own);
        let near = self.grid.nodes_in(area, nodes.len()).into_iter().filter(|n| *n != own);
        let mut near = near.filter(|n| shift(n) == Vec2::ZERO);
        near.any(|n| nodes[n].rect.translate(self.shift_of(frame, own)).intersects(area))
    }

    fn shift_of(&self, frame: &PaintFrame<'_, Id>, node: usize) -> Vec2 {
        let is_moved = self.selection.contains(frame.diagram.nodes[node].item);
        if is_moved { frame.shift } else { Vec2::ZERO }
    }

    /// The lines of the text of a bar, each with its point in the window.
    fn bar_labels<'a>(&self, frame: &PaintFrame<'a, Id>, number: usize) -> Vec<(Pos2, Label<'a>)> {
        let (colours, zoom, diagram) = (frame.colours, frame.zoom, frame.diagram);
        let node = &diagram.nodes[number];
        let Some(text) = diagram.bar_text(number) else { return Vec::new() };
        let area = text.area.translate(self.shift_of(frame, number));
        let area = self.viewport.area_to_window(self.rect, area);
        let title = (&node.title, BODY, colours.text);
        let lines = node.lines.iter().map(|line| {
            (&line.text, SMALL, if line.is_weak { colours.weak } else { colours.text })
        });
        let lines = std::iter::once(title).chain(lines).enumerate();
        let lines = lines.filter(|(_, (text, ..))| !text.is_empty());
        let x = match text.align {
            Align::Min => area.left(),
            Align::Center => area.center().x,
            Align::Max => area.right(),
        };
        let anchor = Align2([text.align, Align::Center]);
        // Letters do not get smaller than they can be read: the bar is not covered then either.
        let height = (BAR_LINE * zoom).max(LEAST_LINE);
        let is_above = text.area.max.y <= node.rect.min.y;
        let count = if BAR_LINE * zoom < LEAST_TEXT - 0.5 { 1 } else { 1 + node.lines.len() };
        let top = if is_above { area.bottom() - height * count as f32 } else { area.top() };
        let label = |(n, (text, size, colour)): (usize, (&'a String, f32, _))| {
            let y = top + height * (n as f32 + 0.5);
            let room = if n == 0 { ALONE } else { BAR_LINE };
            let width = BAR_TEXT * zoom;
            (Pos2::new(x, y), Label { text, size, room, width, colour, anchor })
        };
        lines.map(label).collect()
    }

    fn paint_bar_texts(&mut self, frame: &PaintFrame<'_, Id>, number: usize) {
        let count = self.bar_lines.get(&number).copied().unwrap_or(0);
        for (at, label) in self.bar_labels(frame, number).into_iter().take(count) {
            draw(frame.painter, frame.zoom, at, label);
        }
    }

    /// Tokens hang at the upper edge, where no text is.
    fn paint_tokens(&mut self, frame: &PaintFrame<'_, Id>, area: Rect, tokens: u32) {
        if tokens == 0 {
            return;
        }
        let radius = (5.5 * frame.zoom).max(2.5);
        let at = area.center_top();
        if tokens > MAX_DOTS {
            let text = &tokens.to_string();
            frame.painter.circle_filled(at, radius * 1.9, frame.colours.good);
            let (colour, anchor) = (frame.colours.background, Align2::CENTER_CENTER);
            let label =
                Label { text, size: SMALL, room: ALONE, width: f32::INFINITY, colour, anchor };
            draw(frame.painter, frame.zoom, at, label);
            return;
        }
        let step = radius * 2.6;
        let first = at.x - step * (tokens - 1) as f32 / 2.0;
        for n in 0..tokens {
            let dot = vec2(first + step * n as f32, at.y).to_pos2();
            let edge = Stroke::new(1.5, frame.colours.background);
            frame.painter.circle(dot, radius, frame.colours.good, edge);
        }
    }
}

/// The border of a pill as dots, inside its area.
fn paint_dotted_pill<Id: DiagramId>(frame: &PaintFrame<'_, Id>, area: Rect, line: Stroke) {
    let area = area.shrink(line.width / 2.0);
    let radius = area.height() / 2.0;
    let half = area.width() / 2.0 - radius;
    let arc = |side: f32| {
        (0..=PILL_PIECES).map(move |n| {
            let turn = std::f32::consts::PI * n as f32 / PILL_PIECES as f32;
            let at = vec2(side * (half + radius * turn.sin()), -side * radius * turn.cos());
            area.center() + at
        })
    };
    let mut points: Vec<Pos2> = arc(1.0).chain(arc(-1.0)).collect();
    points.extend(points.first().copied());
    let dots = Painted::dotted_line(&points, line.color, DOT_STEP, line.width * 0.6);
    frame.painter.extend(dots);
}
