//! What is under a point of the drawing.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::cells::PORT_REACH;
use crate::canvas::curve::distance;
use crate::canvas::diagram::{Diagram, DiagramId};
use crate::canvas::edges::wire_ends;
use crate::canvas::node::{NodeShape, PortAt, PortSide};
use crate::canvas::state::Canvas;
use crate::canvas::viewport::DETAIL;

/// Distance from the border of a node whose port is all around it, at which that port is hit.
const BORDER_REACH: f32 = 5.0;
/// Distance from the middle of a port at which the pointer is on it, in units of the drawing.
const ON_PORT: f32 = 9.0;
/// Distance from a port at which a wire is dropped on it.
const DROP_REACH: f32 = 28.0;
/// Distance from a wire at which it is hit.
const WIRE_REACH: f32 = 6.0;
/// Distance from the end of a selected wire at which the end is grabbed.
const GRIP_REACH: f32 = 9.0;
/// The corner of a decoration by which its size is changed.
pub(super) const CORNER: f32 = 16.0;
/// Width of the edge by which a group is grabbed; a click further inside hits the drawing.
const FRAME_REACH: f32 = 8.0;
/// The height of a group's title.
pub(super) const GROUP_TITLE: f32 = 26.0;

/// What is under the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hit {
    /// A port.
    Port(PortAt),
    /// A node, by number.
    Node(usize),
    /// A wire, by number.
    Wire(usize),
    /// The end of a wire that is selected, by which it is led elsewhere.
    Grip {
        /// The wire's number.
        wire: usize,
        /// The port at its other end.
        stays: PortAt,
    },
    /// A group's title or edge, or a note, by number.
    Decoration(usize),
    /// The corner of one, by which its size is changed.
    Corner(usize),
}

/// The port nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPort {
    /// Which one.
    pub at: PortAt,
    /// How far, in units of the drawing.
    pub distance: f32,
}

impl<Id: DiagramId> Canvas<Id> {
    /// What is under a point of the drawing: ports before nodes before wires before groups. What is
    /// too small to be drawn is not there.
    pub fn hit(&self, diagram: &Diagram<Id>, at: Pos2) -> Option<Hit> {
        let reach = GRIP_REACH / self.viewport.zoom;
        let mut grips = self.grips(diagram).into_iter();
        if let Some((wire, stays, _)) = grips.find(|(_, _, end)| end.distance(at) <= reach) {
            return Some(Hit::Grip { wire, stays });
        }
        let has_ports = self.viewport.zoom >= DETAIL;
        let reach = PORT_REACH / self.viewport.zoom.max(0.5);
        // A handle next to a node must not cover the node itself.
        let is_free = |port: PortAt| {
            let node = &diagram.nodes[port.node];
            let is_outside = diagram
                .port_position(port)
                .is_some_and(|position| !node.rect.expand(1.0).contains(position));
            !(is_outside && node.rect.contains(at))
        };
        let port = self.nearest_port(diagram, at, reach, &is_free).filter(|_| has_ports);
        if let Some(port) = port {
            return Some(Hit::Port(port.at));
        }
        let near = Rect::from_center_size(at, Vec2::splat(1.0));
        let nodes = self.grid.nodes_in(near, diagram.nodes.len());
        let border = BORDER_REACH / self.viewport.zoom.max(0.5);
        for n in nodes.into_iter().rev() {
            let node = &diagram.nodes[n];
            let border = border.min(node.rect.size().min_elem() / 4.0);
            if let Some(port) = node.ports.iter().position(|port| port.side == PortSide::Around)
                && has_ports
                && node.shape != NodeShape::Bar
                && node.rect.expand(border).contains(at)
                && !node.rect.shrink(border).contains(at)
            {
                return Some(Hit::Port(PortAt { node: n, port }));
            }
            if node.rect.contains(at) {
                return Some(Hit::Node(n));
            }
        }
        let near = self.grid.nodes_in(near, diagram.nodes.len());
        if let Some(n) = near.into_iter().rev().find(|n| diagram.area(*n).contains(at)) {
            return Some(Hit::Node(n));
        }
        if let Some(note) = self.decoration(diagram, at, true) {
            return Some(note);
        }
        let reach = WIRE_REACH / self.viewport.zoom;
        let near = Rect::from_center_size(at, Vec2::splat(2.0 * reach));
        let wires = self.grid.wires_in(near, diagram.wires.len());
        let away = |n: &usize| {
            let points = self.wire_path(diagram, *n, |_| Vec2::ZERO, 24);
            points.map_or(f32::INFINITY, |points| distance(&points, at))
        };
        let nearest = wires.iter().map(|n| (away(n), *n)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, wire)) = nearest.filter(|(away, _)| *away <= reach) {
            return Some(Hit::Wire(wire));
        }
        self.decoration(diagram, at, false)
    }

    /// The ends of the wire that is selected, if it is one and can be led elsewhere: its number,
    /// the port at the other end, and where.
    pub(super) fn grips(&self, diagram: &Diagram<Id>) -> Vec<(usize, PortAt, Pos2)> {
        let Some(item) = self.selection.only().filter(|_| self.is_editable) else {
            return Vec::new();
        };
        if diagram.node(item).is_some() {
            return Vec::new();
        }
        let mut wires = diagram.wires.iter().enumerate();
        let Some((n, wire)) = wires.find(|(_, wire)| wire.item == item && wire.is_led) else {
            return Vec::new();
        };
        let ends = wire_ends(diagram, wire, |_| Vec2::ZERO);
        let ends = ends.map(|[(from, _), (to, _)]| vec![(n, wire.to, from), (n, wire.from, to)]);
        ends.unwrap_or_default()
    }

    fn decoration(&self, diagram: &Diagram<Id>, at: Pos2, notes: bool) -> Option<Hit> {
        let corner = CORNER / self.viewport.zoom.min(1.0);
        let reach = FRAME_REACH / self.viewport.zoom;
        let all = diagram.decorations.iter().enumerate().rev().filter(|(_, d)| d.is_note == notes);
        all.filter(|(_, d)| d.rect.expand(2.0).contains(at)).find_map(|(n, decoration)| {
            let rect = decoration.rect;
            let from_corner = rect.max - at;
            if from_corner.x < corner && from_corner.y < corner {
                return Some(Hit::Corner(n));
            }
            let title = Rect::from_min_size(rect.min, Vec2::new(rect.width(), GROUP_TITLE));
            let is_frame = title.contains(at) || !rect.shrink(reach).contains(at);
            (notes || is_frame).then_some(Hit::Decoration(n))
        })
    }

    /// The port nearest to a point, of those that are wanted and within reach.
    pub fn nearest_port(
        &self,
        diagram: &Diagram<Id>,
        at: Pos2,
        reach: f32,
        wanted: &dyn Fn(PortAt) -> bool,
    ) -> Option<NearestPort> {
        let near = Rect::from_center_size(at, Vec2::splat(2.0 * reach));
        let mut best: Option<NearestPort> = None;
        for node in self.grid.nodes_in(near, diagram.nodes.len()) {
            for (port, shown) in diagram.nodes[node].ports.iter().enumerate() {
                let at_port = diagram.nodes[node].rect.min + shown.at;
                let distance = (at_port - at).length();
                let found = NearestPort { at: PortAt { node, port }, distance };
                if shown.side != PortSide::Around
                    && distance <= reach
                    && best.is_none_or(|best| distance < best.distance)
                    && wanted(found.at)
                {
                    best = Some(found);
                }
            }
        }
        best
    }

    /// Where a wire that is let go at a point would end: the port under the point; the nearest that
    /// fits, within reach; else the node's that is under the point, if one of its ports
    /// fits.
    pub(super) fn drop_port(
        &self,
        diagram: &Diagram<Id>,
        at: Pos2,
        fits: &dyn Fn(PortAt) -> bool,
    ) -> Option<PortAt> {
        // Directly on a port that port is meant, even if it does not match.
        if let Some(port) = self.nearest_port(diagram, at, ON_PORT, &|_| true) {
            return Some(port.at);
        }
        let reach = DROP_REACH / self.viewport.zoom.clamp(0.4, 1.5);
        if let Some(port) = self.nearest_port(diagram, at, reach, fits) {
            return Some(port.at);
        }
        let near = Rect::from_center_size(at, Vec2::splat(1.0));
        let nodes = self.grid.nodes_in(near, diagram.nodes.len());
        let node = *nodes.iter().rev().find(|n| diagram.nodes[**n].rect.contains(at))?;
        let ports = (0..diagram.nodes[node].ports.len()).map(|port| PortAt { node, port });
        let mut fitting = ports.clone().filter(|port| fits(*port));
        fitting.next().or_else(|| {
            ports.clone().find(|at| diagram.nodes[at.node].ports[at.port].side == PortSide::Around)
        })
    }
}
