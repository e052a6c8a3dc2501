//! Routes around blocks: a wire that passes behind a block cannot be followed by eye.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::curve::{BELOW, curve, through};
use crate::canvas::diagram::DiagramId;
use crate::canvas::node::{DiagramNode, PortAt, PortSide, Wire};

/// Most blocks that a wire goes around.
const MAX_STEPS: usize = 6;
/// Distance between a block and a wire that passes it.
const CLEARANCE: f32 = 12.0;
/// Distance between wires that pass the same block.
const LANE: f32 = 5.0;
/// Number of straight pieces in which a wire is examined.
const PIECES: usize = 20;

/// How a wire gets around the blocks between its ends.
#[derive(Clone, Debug)]
pub(super) struct Detour {
    /// Of one that leads back: the lower edge of what it goes around.
    pub(super) low: f32,
    /// Of one that leads on: points that it passes, from left to right.
    pub(super) via: Vec<Pos2>,
}

/// Returns the route of a wire, by its number.
pub(super) fn detour<Id: DiagramId>(
    nodes: &[DiagramNode<Id>],
    wire: &Wire<Id>,
    number: usize,
) -> Detour {
    let mut detour = Detour { low: f32::NEG_INFINITY, via: Vec::new() };
    let port = |at: PortAt| {
        let node = nodes.get(at.node)?;
        let port = node.ports.get(at.port)?;
        Some((node.rect.min + port.at, port.side))
    };
    let (Some((from, PortSide::Right)), Some((to, PortSide::Left))) =
        (port(wire.from), port(wire.to))
    else {
        return detour;
    };
    if to.x < from.x + 10.0 {
        detour.low = low(nodes, wire);
    } else {
        detour.via = via(nodes, wire, [from, to], (number % 5) as f32 * LANE);
    }
    detour
}

/// The lower edge of the blocks that a wire leading back has to go around.
fn low<Id: DiagramId>(nodes: &[DiagramNode<Id>], wire: &Wire<Id>) -> f32 {
    let (from, to) = (nodes[wire.from.node].rect, nodes[wire.to.node].rect);
    let mut low = from.max.y.max(to.max.y);
    let (left, right) = (to.min.x - 30.0, from.max.x + 30.0);
    // Each time it meets a block it goes below that one; a few are enough to see where it leads.
    for _ in 0..MAX_STEPS {
        let line = low + BELOW;
        let meets = |node: &&DiagramNode<Id>| {
            node.rect.min.x < right
                && node.rect.max.x > left
                && node.rect.min.y < line + BELOW
                && node.rect.max.y > line - BELOW / 2.0
        };
        match nodes.iter().filter(meets).map(|node| node.rect.max.y).reduce(f32::max) {
            Some(lower) if lower > low => low = lower,
            _ => break,
        }
    }
    low
}

/// Points above or below the blocks that a wire leading on would pass behind.
fn via<Id: DiagramId>(
    nodes: &[DiagramNode<Id>],
    wire: &Wire<Id>,
    [from, to]: [Pos2; 2],
    lane: f32,
) -> Vec<Pos2> {
    let ends = [(from, Vec2::new(1.0, 0.0)), (to, Vec2::new(-1.0, 0.0))];
    let near = Rect::from_two_pos(from, to).expand2(Vec2::new(0.0, 60.0));
    let others: Vec<Rect> = nodes
        .iter()
        .enumerate()
        .filter(|(n, node)| {
            *n != wire.from.node && *n != wire.to.node && node.rect.intersects(near)
        })
        .map(|(_, node)| node.rect)
        .collect();
    if others.is_empty() {
        return Vec::new();
    }
    let mut via: Vec<Pos2> = Vec::new();
    let mut passed: Vec<Rect> = Vec::new();
    for _ in 0..MAX_STEPS {
        let points =
            if via.is_empty() { curve(ends, PIECES) } else { through(ends, &via, 2 * PIECES) };
        let met = points.iter().find_map(|at| {
            let block = others.iter().find(|block| block.expand(3.0).contains(*at))?;
            (!passed.contains(block)).then_some((*block, at.y))
        });
        let Some((block, y)) = met else { break };
        passed.push(block);
        let above = block.min.y - CLEARANCE - lane;
        let below = block.max.y + CLEARANCE + lane;
        let is_free = |y: f32| {
            let strip = Rect::from_min_max(
                Pos2::new(block.min.x, y - 2.0),
                Pos2::new(block.max.x, y + 2.0),
            );
            !others.iter().any(|other| other.intersects(strip))
        };
        let mut sides = [above, below];
        sides.sort_by(|a, b| (a - y).abs().total_cmp(&(b - y).abs()));
        let Some(y) = sides.into_iter().find(|y| is_free(*y)) else { continue };
        // Between ends that are too close there is no room to turn.
        let (left, right) = (block.min.x.max(from.x + 20.0), block.max.x.min(to.x - 20.0));
        if left < right {
            via.extend([Pos2::new(left, y), Pos2::new(right, y)]);
            via.sort_by(|a, b| a.x.total_cmp(&b.x));
        }
    }
    via
}
