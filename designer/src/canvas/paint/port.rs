//! Ports: outputs as triangles that point out, inputs as notches, each in its type's colour.

use eframe::egui::{Align2, Color32, Pos2, Shape as Painted, Stroke, Vec2, vec2};

use crate::canvas::diagram::DiagramId;
use crate::canvas::hit::Hit;
use crate::canvas::labels::{Label, draw};
use crate::canvas::node::{Direction, NodePort, PortAt, PortSide};
use crate::canvas::paint::frame::PaintFrame;
use crate::canvas::rules::JoinRules;
use crate::canvas::state::Canvas;
use armor_picture::theme::{SMALL, mix};

/// How large a port is drawn.
const SIZE: f32 = 5.5;
/// From port to port of a block.
const PORT_ROOM: f32 = 20.0;
/// Space around the names of two ports that face each other.
const NAME_MARGINS: f32 = 30.0;
/// The least share of the width that one of them gets.
const LEAST_SHARE: f32 = 0.38;

impl<Id: DiagramId> Canvas<Id> {
    pub(super) fn paint_ports(
        &mut self,
        frame: &PaintFrame<'_, Id>,
        number: usize,
        shift: Vec2,
        rules: &dyn JoinRules,
    ) {
        let node = &frame.diagram.nodes[number];
        for (p, port) in node.ports.iter().enumerate() {
            // A port without a name is a handle to draw from; it is hidden where nothing can be
            // drawn.
            let is_handle = port.name.is_empty() && !self.is_editable;
            if port.side == PortSide::Around || is_handle {
                continue;
            }
            let here = PortAt { node: number, port: p };
            let at = self.to_window(node.rect.min + port.at + shift);
            if !self.rect.expand(20.0).contains(at) {
                continue;
            }
            let state = state(frame, here, rules);
            let own = frame.colours.of_type(port.colour);
            let colour = match state {
                _ if port.is_missing => frame.colours.error,
                PortState::Refused => mix(own, frame.colours.block, 0.75),
                PortState::Target => frame.colours.connect,
                _ => own,
            };
            self.paint_port(frame, at, (port.side, port.direction), colour, port.is_wired);
            if state == PortState::Refused {
                // Crossed out, so that it differs from a matching one without its colour.
                let reach = SIZE * 1.2 * frame.zoom;
                let line = Stroke::new(1.2, frame.colours.weak);
                for turn in [-1.0, 1.0] {
                    let half = vec2(reach, reach * turn);
                    frame.painter.line_segment([at - half, at + half], line);
                }
            }
            if matches!(state, PortState::Fits | PortState::Target | PortState::Hovered) {
                let radius =
                    (SIZE + if state == PortState::Target { 6.0 } else { 3.5 }) * frame.zoom;
                let width = if state == PortState::Target { 2.5 } else { 1.2 };
                frame.painter.circle_stroke(at, radius, Stroke::new(width, colour));
            }
            let ink = match state {
                PortState::Refused => mix(frame.colours.weak, frame.colours.block, 0.6),
                _ if port.is_missing => frame.colours.error,
                _ if port.is_required && !port.is_wired => frame.colours.text,
                _ => frame.colours.weak,
            };
            let (anchor, away) = match port.side {
                PortSide::Right => (Align2::RIGHT_CENTER, vec2(-11.0, 0.0)),
                PortSide::Top => (Align2::CENTER_TOP, vec2(0.0, 9.0)),
                PortSide::Bottom => (Align2::CENTER_BOTTOM, vec2(0.0, -9.0)),
                _ => (Align2::LEFT_CENTER, vec2(11.0, 0.0)),
            };
            // Two names that face each other share the width by their lengths.
            let letters = |port: &NodePort| port.name.chars().count() as f32;
            let facing = node.ports.iter().filter(|other| {
                other.side != port.side && (other.at.y - port.at.y).abs() < PORT_ROOM / 2.0
            });
            let other = facing.map(letters).fold(0.0, f32::max);
            let share = letters(port) / (letters(port) + other).max(1.0);
            let share = if other > 0.0 { share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE) } else { 1.0 };
            let width = (node.rect.width() - NAME_MARGINS) * share * frame.zoom;
            let label = Label {
                text: &port.name,
                size: SMALL,
                room: PORT_ROOM,
                width,
                colour: ink,
                anchor,
            };
            let name_at = at + away * frame.zoom;
            let name = draw(frame.painter, frame.zoom, name_at, label);
            if port.is_required
                && !port.is_wired
                && let Some(name) = name
            {
                // Must be fed: underlined, so that it is visible without its colour.
                let y = name.max.y - 1.0;
                let line = Stroke::new(1.0, frame.colours.error);
                frame.painter.hline(name.min.x..=name.max.x, y, line);
            }
        }
    }

    fn paint_port(
        &self,
        frame: &PaintFrame<'_, Id>,
        at: Pos2,
        (side, direction): (PortSide, Direction),
        colour: Color32,
        is_wired: bool,
    ) {
        let size = SIZE * frame.zoom;
        let fill = if is_wired { colour } else { frame.colours.background };
        let line = Stroke::new((1.6 * frame.zoom).max(1.0), colour);
        let out = side.outward();
        if direction == Direction::Out {
            // A triangle that points out of the block.
            let across = vec2(-out.y, out.x);
            let tip = at + out * size * 1.25;
            let base = at - out * size * 0.75;
            let points = vec![tip, base + across * size, base - across * size];
            frame.painter.add(Painted::convex_polygon(points, fill, line));
        } else {
            frame.painter.circle(at, size, fill, line);
        }
    }
}

/// Whether a port matches the wire that is being dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PortState {
    Plain,
    Hovered,
    Fits,
    Refused,
    Target,
}

fn state<Id: DiagramId>(
    frame: &PaintFrame<'_, Id>,
    here: PortAt,
    rules: &dyn JoinRules,
) -> PortState {
    match frame.pending {
        Some((wire, _)) if wire.from == here => PortState::Hovered,
        Some((wire, target)) => match wire.may_end(rules, here) {
            Ok(()) if target == Some(here) => PortState::Target,
            Ok(()) => PortState::Fits,
            Err(_) => PortState::Refused,
        },
        None => match frame.hovered {
            Some(Hit::Port(at)) if at == here => PortState::Hovered,
            // The matching ports are shown before the drag begins.
            Some(Hit::Port(at)) if rules.may_join(at, here).is_ok() => PortState::Fits,
            _ => PortState::Plain,
        },
    }
}
