//! The route of a wire from port to port.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::bundle::Bundle;
use crate::canvas::curve::{curve, rounded};
use crate::canvas::diagram::Diagram;
use crate::canvas::diagram::DiagramId;
use crate::canvas::node::{DiagramNode, NodeShape, PortAt, PortSide, Wire};
use crate::canvas::route::{Route, RouteEnd, below};

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

/// The two ends of a wire, for its route: of one that may end anywhere on the border of its node,
/// the middle of the node.
pub(super) fn route_ends<Id: DiagramId>(
    nodes: &[DiagramNode<Id>],
    wire: &Wire<Id>,
) -> Option<[RouteEnd; 2]> {
    let side = |at: PortAt| Some(nodes.get(at.node)?.ports.get(at.port)?.side);
    let at = |at: PortAt| anchor(nodes.get(at.node)?, at, Vec2::ZERO);
    let (start, end) = (at(wire.from)?, at(wire.to)?);
    let way = (end - start).normalized();
    let route_end = |port: PortAt, at: Pos2, way: Vec2| {
        let side = side(port)?;
        let is_sided = side != PortSide::Around;
        let out = if is_sided { side.outward() } else { way };
        Some(RouteEnd { at, out, is_sided, node: port.node })
    };
    Some([route_end(wire.from, start, way)?, route_end(wire.to, end, -way)?])
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
    let nodes = [wire.from.node, wire.to.node];
    let mut ends = wire_ends(diagram, wire, &shift)?;
    let route = diagram.route(number);
    if let Route::Along(via) = route
        && let [Some(first), Some(last)] = [via.first(), via.last()]
        && !is_dragged(nodes, &shift)
    {
        let (from, to) = (diagram.nodes.get(nodes[0])?, diagram.nodes.get(nodes[1])?);
        let start = anchor(from, wire.from, Vec2::ZERO)?;
        let end = anchor(to, wire.to, Vec2::ZERO)?;
        ends[0].0 = border(from, wire.from, start, *first, Vec2::ZERO);
        ends[1].0 = border(to, wire.to, end, *last, Vec2::ZERO);
    }
    Some(lead(diagram, ends, (nodes, route, number), shift, pieces))
}

/// Whether one of two nodes is being dragged: its wires then take no detour.
fn is_dragged(nodes: [usize; 2], shift: &impl Fn(usize) -> Vec2) -> bool {
    nodes.into_iter().any(|node| shift(node) != Vec2::ZERO)
}

/// The points between two ends by a route.
fn lead<Id: DiagramId>(
    diagram: &Diagram<Id>,
    ends: [(Pos2, Vec2); 2],
    (nodes, route, number): ([usize; 2], &Route, usize),
    shift: impl Fn(usize) -> Vec2,
    pieces: usize,
) -> Vec<Pos2> {
    let [(from, out), (to, into)] = ends;
    if pieces <= 1 {
        return vec![from, to];
    }
    let is_dragged = is_dragged(nodes, &shift);
    match route {
        Route::Along(via) if !is_dragged => {
            let corners: Vec<_> =
                [from].into_iter().chain(via.iter().copied()).chain([to]).collect();
            rounded(&corners)
        }
        Route::Below(low) if !is_dragged => below(from, to, *low, number),
        _ if out.x > 0.9 && into.x < -0.9 && to.x < from.x + 10.0 => {
            let bottom = |node: usize| diagram.nodes[node].rect.max.y + shift(node).y;
            below(from, to, bottom(nodes[0]).max(bottom(nodes[1])), number)
        }
        _ => curve(ends, pieces),
    }
}

impl<Id: DiagramId> Diagram<Id> {
    /// A wire in its bundle: from its port to where the links come together, from there to where
    /// they part, and on to the other port.
    pub(super) fn bundled_path(
        &self,
        bundle: &Bundle,
        number: usize,
        shift: impl Fn(usize) -> Vec2,
        pieces: usize,
    ) -> Option<[Vec<Pos2>; 3]> {
        const RIGHT: Vec2 = Vec2::new(1.0, 0.0);
        let [(from, out), (to, into)] = wire_ends(self, self.wires.get(number)?, &shift)?;
        let [start, end] = bundle.ends;
        let [start, end] = [start + shift(bundle.nodes[0]), end + shift(bundle.nodes[1])];
        let ends = [(start, RIGHT), (end, -RIGHT)];
        let trunk =
            lead(self, ends, (bundle.nodes, &bundle.route, bundle.wires[0]), &shift, pieces);
        let fan = pieces.clamp(1, 6);
        Some([
            curve([(from, out), (start, -RIGHT)], fan),
            trunk,
            curve([(end, RIGHT), (to, into)], fan),
        ])
    }
}

impl<Id: DiagramId> Diagram<Id> {
    /// The smallest area with everything in it, wires too; none if there is nothing.
    pub fn extent(&self) -> Option<Rect> {
        let points = (0..self.wires.len()).filter_map(|wire| path(self, wire, |_| Vec2::ZERO, 8));
        let wires = points.map(|points| Rect::from_points(&points));
        self.bounds().into_iter().chain(wires).reduce(Rect::union)
    }
}
