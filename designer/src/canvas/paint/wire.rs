//! Wires, and the one that is being dragged.

use eframe::egui::{Align2, Color32, Pos2, Rect, Shape as Painted, Stroke, StrokeKind, Vec2};

use crate::canvas::bundle::Bundle;
use crate::canvas::curve::{curve, point_at};
use crate::canvas::diagram::DiagramId;
use crate::canvas::edges::{path, wire_ends};
use crate::canvas::hit::Hit;
use crate::canvas::labels::{Label, PORT_ROOM, draw, measure};
use crate::canvas::node::{PortSide, WireEnd};
use crate::canvas::paint::frame::PaintFrame;
use crate::canvas::rules::JoinRules;
use crate::canvas::state::Canvas;
use crate::canvas::viewport::{DETAIL, PLAIN};
use armor_picture::theme::{SMALL, mix};

/// Approximate length of the straight pieces of a curve, in points.
const PIECE: f32 = 10.0;
/// Fewest pieces: a short curve may turn as much as a long one.
const LEAST_PIECES: f32 = 10.0;
const MOST_PIECES: f32 = 24.0;

/// Where on a wire its text may be, as shares of its length, the first one first.
const LABEL_PLACES: [f32; 7] = [0.5, 0.38, 0.62, 0.26, 0.74, 0.16, 0.84];
/// Space around the text of a wire.
const LABEL_MARGIN: f32 = 3.0;
/// Width of the common line of a bundle at actual size.
const TRUNK: f32 = 3.0;
/// Pieces of that line.
const BUNDLE_PIECES: usize = 24;
/// Space at both sides of the number of links in a bundle.
const COUNT_MARGIN: f32 = 6.0;

impl<Id: DiagramId> Canvas<Id> {
    pub(super) fn paint_wire(&mut self, frame: &PaintFrame<'_, Id>, number: usize) {
        let wire = &frame.diagram.wires[number];
        let shift = |node: usize| {
            let is_moved = frame.shift != Vec2::ZERO
                && self.selection.contains(frame.diagram.nodes[node].item);
            if is_moved { frame.shift } else { Vec2::ZERO }
        };
        let Some(ends) = wire_ends(frame.diagram, wire, shift) else { return };
        let (colour, width) = self.wire_ink(frame, number);
        let stroke = Stroke::new(width, colour);
        let [from, to] = ends.map(|(at, _)| self.to_window(at));
        if frame.zoom < PLAIN {
            frame.painter.line_segment([from, to], stroke);
            return;
        }
        let pieces = ((to - from).length() / PIECE).clamp(LEAST_PIECES, MOST_PIECES) as usize;
        if let Some(bundle) = self.closed_bundle(frame.diagram, number) {
            let parts = frame.diagram.bundled_path(bundle, number, shift, BUNDLE_PIECES);
            return parts.into_iter().for_each(|parts| {
                self.paint_bundled(frame, bundle, number, parts, stroke);
            });
        }
        let Some(points) = path(frame.diagram, number, shift, pieces) else { return };
        let points: Vec<Pos2> = points.into_iter().map(|at| self.to_window(at)).collect();
        paint_end(frame, &points, wire.end, stroke);
        let places = LABEL_PLACES.map(|share| point_at(&points, share));
        if wire.is_dashed {
            frame.painter.extend(Painted::dashed_line(&points, stroke, 7.0, 5.0));
        } else {
            frame.painter.add(Painted::line(points, stroke));
        }
        if !wire.text.is_empty() && frame.zoom >= DETAIL {
            let label = Label {
                text: &wire.text,
                size: SMALL,
                room: PORT_ROOM,
                width: 160.0 * frame.zoom,
                colour: frame.colours.text,
                anchor: Align2::CENTER_CENTER,
            };
            let Some(size) = measure(frame.painter, frame.zoom, label) else { return };
            let area = |at: &Pos2| Rect::from_center_size(*at, size).expand(LABEL_MARGIN);
            let is_free = |at: &&Pos2| !self.labels.iter().any(|it| it.intersects(area(at)));
            // Where there is no room, the tooltip has the text.
            let Some(at) = places.iter().find(is_free) else { return };
            self.labels.push(area(at));
            let back = frame.painter.add(Painted::Noop);
            if let Some(rect) = draw(frame.painter, frame.zoom, *at, label) {
                let paper = frame.colours.background.gamma_multiply(0.9);
                frame
                    .painter
                    .set(back, Painted::rect_filled(rect.expand(LABEL_MARGIN), 3.0, paper));
            }
        }
    }

    /// Paints a link in its bundle: its ends, and with the first link the common line with the
    /// number of links.
    fn paint_bundled(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        bundle: &Bundle,
        number: usize,
        [out, trunk, into]: [Vec<Pos2>; 3],
        stroke: Stroke,
    ) {
        let shown = |points: Vec<Pos2>| -> Vec<Pos2> {
            points.into_iter().map(|at| self.to_window(at)).collect()
        };
        let [out, trunk, into] = [out, trunk, into].map(shown);
        frame.painter.add(Painted::line(out, stroke));
        frame.painter.add(Painted::line(into, stroke));
        if bundle.wires.first() != Some(&number) {
            return;
        }
        let zoom = frame.zoom.clamp(0.5, 1.5);
        let colour = if frame.pending.is_some() {
            frame.colours.wire.gamma_multiply(0.4)
        } else {
            frame.colours.wire
        };
        let middle = point_at(&trunk, 0.5);
        let trunk_line = Stroke::new(stroke.width.max(TRUNK * zoom), colour);
        frame.painter.add(Painted::line(trunk, trunk_line));
        if frame.zoom < DETAIL {
            return;
        }
        let count = bundle.wires.len().to_string();
        let label = Label {
            text: &count,
            size: SMALL,
            room: PORT_ROOM,
            width: f32::INFINITY,
            colour: frame.colours.text,
            anchor: Align2::CENTER_CENTER,
        };
        let Some(size) = measure(frame.painter, frame.zoom, label) else { return };
        let margin = Vec2::new(COUNT_MARGIN, 1.0);
        let pill = Rect::from_center_size(middle, size + 2.0 * margin);
        self.labels.push(pill);
        let line = Stroke::new(1.0, colour);
        let (round, paper) = (pill.height() / 2.0, frame.colours.background);
        frame.painter.rect(pill, round, paper, line, StrokeKind::Inside);
        draw(frame.painter, frame.zoom, middle, label);
    }

    fn wire_ink(&self, frame: &PaintFrame<'_, Id>, number: usize) -> (Color32, f32) {
        let wire = &frame.diagram.wires[number];
        let nodes = [wire.from.node, wire.to.node];
        let touches_selected = !self.selection.is_empty()
            && nodes.iter().any(|node| self.selection.contains(frame.diagram.nodes[*node].item));
        let strong = if wire.is_strong { 1.2 } else { 0.0 };
        let zoom = frame.zoom.clamp(0.5, 1.5);
        if !self.selection.is_empty() && self.selection.contains(wire.item) {
            return (frame.colours.accent, (2.8 + strong) * zoom);
        }
        // A hue of its type, so that it can be followed.
        let hue = || {
            let port = frame.diagram.port(wire.from).filter(|port| port.side != PortSide::Around);
            let wire = frame.colours.wire;
            port.map_or(wire, |port| mix(wire, frame.colours.of_type(port.colour), 0.5))
        };
        let own = frame.mark_colour(wire.mark).or(wire.tint).unwrap_or_else(hue);
        let is_hovered = frame.hovered == Some(Hit::Wire(number));
        let width = if is_hovered || touches_selected { 2.6 } else { 1.6 };
        let is_faded = frame.pending.is_some();
        (if is_faded { own.gamma_multiply(0.4) } else { own }, (width + strong) * zoom)
    }

    /// The ends by which the wire that is selected can be led elsewhere.
    pub(super) fn paint_grips(&self, frame: &PaintFrame<'_, Id>) {
        if self.is_busy() {
            return;
        }
        for (_, _, at) in self.grips(frame.diagram) {
            let size = 5.0 * frame.zoom.clamp(0.8, 1.5);
            let line = Stroke::new(2.0, frame.colours.accent);
            frame.painter.circle(self.to_window(at), size, frame.colours.background, line);
        }
    }

    /// The wire that is being dragged, and the result of dropping it here.
    pub(super) fn paint_pending(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        to: Pos2,
        rules: &dyn JoinRules,
    ) {
        let Some((wire, target)) = frame.pending else { return };
        let from = wire.from;
        let Some(start) = frame.diagram.port_position(from) else { return };
        let Some(port) = frame.diagram.port(from) else { return };
        let verdict = target.map(|target| wire.may_end(rules, target));
        let end_at = target.filter(|_| verdict == Some(Ok(())));
        let end = end_at.and_then(|at| frame.diagram.port_position(at)).unwrap_or(to);
        let into = end_at
            .and_then(|at| frame.diagram.port(at))
            .filter(|port| port.side != PortSide::Around)
            .map_or(Vec2::ZERO, |port| port.side.outward());
        let out = if port.side == PortSide::Around { Vec2::ZERO } else { port.side.outward() };
        let colour = match &verdict {
            Some(Ok(())) => frame.colours.connect,
            Some(Err(_)) => frame.colours.weak,
            None => frame.colours.of_type(port.colour),
        };
        let points: Vec<Pos2> = curve([(start, out), (end, into)], 20)
            .into_iter()
            .map(|at| self.to_window(at))
            .collect();
        let stroke = Stroke::new(2.5, colour);
        match verdict {
            Some(Err(why)) => {
                frame.painter.extend(Painted::dashed_line(&points, stroke, 6.0, 5.0));
                let at = self.to_window(to);
                self.paint_hint(frame, at, &why, frame.colours.error);
            }
            Some(Ok(())) => {
                frame.painter.add(Painted::line(points, stroke));
                let name = target.map(|at| frame.diagram.name(at)).unwrap_or_default();
                let at = self.to_window(to);
                let text = format!("to {name}");
                self.paint_hint(frame, at, &text, frame.colours.connect);
            }
            None => {
                frame.painter.add(Painted::line(points, stroke));
            }
        }
    }
}

fn paint_end<Id: DiagramId>(
    frame: &PaintFrame<'_, Id>,
    points: &[Pos2],
    end: WireEnd,
    stroke: Stroke,
) {
    let [.., before, tip] = points else { return };
    let way = (*tip - *before).normalized();
    let across = Vec2::new(-way.y, way.x);
    let size = 8.0 * frame.zoom.clamp(0.4, 1.5);
    let arrow = |tip: Pos2| {
        let base = tip - way * size;
        let points = vec![tip, base + across * size * 0.5, base - across * size * 0.5];
        frame.painter.add(Painted::convex_polygon(points, stroke.color, Stroke::NONE));
    };
    match end {
        WireEnd::Plain => {}
        WireEnd::Arrow => arrow(*tip),
        WireEnd::Double => {
            arrow(*tip);
            arrow(*tip - way * size * 0.8);
        }
        WireEnd::Circle => {
            let dot = Rect::from_center_size(*tip - way * size * 0.5, Vec2::splat(size));
            frame.painter.circle(dot.center(), size * 0.5, frame.colours.background, stroke);
        }
    }
}
