//! Ports: outputs as triangles that point out, inputs as notches, each in its type's colour.

use std::borrow::Cow;

use eframe::egui::{Align2, Color32, Pos2, Shape as Painted, Stroke, Vec2, vec2};

use crate::canvas::diagram::DiagramId;
use crate::canvas::hit::Hit;
use crate::canvas::labels::{Label, PORT_ROOM, draw, measure};
use crate::canvas::node::{Direction, PortAt, PortSide};
use crate::canvas::paint::frame::PaintFrame;
use crate::canvas::rules::JoinRules;
use crate::canvas::state::Canvas;
use armor_picture::theme::{SMALL, mix};

/// How large a port is drawn.
const SIZE: f32 = 5.5;
/// Space around the names of two ports that face each other.
const NAME_MARGINS: f32 = 30.0;
/// The least share of the width that one of them gets.
const LEAST_SHARE: f32 = 0.38;
/// The same for a port without a link that faces one with a link.
const UNLINKED_SHARE: f32 = 0.2;

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
            let mut label = Label {
                text: &port.name,
                size: SMALL,
                room: PORT_ROOM,
                width: f32::INFINITY,
                colour: ink,
                anchor,
            };
            let measured = |text| {
                let label = Label { text, ..label };
                measure(frame.painter, frame.zoom, label).map_or(0.0, |size| size.x)
            };
            let facing = node.ports.iter().filter(|other| {
                other.side != port.side && (other.at.y - port.at.y).abs() < PORT_ROOM / 2.0
            });
            let facing = facing.map(|it| (measured(&it.name), it.is_wired));
            let facing = facing.reduce(|a, b| (a.0.max(b.0), a.1 || b.1));
            let whole = measured(&port.name);
            let both = (node.rect.width() - NAME_MARGINS) * frame.zoom;
            let width = name_width((whole, port.is_wired), facing, both);
            let on_side = node.ports.iter().filter(|other| other.side == port.side);
            let cut = shorten(&port.name, width / whole, on_side.map(|other| other.name.as_str()));
            label.text = &cut;
            // Sizes are rounded.
            label.width = width + 1.0;
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

/// How wide a name of this width may be, of a port that is linked or not, if both it and the one that
/// it faces are to take no more than `both`: what is linked is read first.
fn name_width((own, is_wired): (f32, bool), facing: Option<(f32, bool)>, both: f32) -> f32 {
    let Some((other, is_other_wired)) = facing.filter(|(other, _)| *other > 0.0) else {
        return both;
    };
    let share = match (is_wired, is_other_wired) {
        _ if own + other <= both => return own,
        (true, false) => 1.0 - (other / both).min(UNLINKED_SHARE),
        (false, true) => 1.0 - (other / both).min(1.0 - UNLINKED_SHARE),
        _ => (own / (own + other)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE),
    };
    // What the other does not need is free.
    own.min((both * share).max(both - other))
}

/// A name of which only a part has room, such that it differs from the others on its side: its end stays
/// if they begin alike, as `ot…2` of `other2`. A name that can be cut at its end is returned whole.
fn shorten<'a>(name: &'a str, part: f32, others: impl Iterator<Item = &'a str>) -> Cow<'a, str> {
    let count = name.chars().count();
    // The dots take the room of a letter.
    let kept = (count as f32 * part) as usize;
    let kept = kept.saturating_sub(1).max(1);
    let alike = |other: &str| name.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
    let alike = others.filter(|other| *other != name).map(alike).max().unwrap_or(0);
    if part >= 1.0 || alike < kept || alike >= count {
        return Cow::Borrowed(name);
    }
    let end = (count - alike).min(kept);
    let mut text: String = name.chars().take(kept - end).collect();
    text.push('…');
    text.extend(name.chars().skip(count - end));
    Cow::Owned(text)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linked_port_keeps_its_name_and_what_it_faces_gets_the_rest() {
        let (linked, unlinked) = ((50.0, true), (35.0, false));
        assert_eq!(name_width(linked, Some(unlinked), 70.0), 50.0);
        assert!((name_width(unlinked, Some(linked), 70.0) - 20.0).abs() < 0.01);
        assert_eq!(name_width(linked, Some(linked), 120.0), 50.0, "both have room");
        assert_eq!(name_width(linked, None, 40.0), 40.0);
        for (a, b) in [(90.0, 80.0), (20.0, 90.0), (50.0, 35.0), (70.0, 1.0)] {
            for (is_a, is_b) in [(true, true), (true, false), (false, true), (false, false)] {
                let (a, b) = ((a, is_a), (b, is_b));
                let sum = name_width(a, Some(b), 70.0) + name_width(b, Some(a), 70.0);
                assert!(sum <= 70.01, "{a:?} and {b:?} take {sum}");
            }
        }
    }

    #[test]
    fn names_that_begin_alike_keep_their_ends() {
        let ports = ["velocity", "other1", "other2", "map", "map_updates"];
        let cut = |name, part| shorten(name, part, ports.into_iter()).into_owned();
        assert_eq!(cut("other1", 0.7), "ot…1");
        assert_eq!(cut("other2", 0.7), "ot…2");
        assert_eq!(cut("other2", 0.1), "…2");
        assert_eq!(cut("other2", 1.0), "other2");
        assert_eq!(cut("map_updates", 0.6), "map_updates", "its beginning differs");
        assert_eq!(cut("velocity", 0.5), "velocity");
    }
}
