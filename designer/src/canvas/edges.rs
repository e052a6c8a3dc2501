//! The route of a wire from port to port.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::curve::{BELOW, around, curve, through};
use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::node::{DiagramNode, NodeShape, PortAt, PortSide, Wire};

/// Where a wire begins and ends, each with the direction in which it leaves its node; `shift` is
/// how far a node is being dragged.
pub fn wire_ends<Id: DiagramId>(
    diagram: &Diagram<Id>,
    wire: &Wire<Id>,
    shift: impl Fn(usize) -> Vec2,
) -> Option<[(Pos2, Vec2); 2]> {
    let (from, to) = (diagram.nodes.get(wire.from.node)?, diagram.nodes.get(wire.to.node)?);
    let (from_shift, to_shift) = (shift(wire.from.node), shift(wire.to.node));
    let start = anchor(from, wire.from, from_shift)?;
    let end = anchor(to, wire.to, to_shift)?;
    let start_at = border(from, wire.from, start, end, from_shift);
    let end_at = border(to, wire.to, end, start, to_shift);
    let way = (end - start).normalized();
    let outward = |node: &DiagramNode<Id>, at: PortAt, way: Vec2| match node.ports[at.port].side {
        PortSide::Around => way,
        side => side.outward(),
    };
    Some([(start_at, outward(from, wire.from, way)), (end_at, outward(to, wire.to, -way))])
}

fn anchor<Id: DiagramId>(node: &DiagramNode<Id>, at: PortAt, shift: Vec2) -> Option<Pos2> {
    Some(node.rect.min + node.ports.get(at.port)?.at + shift)
}

/// Where a wire to `other` leaves a node that has its port all around.
fn border<Id: DiagramId>(
    node: &DiagramNode<Id>,
    at: PortAt,
    anchor: Pos2,
    other: Pos2,
    shift: Vec2,
) -> Pos2 {
    if node.ports.get(at.port).is_none_or(|port| port.side != PortSide::Around) {
        return anchor;
    }
    let rect = node.rect.translate(shift);
    let way = (other - anchor).normalized();
    match node.shape {
        NodeShape::Place { .. } => {
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

/// Returns the route of a wire as points of the drawing, in about `pieces` pieces. A wire that
/// leads back goes around below both blocks.
pub fn path<Id: DiagramId>(
    diagram: &Diagram<Id>,
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

impl<Id: DiagramId> Diagram<Id> {
    /// The smallest area with everything in it, wires too; none if there is nothing.
    pub fn extent(&self) -> Option<Rect> {
        let points = (0..self.wires.len()).filter_map(|wire| path(self, wire, |_| Vec2::ZERO, 8));
        let wires = points.map(|points| Rect::from_points(&points));
        self.bounds().into_iter().chain(wires).reduce(Rect::union)
    }
}
