//! Shortest paths through a free space, by a visibility graph: a path bends only where it passes a
//! corner (Lozano-Pérez & Wesley, "An algorithm for planning collision-free paths among polyhedral
//! obstacles", CACM 22, 1979).
//!
//! Only sums, products, quotients and square roots of floats are used, which have the same result on
//! every computer; whether a segment is clear is decided exactly.

mod bends;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::free_space::FreeSpace;
use crate::map_point::MapPoint;
use crate::segment::MapSegment;

/// Most points at which paths may bend. Each two of them may have to be compared with each area.
pub const MAX_BENDS: usize = 1_024;
/// Parts of a segment, as many as are needed to know its longest path to half a part.
const MAX_PARTS: usize = 128;

/// What is known of the view from one bend to another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum View {
    Unknown,
    Clear,
    Blocked,
}

/// A free space, and the points at which the shortest paths through it may bend.
///
/// A round corner of the space, at the distance to keep from a corner of an area or around a circle,
/// is replaced by straight pieces that turn by at most 46° each. So around a corner a path is up to 6 %
/// and a few millimetres longer than the shortest one. A path that leads only through a gap is found if
/// there is room for a distance that is 2 mm and then 9 % larger, at a circle by 9 % of its radius, too.
#[derive(Clone, Debug)]
pub struct VisibilityGraph<'a> {
    space: FreeSpace<'a>,
    bends: Vec<MapPoint>,
    /// Whether the segment between two bends is clear; of bend `b` and a lower `a` at `b (b - 1) / 2 + a`.
    views: Vec<View>,
}

/// The shortest paths from everywhere to one goal.
#[derive(Clone, Debug)]
pub struct PathTree {
    goal: MapPoint,
    /// The length from each bend; infinite if no path leads from there to the goal.
    lengths_m: Vec<f64>,
    /// The bend that follows each; none before the goal.
    next: Vec<Option<usize>>,
}

/// A path: straight from each point to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct ShortestPath {
    /// Where it begins, where it bends, and where it ends.
    pub points: Vec<MapPoint>,
    /// Its length, rounded.
    pub length_m: f64,
}

impl PathTree {
    /// Where the paths lead.
    pub fn goal(&self) -> MapPoint {
        self.goal
    }
}

impl<'a> VisibilityGraph<'a> {
    /// The graph of this space; none if paths may bend at more than [`MAX_BENDS`] points.
    pub fn new(space: FreeSpace<'a>) -> Option<Self> {
        let bends = bends::list_bends(&space)?;
        let pairs = bends.len() * bends.len().saturating_sub(1) / 2;
        Some(Self { space, bends, views: vec![View::Unknown; pairs] })
    }

    /// The space.
    pub fn space(&self) -> &FreeSpace<'a> {
        &self.space
    }

    /// Returns the shortest paths to `goal`, by Dijkstra's algorithm from there. A segment is only
    /// compared with the areas if it makes a path shorter.
    pub fn find_paths_to(&mut self, goal: MapPoint) -> PathTree {
        let count = self.bends.len();
        let mut tree =
            PathTree { goal, lengths_m: vec![f64::INFINITY; count], next: vec![None; count] };
        for (bend, length_m) in tree.lengths_m.iter_mut().enumerate() {
            let last = MapSegment::new(self.bends[bend], goal);
            if self.space.is_clear(last) {
                *length_m = length_of(last);
            }
        }
        let mut open: Vec<usize> = (0..count).collect();
        loop {
            let nearest = open
                .iter()
                .enumerate()
                .filter(|(_, bend)| tree.lengths_m[**bend].is_finite())
                .min_by(|one, two| tree.lengths_m[*one.1].total_cmp(&tree.lengths_m[*two.1]));
            let Some((place, &here)) = nearest else { return tree };
            open.remove(place);
            for &before in &open {
                let step_m = length_of(MapSegment::new(self.bends[before], self.bends[here]));
                let length_m = tree.lengths_m[here] + step_m;
                if length_m < tree.lengths_m[before] && self.sees(before, here) {
                    tree.lengths_m[before] = length_m;
                    tree.next[before] = Some(here);
                }
            }
        }
    }

    fn sees(&mut self, one: usize, other: usize) -> bool {
        let (low, high) = (one.min(other), one.max(other));
        let at = high * high.saturating_sub(1) / 2 + low;
        if self.views[at] == View::Unknown {
            let between = MapSegment::new(self.bends[low], self.bends[high]);
            self.views[at] = if self.space.is_clear(between) { View::Clear } else { View::Blocked };
        }
        self.views[at] == View::Clear
    }

    /// Returns the shortest path of a tree of this graph from a point; none if no path is found.
    pub fn find_path(&self, from: MapPoint, tree: &PathTree) -> Option<ShortestPath> {
        let (length_m, first) = self.find_first(from, tree)?;
        let follow = |bend: &usize| tree.next[*bend];
        let bends = std::iter::successors(first, follow).map(|bend| self.bends[bend]);
        let points = std::iter::once(from).chain(bends).chain([tree.goal]).collect();
        Some(ShortestPath { points, length_m })
    }

    /// The length of the shortest path from a point, and its first bend.
    fn find_first(&self, from: MapPoint, tree: &PathTree) -> Option<(f64, Option<usize>)> {
        let straight = MapSegment::new(from, tree.goal);
        if self.space.is_clear(straight) {
            return Some((length_of(straight), None));
        }
        let through = self.bends.iter().zip(&tree.lengths_m).enumerate();
        let reaching = through.filter(|(_, (_, rest_m))| rest_m.is_finite());
        let mut nearest: BinaryHeap<_> = reaching
            .map(|(number, (bend, rest_m))| {
                let length_m = length_of(MapSegment::new(from, *bend)) + rest_m;
                // The bits of floats that are not negative have the order of the floats.
                Reverse((length_m.to_bits(), number))
            })
            .collect();
        while let Some(Reverse((length_m, bend))) = nearest.pop() {
            if self.space.is_clear(MapSegment::new(from, self.bends[bend])) {
                return Some((f64::from_bits(length_m), Some(bend)));
            }
        }
        None
    }

    /// Returns the longest of the shortest paths from all points of a segment: it is known to within
    /// a 256th of the segment's length. None if the segment is not clear, or from a point that is tried no
    /// path is found.
    ///
    /// From one point of the segment to another one, the length of the path changes by their distance
    /// at most, so that parts which cannot have a longer one are not divided (Piyavskii's algorithm,
    /// USSR Computational Mathematics and Mathematical Physics 12, 1972).
    pub fn find_longest(&self, segment: MapSegment, tree: &PathTree) -> Option<ShortestPath> {
        self.find_longest_within(segment, tree, f64::INFINITY)
    }

    /// The same; none also if it is longer than `most_m`, which is found with less work.
    pub fn find_longest_within(
        &self,
        segment: MapSegment,
        tree: &PathTree,
        most_m: f64,
    ) -> Option<ShortestPath> {
        if !self.space.is_clear(segment) {
            return None;
        }
        let whole_m = length_of(segment);
        let exact_enough_m = whole_m / (2.0 * MAX_PARTS as f64);
        let length_at = |share: f64| {
            let (length_m, _) = self.find_first(segment.point_at(share), tree)?;
            Some(length_m).filter(|length_m| *length_m <= most_m)
        };
        let (start_m, end_m) = (length_at(0.0)?, length_at(1.0)?);
        let (mut worst, mut worst_m) = if start_m < end_m { (1.0, end_m) } else { (0.0, start_m) };
        let mut open = vec![([0.0, 1.0], [start_m, end_m])];
        while let Some(([low, high], [low_m, high_m])) = open.pop() {
            let bound_m = (low_m + high_m + (high - low) * whole_m) / 2.0;
            if bound_m <= worst_m + exact_enough_m {
                continue;
            }
            let middle = f64::midpoint(low, high);
            let middle_m = length_at(middle)?;
            if middle_m > worst_m {
                (worst, worst_m) = (middle, middle_m);
            }
            open.push(([middle, high], [middle_m, high_m]));
            open.push(([low, middle], [low_m, middle_m]));
        }
        self.find_path(segment.point_at(worst), tree)
    }
}

/// Not `hypot`, whose last digit may differ between computers.
fn length_of(segment: MapSegment) -> f64 {
    let (x, y) =
        (segment.end().x_m() - segment.start().x_m(), segment.end().y_m() - segment.start().y_m());
    (x * x + y * y).sqrt()
}

#[cfg(test)]
#[expect(clippy::print_stdout, reason = "the figures")]
mod tests;
