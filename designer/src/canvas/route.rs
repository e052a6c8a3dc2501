//! Routes around blocks: a wire that passes behind a block cannot be followed by eye.

use eframe::egui::{Pos2, Rect, Vec2};

use crate::canvas::curve::{BELOW, around, curve};
use crate::canvas::search::{find_path, segment_meets};

/// Straight piece between a port and the first turn of a route around blocks.
const STUB: f32 = 16.0;
/// Distance between wires that pass the same block.
const LANE: f32 = 4.0;
/// How far from the two ends blocks are gone around.
const NEAR: f32 = 240.0;
/// Number of straight pieces in which a curve is examined.
const PIECES: usize = 20;
/// Of the block that a wire leaves or enters, its edge does not count.
const EDGE: f32 = 1.5;

/// One end of a wire: where, in which direction it leaves, and whether that direction is fixed.
#[derive(Clone, Copy, Debug)]
pub(super) struct RouteEnd {
    pub(super) at: Pos2,
    pub(super) out: Vec2,
    /// Whether the end is on the side of a block, and not anywhere on its border.
    pub(super) is_sided: bool,
    /// The node.
    pub(super) node: usize,
}

/// How a wire gets from its one end to the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Route {
    /// A smooth curve.
    #[default]
    Curve,
    /// Of a wire that leads back: below everything that is above this line.
    Below(f32),
    /// By these points.
    Along(Vec<Pos2>),
}

/// Whether a wire leads back, against the direction in which links are read.
pub(super) fn leads_back([from, to]: &[RouteEnd; 2]) -> bool {
    let is_sideways = from.out.x > 0.9 && to.out.x < -0.9 && from.is_sided && to.is_sided;
    is_sideways && to.at.x < from.at.x + 10.0
}

/// Returns the route of a wire, by its number, among obstacles, each with the node it belongs to.
pub(super) fn route(obstacles: &[(usize, Rect)], ends: &[RouteEnd; 2], number: usize) -> Route {
    let [from, to] = ends;
    let direct = if leads_back(ends) { Route::Below(low(obstacles, ends)) } else { Route::Curve };
    let extent = Rect::from_points(&points_of(&direct, ends, number)).expand(EDGE);
    let is_near = |rect: &Rect| rect.intersects(extent);
    let crosses = |points: &[Pos2]| {
        obstacles.iter().filter(|(_, rect)| is_near(rect)).any(|(node, rect)| {
            let is_own = *node == from.node || *node == to.node;
            let is_left_out =
                (*node == from.node && !from.is_sided) || (*node == to.node && !to.is_sided);
            let rect = if is_own { rect.shrink(EDGE) } else { rect.expand(EDGE) };
            !is_left_out && points.windows(2).any(|piece| segment_meets(piece[0], piece[1], rect))
        })
    };
    if !crosses(&points_of(&direct, ends, number)) {
        return direct;
    }
    let stub = |end: &RouteEnd| if end.is_sided { end.at + end.out * STUB } else { end.at };
    let (start, goal) = (stub(from), stub(to));
    let area = Rect::from_two_pos(start, goal).expand(NEAR);
    let is_own_border =
        |node: usize| (node == from.node && !from.is_sided) || (node == to.node && !to.is_sided);
    let near =
        obstacles.iter().filter(|(node, rect)| !is_own_border(*node) && rect.intersects(area));
    let near: Vec<Rect> = near.map(|(_, rect)| *rect).collect();
    let Some(mut via) = find_path(start, goal, near, (number % 5) as f32 * LANE) else {
        return direct;
    };
    if from.is_sided {
        via.insert(0, start);
    }
    if to.is_sided {
        via.push(goal);
    }
    if via.is_empty() { direct } else { Route::Along(via) }
}

/// The points of a route that goes around nothing.
fn points_of(route: &Route, [from, to]: &[RouteEnd; 2], number: usize) -> Vec<Pos2> {
    match route {
        Route::Below(low) => below(from.at, to.at, *low, number),
        _ => curve([(from.at, from.out), (to.at, to.out)], PIECES),
    }
}

/// A line that leads back below everything above `low`; several of them keep apart.
pub(super) fn below(from: Pos2, to: Pos2, low: f32, number: usize) -> Vec<Pos2> {
    let lane = (number % 7) as f32 * 7.0;
    around(from, to, low + BELOW + lane, 22.0 + lane)
}

/// The lower edge of the blocks that a wire leading back has to go below.
fn low(obstacles: &[(usize, Rect)], [from, to]: &[RouteEnd; 2]) -> f32 {
    /// Most blocks that it goes below, one after the other.
    const MAX_STEPS: usize = 6;
    let own = obstacles.iter().filter(|(node, _)| *node == from.node || *node == to.node);
    let mut low = own.map(|(_, rect)| rect.max.y).fold(from.at.y.max(to.at.y), f32::max);
    let (left, right) = (to.at.x - 30.0, from.at.x + 30.0);
    for _ in 0..MAX_STEPS {
        let line = low + BELOW;
        let meets = |rect: &&Rect| {
            rect.min.x < right
                && rect.max.x > left
                && rect.min.y < line + BELOW
                && rect.max.y > line - BELOW / 2.0
        };
        let met = obstacles.iter().map(|(_, rect)| rect).filter(meets);
        match met.map(|rect| rect.max.y).reduce(f32::max) {
            Some(lower) if lower > low => low = lower,
            _ => break,
        }
    }
    low
}
