//! Bundles: several links between the same two blocks are drawn as one line with their number,
//! until the pointer is at it or one of them is selected.

use std::collections::BTreeMap;

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::diagram::{Diagram, DiagramId};
use crate::canvas::edges::path;
use crate::canvas::hit::Hit;
use crate::canvas::node::{DiagramNode, Mark, PortSide, Wire, WireEnd};
use crate::canvas::route::{Route, RouteEnd, route};
use crate::canvas::state::Canvas;

/// Distance from the blocks to the points where the links come together.
const FAN: f32 = 30.0;
/// A bundle stays open while the pointer is at most so far from its links.
const OPEN_REACH: f32 = 14.0;

/// Links from one block to another that are drawn as one line.
#[derive(Clone, Debug)]
pub(super) struct Bundle {
    /// Their numbers.
    pub(super) wires: Vec<usize>,
    /// The two blocks.
    pub(super) nodes: [usize; 2],
    /// Where the links come together, and where they part.
    pub(super) ends: [Pos2; 2],
    /// The route in between.
    pub(super) route: Route,
}

/// Returns the bundles among the wires of a drawing.
pub(super) fn bundles<Id: DiagramId>(
    nodes: &[DiagramNode<Id>],
    wires: &[Wire<Id>],
    obstacles: &[(usize, Rect)],
) -> Vec<Bundle> {
    let mut joined: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (number, wire) in wires.iter().enumerate().filter(|(_, wire)| is_plain(nodes, wire)) {
        joined.entry((wire.from.node, wire.to.node)).or_default().push(number);
    }
    let several = joined.into_iter().filter(|(_, numbers)| numbers.len() > 1);
    let bundle = |((from, to), numbers): ((usize, usize), Vec<usize>)| {
        let height =
            |ports: &mut dyn Iterator<Item = f32>| ports.sum::<f32>() / numbers.len() as f32;
        let out = |n: &usize| nodes[from].rect.min.y + nodes[from].ports[wires[*n].from.port].at.y;
        let into = |n: &usize| nodes[to].rect.min.y + nodes[to].ports[wires[*n].to.port].at.y;
        let start = Pos2::new(nodes[from].rect.max.x + FAN, height(&mut numbers.iter().map(out)));
        let end = Pos2::new(nodes[to].rect.min.x - FAN, height(&mut numbers.iter().map(into)));
        let right = Vec2::new(1.0, 0.0);
        let ends = [
            RouteEnd { at: start, out: right, is_sided: true, node: from },
            RouteEnd { at: end, out: -right, is_sided: true, node: to },
        ];
        let route = route(obstacles, &ends, numbers[0]);
        Bundle { wires: numbers, nodes: [from, to], ends: [start, end], route }
    };
    several.map(bundle).collect()
}

/// Whether a wire shows nothing of its own. What has a text, a mark or a colour of its own, as in
/// the live view, stays alone: it must be seen.
fn is_plain<Id>(nodes: &[DiagramNode<Id>], wire: &Wire<Id>) -> bool {
    let side = |node: usize, port: usize| Some(nodes.get(node)?.ports.get(port)?.side);
    side(wire.from.node, wire.from.port) == Some(PortSide::Right)
        && side(wire.to.node, wire.to.port) == Some(PortSide::Left)
        && wire.from.node != wire.to.node
        && wire.end == WireEnd::Plain
        && wire.text.is_empty()
        && wire.tint.is_none()
        && wire.mark == Mark::None
        && !wire.is_dashed
        && !wire.is_strong
}

impl<Id: DiagramId> Canvas<Id> {
    /// The bundle that a wire is drawn in now, if its links are not drawn one by one.
    pub(super) fn closed_bundle<'a>(
        &self,
        diagram: &'a Diagram<Id>,
        wire: usize,
    ) -> Option<&'a Bundle> {
        let bundle = diagram.bundle(wire)?;
        let is_selected = |n: &usize| self.selection.contains(diagram.wires[*n].item);
        // Marks, colours and texts may have been given to the wires of a finished drawing.
        let is_plain = |n: &usize| is_plain(&diagram.nodes, &diagram.wires[*n]);
        let is_open = self.open_bundle == Some(ids(diagram, bundle))
            || (!self.selection.is_empty() && bundle.wires.iter().any(is_selected))
            || !bundle.wires.iter().all(is_plain);
        (!is_open).then_some(bundle)
    }

    /// The points of a wire as it is drawn now.
    pub(super) fn wire_path(
        &self,
        diagram: &Diagram<Id>,
        wire: usize,
        shift: impl Fn(usize) -> Vec2,
        pieces: usize,
    ) -> Option<Vec<Pos2>> {
        match self.closed_bundle(diagram, wire) {
            Some(bundle) => {
                let [out, trunk, into] = diagram.bundled_path(bundle, wire, shift, pieces)?;
                Some([out, trunk, into].concat())
            }
            None => path(diagram, wire, shift, pieces),
        }
    }

    /// Opens the bundle under the pointer, and closes it when the pointer has left its links.
    pub(super) fn open_hovered_bundle(
        &mut self,
        diagram: &Diagram<Id>,
        pointer: Option<Pos2>,
        hovered: Option<Hit>,
    ) {
        if self.is_busy() {
            return;
        }
        let bundle = match hovered {
            Some(Hit::Wire(wire) | Hit::Grip { wire, .. }) => {
                diagram.bundle(wire).map(|bundle| ids(diagram, bundle))
            }
            Some(Hit::Port(_) | Hit::Node(_)) => None,
            // Between two links of an open bundle, it stays open.
            _ => self.open_bundle.filter(|open| {
                let bundle = diagram.bundles().iter().find(|it| ids(diagram, it) == *open);
                bundle.zip(pointer).is_some_and(|(bundle, pointer)| {
                    let paths = bundle.wires.iter();
                    let paths = paths.filter_map(|n| path(diagram, *n, |_| Vec2::ZERO, 12));
                    let areas = paths.map(|points| Rect::from_points(&points));
                    let area = areas.reduce(Rect::union).unwrap_or(Rect::NOTHING);
                    area.expand(OPEN_REACH).contains(self.to_drawing(pointer))
                })
            }),
        };
        self.open_bundle = bundle;
    }
}

fn ids<Id: DiagramId>(diagram: &Diagram<Id>, bundle: &Bundle) -> (Id, Id) {
    let [from, to] = bundle.nodes;
    (diagram.nodes[from].item, diagram.nodes[to].item)
}
