//! Bundles: several links between the same two blocks are drawn as one line with their number.
//! `open_bundle.rs` draws them one by one where the user looks.

use std::collections::BTreeMap;

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::node::{DiagramNode, Mark, PortSide, Wire, WireEnd};
use crate::canvas::route::{Route, RouteEnd, route};

/// Distance from the blocks to the points where the links come together.
const FAN: f32 = 30.0;

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
pub(super) fn bundles<Id>(
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
        let (left, right) = (nodes[from].rect.max.x, nodes[to].rect.min.x);
        // Between blocks that are near each other the two ends share the gap.
        let fan = if right > left { FAN.min((right - left) / 2.0) } else { FAN };
        let start = Pos2::new(left + fan, height(&mut numbers.iter().map(out)));
        let end = Pos2::new(right - fan, height(&mut numbers.iter().map(into)));
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
pub(super) fn is_plain<Id>(nodes: &[DiagramNode<Id>], wire: &Wire<Id>) -> bool {
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
