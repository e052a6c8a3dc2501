//! The way of a wire from port to port.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::diagram::{Diagram, Node, PortAt, Shape, Side, Wire};

/// How far a curve goes straight on at its ends, at least and at most.
const MIN_REACH: f32 = 30.0;
const MAX_REACH: f32 = 220.0;
/// Between a block and a wire that leads back below it.
pub(super) const BELOW: f32 = 22.0;
/// The curve of a wire at most so many pieces.
const MAX_PIECES: usize = 24;

/// Where a wire begins and ends, each with the way it leaves its node; `shift` is how far a node
/// is being dragged.
pub fn wire_ends(
    diagram: &Diagram,
    wire: &Wire,
    shift: impl Fn(usize) -> Vec2,
) -> Option<[(Pos2, Vec2); 2]> {
    let (from, to) = (diagram.nodes.get(wire.from.node)?, diagram.nodes.get(wire.to.node)?);
    let (from_shift, to_shift) = (shift(wire.from.node), shift(wire.to.node));
    let start = anchor(from, wire.from, from_shift)?;
    let end = anchor(to, wire.to, to_shift)?;
    let start_at = border(from, wire.from, start, end, from_shift);
    let end_at = border(to, wire.to, end, start, to_shift);
    let way = (end - start).normalized();
    let outward = |node: &Node, at: PortAt, way: Vec2| match node.ports[at.port].side {
        Side::Around => way,
        side => side.outward(),
    };
    Some([(start_at, outward(from, wire.from, way)), (end_at, outward(to, wire.to, -way))])
}

fn anchor(node: &Node, at: PortAt, shift: Vec2) -> Option<Pos2> {
    Some(node.rect.min + node.ports.get(at.port)?.at + shift)
}

/// Where a wire to `other` leaves a node that has its port all around.
fn border(node: &Node, at: PortAt, anchor: Pos2, other: Pos2, shift: Vec2) -> Pos2 {
    if node.ports.get(at.port).is_none_or(|port| port.side != Side::Around) {
        return anchor;
    }
    let rect = node.rect.translate(shift);
    let way = (other - anchor).normalized();
    match node.shape {
        Shape::Place { .. } => {
            // A pill: its ends are half circles.
            let radius = rect.height() / 2.0;
            let half = (rect.width() / 2.0 - radius).max(0.0);
            let x = (way.x * half * 4.0).clamp(-half, half);
            rect.center() + Vec2::new(x, 0.0) + (way * radius)
        }
        _ => leaves(rect, way),
    }
}

/// Where a ray from the middle of a rectangle leaves it.
fn leaves(rect: Rect, way: Vec2) -> Pos2 {
    let half = rect.size() / 2.0;
    let x = if way.x.abs() > 1e-6 { half.x / way.x.abs() } else { f32::INFINITY };
    let y = if way.y.abs() > 1e-6 { half.y / way.y.abs() } else { f32::INFINITY };
    let reach = x.min(y);
    if reach.is_finite() { rect.center() + way * reach } else { rect.center() }
}

/// The way of a wire as points of the drawing, in about `pieces` pieces. A wire that leads back goes
/// around below both blocks.
pub fn path(
    diagram: &Diagram,
    number: usize,
    shift: impl Fn(usize) -> Vec2,
    pieces: usize,
) -> Option<Vec<Pos2>> {
    let wire = diagram.wires.get(number)?;
    let ends = wire_ends(diagram, wire, &shift)?;
    let [(from, out), (to, into)] = ends;
    let is_sideways = out.x > 0.9 && into.x < -0.9;
    if pieces > 1 && is_sideways && to.x < from.x + 10.0 {
        let bottom = |node: usize| diagram.nodes[node].rect.max.y + shift(node).y;
        // Several of them keep apart.
        let lane = (number % 7) as f32 * 7.0;
        let own = bottom(wire.from.node).max(bottom(wire.to.node));
        let low = own.max(diagram.low(number)) + BELOW + lane;
        return Some(around(from, to, low, 22.0 + lane));
    }
    let via = diagram.via(number);
    let is_dragged = shift(wire.from.node) != Vec2::ZERO || shift(wire.to.node) != Vec2::ZERO;
    if pieces > 1 && !via.is_empty() && !is_dragged {
        return Some(through(ends, via, pieces));
    }
    Some(curve(ends, pieces))
}

/// A smooth line that passes points from left to right.
pub(super) fn through(
    [(from, out), (to, into)]: [(Pos2, Vec2); 2],
    via: &[Pos2],
    pieces: usize,
) -> Vec<Pos2> {
    const RIGHT: Vec2 = Vec2::new(1.0, 0.0);
    let mut points = Vec::new();
    let mut start = (from, out);
    let each = (pieces / (via.len() + 1)).max(4);
    for at in via {
        points.extend(curve([start, (*at, -RIGHT)], each));
        start = (*at, RIGHT);
    }
    points.extend(curve([start, (to, into)], each));
    points
}

/// Out to the right, below, and back in from the left, with round corners.
fn around(from: Pos2, to: Pos2, low: f32, away: f32) -> Vec<Pos2> {
    let corners = [
        from,
        Pos2::new(from.x + away, from.y),
        Pos2::new(from.x + away, low),
        Pos2::new(to.x - away, low),
        Pos2::new(to.x - away, to.y),
        to,
    ];
    let mut points = vec![from];
    for at in 1..corners.len() - 1 {
        let (before, corner, after) = (corners[at - 1], corners[at], corners[at + 1]);
        let reach =
            ((before - corner).length() / 2.0).min((after - corner).length() / 2.0).min(14.0);
        let enters = corner + (before - corner).normalized() * reach;
        let leaves = corner + (after - corner).normalized() * reach;
        for n in 0..=4 {
            let t = n as f32 / 4.0;
            let (a, b) = (enters + (corner - enters) * t, corner + (leaves - corner) * t);
            points.push(a + (b - a) * t);
        }
    }
    points.push(to);
    points
}

/// The points of a smooth line from one end to the other, each with the way it leaves.
pub fn curve([(from, out), (to, into)]: [(Pos2, Vec2); 2], pieces: usize) -> Vec<Pos2> {
    if pieces <= 1 {
        return vec![from, to];
    }
    let [b, c] = controls([(from, out), (to, into)]);
    let pieces = pieces.min(MAX_PIECES);
    let point = |n: usize| {
        let t = n as f32 / pieces as f32;
        let u = 1.0 - t;
        let (from, b, c, to) = (from.to_vec2(), b.to_vec2(), c.to_vec2(), to.to_vec2());
        (from * (u * u * u) + b * (3.0 * u * u * t) + c * (3.0 * u * t * t) + to * (t * t * t))
            .to_pos2()
    };
    (0..=pieces).map(point).collect()
}

/// The two middle control points of the cubic curve.
pub(super) fn controls([(from, out), (to, into)]: [(Pos2, Vec2); 2]) -> [Pos2; 2] {
    let apart = to - from;
    let reach = apart.length() * 0.4;
    let reach = reach.clamp(MIN_REACH.min(apart.length() / 2.0), MAX_REACH);
    [from + out * reach, to + into * reach]
}

/// How far a point is from a line of points.
pub(super) fn distance(points: &[Pos2], at: Pos2) -> f32 {
    let pieces = points.windows(2).map(|piece| {
        let (a, b) = (piece[0], piece[1]);
        let along = b - a;
        let share = if along.length_sq() > 0.0 {
            ((at - a).dot(along) / along.length_sq()).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (at - (a + along * share)).length()
    });
    pieces.fold(f32::INFINITY, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_begins_and_ends_at_its_ends() {
        let ends = [
            (Pos2::new(0.0, 0.0), Vec2::new(1.0, 0.0)),
            (Pos2::new(200.0, 80.0), Vec2::new(-1.0, 0.0)),
        ];
        let points = curve(ends, 16);
        assert_eq!(points.len(), 17);
        assert_eq!((points[0], points[16]), (ends[0].0, ends[1].0));
        assert!(points[1].y.abs() < points[1].x, "it leaves to the right");
        assert_eq!(curve(ends, 1).len(), 2);
    }

    #[test]
    fn the_distance_is_to_the_nearest_piece() {
        let points = [Pos2::new(0.0, 0.0), Pos2::new(10.0, 0.0), Pos2::new(10.0, 10.0)];
        assert_eq!(distance(&points, Pos2::new(5.0, 3.0)), 3.0);
        assert_eq!(distance(&points, Pos2::new(12.0, 5.0)), 2.0);
    }
}
