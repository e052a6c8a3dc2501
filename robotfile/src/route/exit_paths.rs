//! How a robot gets from any point of a step to another point, and the rally point that is nearest on
//! these paths. It depends on the drawing alone: the same drawing gives the same paths.

use std::collections::BTreeMap;

use armor_geo::{
    Clearance, FreeSpace, MapPoint, MapSegment, PathTree, ShortestPath, VisibilityGraph,
};

use crate::route::clear::{add_radius, find_exit_fault};
use crate::site_map::{DrawnPoint, LineKind, SiteMap, ZoneKind};

/// Paths whose lengths differ by less are of one length, whatever rounding gives.
const SAME_LENGTH_M: f64 = 0.001;

/// The paths from all points of a step to a point.
#[derive(Clone, Debug)]
pub(crate) enum ExitPath {
    /// The straight ones: they are clear.
    Straight,
    /// Some lead around zones; this is the longest, from the worst point of the step.
    Around(ShortestPath),
    /// From some points none was found.
    Blocked,
}

/// Finds the paths of the exits on a map, and keeps what it has found.
pub(crate) struct ExitPaths<'a> {
    map: Option<&'a SiteMap>,
    /// For each radius of a robot.
    surroundings: Vec<Surroundings<'a>>,
    found: BTreeMap<[u64; 7], ExitPath>,
    nearest: BTreeMap<[u64; 5], Option<&'a DrawnPoint>>,
}

/// The map around robots of a radius.
struct Surroundings<'a> {
    radius: Clearance,
    /// None if paths are not led around zones.
    graph: Option<VisibilityGraph<'a>>,
    trees: Vec<PathTree>,
}

impl<'a> ExitPaths<'a> {
    pub(crate) fn new(map: Option<&'a SiteMap>) -> Self {
        Self { map, surroundings: Vec::new(), found: BTreeMap::new(), nearest: BTreeMap::new() }
    }

    pub(crate) fn map(&self) -> Option<&'a SiteMap> {
        self.map
    }

    /// Returns the paths from all points between two to another one, for a robot of this radius.
    pub(crate) fn find_path(
        &mut self,
        (start, end): (MapPoint, MapPoint),
        to: MapPoint,
        radius: Clearance,
    ) -> ExitPath {
        let Some(map) = self.map else { return ExitPath::Straight };
        if find_exit_fault(map, (start, end), to, radius).is_none() {
            return ExitPath::Straight;
        }
        let [[a, b], [c, d], [e, f]] = [start, end, to].map(bits_of);
        let key = [a, b, c, d, e, f, radius.metres().to_bits()];
        if let Some(known) = self.found.get(&key) {
            return known.clone();
        }
        let around = self.surroundings_of(map, radius);
        let longest = around.find_longest((start, end), to, f64::INFINITY);
        let path = longest.map_or(ExitPath::Blocked, ExitPath::Around);
        self.found.insert(key, path.clone());
        path
    }

    /// Returns the rally point to which the longest of the paths from all points between two is
    /// shortest; of several the first in the file. If none is reached from everywhere, that which is
    /// nearest on the straight line.
    pub(crate) fn find_nearest_rally(
        &mut self,
        ends: (MapPoint, MapPoint),
        radius: Clearance,
    ) -> Option<&'a DrawnPoint> {
        let [[a, b], [c, d]] = [ends.0, ends.1].map(bits_of);
        let key = [a, b, c, d, radius.metres().to_bits()];
        if let Some(known) = self.nearest.get(&key) {
            return *known;
        }
        let found = self.choose_rally(ends, radius);
        self.nearest.insert(key, found);
        found
    }

    fn choose_rally(
        &mut self,
        ends: (MapPoint, MapPoint),
        radius: Clearance,
    ) -> Option<&'a DrawnPoint> {
        // The straight distance is convex along the step: it is greatest at one of its ends.
        let straight_m = |rally: &DrawnPoint| {
            let there = rally.position.value.point;
            distance_m(ends.0, there).max(distance_m(ends.1, there))
        };
        let map = self.map?;
        let drawn = map.rallies.iter().enumerate();
        let mut rallies: Vec<_> =
            drawn.map(|(number, rally)| (straight_m(rally), number, rally)).collect();
        rallies.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        let mut reached: Vec<(f64, usize, &DrawnPoint)> = Vec::new();
        let mut least_m = f64::INFINITY;
        for &(straight_m, number, rally) in &rallies {
            // No path is shorter than the straight line.
            if straight_m > least_m + SAME_LENGTH_M {
                break;
            }
            let there = rally.position.value.point;
            let length_m = if find_exit_fault(map, ends, there, radius).is_none() {
                straight_m
            } else {
                let around = self.surroundings_of(map, radius);
                let longest = around.find_longest(ends, there, least_m + SAME_LENGTH_M);
                let Some(longest) = longest else { continue };
                longest.length_m
            };
            least_m = least_m.min(length_m);
            reached.push((length_m, number, rally));
        }
        let shortest = reached.iter().filter(|it| it.0 <= least_m + SAME_LENGTH_M);
        let first = shortest.min_by_key(|it| it.1).map(|it| it.2);
        first.or_else(|| rallies.first().map(|it| it.2))
    }

    fn surroundings_of(&mut self, map: &'a SiteMap, radius: Clearance) -> &mut Surroundings<'a> {
        let is_it = |it: &Surroundings<'_>| it.radius == radius;
        let at = self.surroundings.iter().position(is_it).unwrap_or_else(|| {
            self.surroundings.push(Surroundings::new(map, radius));
            self.surroundings.len() - 1
        });
        &mut self.surroundings[at]
    }
}

impl<'a> Surroundings<'a> {
    fn new(map: &'a SiteMap, radius: Clearance) -> Self {
        // What plans a path around zones does not know lines.
        let has_limits = map.lines.iter().any(|line| line.kind != LineKind::Phase);
        let mut space = FreeSpace::new();
        for zone in &map.zones {
            let clearance = add_radius(zone.margin, radius);
            match zone.kind {
                ZoneKind::NoGo => space.keep_out(&zone.area.value, clearance),
                ZoneKind::StayIn => space.keep_in(&zone.area.value, clearance),
                ZoneKind::Speed | ZoneKind::Observe => {}
            }
        }
        let graph = (!has_limits).then(|| VisibilityGraph::new(space)).flatten();
        Self { radius, graph, trees: Vec::new() }
    }

    fn find_longest(
        &mut self,
        (start, end): (MapPoint, MapPoint),
        to: MapPoint,
        most_m: f64,
    ) -> Option<ShortestPath> {
        let graph = self.graph.as_mut()?;
        let at = match self.trees.iter().position(|tree| tree.goal() == to) {
            Some(at) => at,
            None => {
                self.trees.push(graph.find_paths_to(to));
                self.trees.len() - 1
            }
        };
        graph.find_longest_within(MapSegment::new(start, end), &self.trees[at], most_m)
    }
}

fn bits_of(point: MapPoint) -> [u64; 2] {
    [point.x_m().to_bits(), point.y_m().to_bits()]
}

/// Not `hypot`, whose last digit may differ between computers.
fn distance_m(one: MapPoint, other: MapPoint) -> f64 {
    let (x, y) = (one.x_m() - other.x_m(), one.y_m() - other.y_m());
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests;
