//! From frontiers to places worth driving to: which of them the robot can get to, where it would
//! stand, and what the trip costs.

use std::f64::consts::TAU;

use armor_grid::{
    Cell, CostMap, Grid, Inflation, Occupancy, Point2, Pose2, traverse, wavefront, wrap_angle,
};

use crate::ExplorerSettings;
use crate::frontier::{Frontier, find_frontiers};

/// How far from an obstacle a path costs nothing extra, beyond the closed radius, in metres.
const COMFORT_M: f64 = 0.3;
/// What a metre costs close to an obstacle, on top of its length.
const WEIGHT: f64 = 2.0;
/// A frontier in the grown border of a wall is looked at from at most this far beyond the closed
/// radius, in metres.
const LOOK_M: f64 = 0.3;
/// How far a robot that stands in a closed cell may be from an open one, in metres.
const ESCAPE_M: f64 = 0.5;
/// Unseen areas larger than this count as no larger: one look does not show more, in square metres.
const LARGE_M2: f64 = 4.0;
/// What is unseen counts up to this distance from a frontier, in metres.
const VIEW_M: f64 = 2.5;
/// A long frontier is looked into from places this far apart, in metres.
const APART_M: f64 = 1.25;
/// Directions in which it is looked for.
const VIEW_RAYS: u32 = 72;
/// A trip that is worth this length is worth a longer one, in metres: more lies behind what can
/// be looked into, and a world of any size is to be seen.
const FAR_M: f64 = 10.0;
/// The direction of a trip is that of the place this far along its path, in metres.
const DEPARTURE_M: f64 = 0.8;
/// Frontier cells this close to the one that is pursued are part of the pursuit, in metres.
const PURSUED_M: f64 = 1.0;
/// A metre aside from the middle of a frontier counts as this many of travel.
const ASIDE: f64 = 0.5;

/// A place from which a frontier is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GoalCandidate {
    /// Where to stand, heading at the frontier.
    pub(crate) goal: Pose2,
    /// The frontier cell to be seen from there.
    pub(crate) target: Point2,
    /// The weighted length of the path, in metres.
    pub(crate) travel_m: f64,
    /// The turn and the path less the value of the frontier, in metres; lower is better.
    pub(crate) cost_m: f64,
    /// The unseen area that the frontier promises, in square metres.
    pub(crate) gain_m2: f64,
}

/// The reachable places of one map, and how far away each is.
#[derive(Debug)]
pub(crate) struct ReachableSpace {
    robot: Pose2,
    travel_m: Grid<f32>,
    closed_m: f64,
}

impl ReachableSpace {
    /// Spreads from the robot over the cells that far from obstacles; `None` if it stands nowhere
    /// near one.
    pub(crate) fn new(map: &Grid<Occupancy>, robot: Pose2, clearance_m: f64) -> Option<Self> {
        let inflation = Inflation {
            radius_m: clearance_m,
            comfort_m: clearance_m + COMFORT_M,
            weight: WEIGHT,
            unknown_weight: None,
        };
        let costs = CostMap::new(map, &inflation);
        let start = costs.nearest_open(robot.point(), ESCAPE_M)?;
        let travel_m = wavefront(&costs, start);
        Some(Self { robot, travel_m, closed_m: clearance_m })
    }

    /// Returns whether the robot can get to a place, or as near to it as it may stand to a wall.
    pub(crate) fn can_reach(&self, place: Point2) -> bool {
        let cells = (ESCAPE_M / self.travel_m.geometry().resolution_m) as i32;
        let middle = self.travel_m.geometry().cell_at(place);
        let around =
            (-cells..=cells).flat_map(|r| (-cells..=cells).map(move |c| middle.offset(c, r)));
        around.into_iter().any(|cell| self.is_reached(cell))
    }

    /// Returns one candidate for each reachable frontier that has a place away from `avoid`.
    ///
    /// Of what is underfoot only the frontier around `pursued` counts: the robot would leave it
    /// when it comes near, and turn back to it from afar.
    pub(crate) fn list_candidates(
        &self,
        map: &Grid<Occupancy>,
        settings: &ExplorerSettings,
        pursued: Option<Point2>,
        avoid: impl Fn(Point2) -> bool,
    ) -> Vec<GoalCandidate> {
        let robot = self.robot.point();
        let is_pursued = |place: Point2| pursued.is_some_and(|p| p.distance_m(place) < PURSUED_M);
        let counts =
            |place: Point2| place.distance_m(robot) > settings.underfoot_m || is_pursued(place);
        find_frontiers(map, settings.min_frontier_m, counts)
            .iter()
            .filter_map(|frontier| self.build_candidate(map, frontier, settings, &avoid))
            .collect()
    }

    fn build_candidate(
        &self,
        map: &Grid<Occupancy>,
        frontier: &Frontier,
        settings: &ExplorerSettings,
        avoid: impl Fn(Point2) -> bool,
    ) -> Option<GoalCandidate> {
        let geometry = map.geometry();
        let price = |cell: Cell, stand: Cell| {
            let aside_m = geometry.centre(cell).distance_m(frontier.centre);
            f64::from(self.travel_m[stand]) + ASIDE * aside_m
        };
        let allowed = frontier.cells.iter().filter(|&&cell| !avoid(geometry.centre(cell)));
        let (target, stand) = allowed
            .filter_map(|&cell| Some((cell, self.find_stand(map, cell)?)))
            .min_by(|a, b| price(a.0, a.1).total_cmp(&price(b.0, b.1)))?;
        let stand = self.step_back(stand, settings.setback_m);
        let (position, seen) = (geometry.centre(stand), geometry.centre(target));
        let yaw_rad = if stand == target { 0.0 } else { position.bearing_rad(seen) };
        let travel_m = f64::from(self.travel_m[stand]);
        let turn_m = settings.turn_m_per_rad * self.departure_rad(stand).abs();
        let gain_m2 = unseen_m2(map, &choose_lookouts(map, seen, &frontier.cells));
        if gain_m2 < settings.least_yield_m2_per_m * travel_m.min(FAR_M) {
            return None;
        }
        let worth_m = settings.worth_m_per_m2 * gain_m2.min(LARGE_M2);
        Some(GoalCandidate {
            goal: Pose2::new(position.x_m, position.y_m, yaw_rad),
            target: seen,
            travel_m,
            cost_m: travel_m + turn_m - worth_m,
            gain_m2,
        })
    }

    /// How far the robot has to turn before it leaves for a place, in radians.
    fn departure_rad(&self, to: Cell) -> f64 {
        let geometry = self.travel_m.geometry();
        let mut here = to;
        while f64::from(self.travel_m[here]) > DEPARTURE_M {
            let Some(next) = self.nearer_neighbour(here) else { break };
            here = next;
        }
        let direction_rad = self.robot.point().bearing_rad(geometry.centre(here));
        wrap_angle(direction_rad - self.robot.yaw_rad)
    }

    /// The neighbour that is nearest to the robot, if it is nearer than the cell.
    fn nearer_neighbour(&self, cell: Cell) -> Option<Cell> {
        let reached = cell.neighbours().filter(|&next| self.is_reached(next));
        reached
            .min_by(|a, b| self.travel_m[*a].total_cmp(&self.travel_m[*b]))
            .filter(|&next| self.travel_m[next] < self.travel_m[cell])
    }

    fn is_reached(&self, cell: Cell) -> bool {
        self.travel_m.get(cell).is_some_and(|travel_m| travel_m.is_finite())
    }

    /// The frontier cell itself, or the nearest reached one with nothing in between.
    fn find_stand(&self, map: &Grid<Occupancy>, cell: Cell) -> Option<Cell> {
        if self.is_reached(cell) {
            return Some(cell);
        }
        let geometry = map.geometry();
        let reach = ((self.closed_m + LOOK_M) / geometry.resolution_m) as i32;
        let around =
            (-reach..=reach).flat_map(|r| (-reach..=reach).map(move |c| cell.offset(c, r)));
        around
            .filter(|&stand| self.is_reached(stand) && cell.distance(stand) <= f64::from(reach))
            .filter(|&stand| {
                let mut between = traverse(geometry, geometry.centre(stand), geometry.centre(cell));
                between.all(|cell| map.get(cell) == Some(&Occupancy::Free))
            })
            .min_by(|a, b| cell.distance(*a).total_cmp(&cell.distance(*b)))
    }

    /// Goes back towards the robot: a goal on the very edge of the known is in doubt.
    fn step_back(&self, from: Cell, setback_m: f64) -> Cell {
        let setback = setback_m / self.travel_m.geometry().resolution_m;
        let mut here = from;
        while from.distance(here) < setback {
            let Some(next) = self.nearer_neighbour(here) else { break };
            here = next;
        }
        here
    }
}

/// Places along a frontier, `first` and others as far apart as each shows something of its own.
fn choose_lookouts(map: &Grid<Occupancy>, first: Point2, frontier: &[Cell]) -> Vec<Point2> {
    let mut places = vec![first];
    for cell in frontier {
        let place = map.geometry().centre(*cell);
        if places.iter().all(|other| other.distance_m(place) >= APART_M) {
            places.push(place);
        }
    }
    places
}

/// The unseen area that could be seen from some places, each looking at what is nearest to it, in
/// square metres: up to what is known to stand in the way (the gain of González-Baños & Latombe,
/// "Navigation Strategies for Exploring Indoor Environments", IJRR 2002).
fn unseen_m2(map: &Grid<Occupancy>, places: &[Point2]) -> f64 {
    let step_m = map.geometry().resolution_m;
    let ray_rad = TAU / f64::from(VIEW_RAYS);
    let steps = (VIEW_M / step_m) as u32;
    let mut area_m2 = 0.0;
    for (&from, ray) in places.iter().flat_map(|from| (0..VIEW_RAYS).map(move |ray| (from, ray))) {
        let (sin, cos) = (f64::from(ray) * ray_rad).sin_cos();
        for step in 1..=steps {
            let away_m = f64::from(step) * step_m;
            let there = Point2::new(from.x_m + away_m * cos, from.y_m + away_m * sin);
            let is_nearest = || places.iter().all(|other| other.distance_m(there) >= away_m - 1e-9);
            match map.at(there) {
                Some(Occupancy::Occupied) => break,
                Some(Occupancy::Free) => {}
                // Beyond the edge of the map nothing is known either.
                Some(Occupancy::Unknown) | None if is_nearest() => {
                    area_m2 += away_m * ray_rad * step_m;
                }
                Some(Occupancy::Unknown) | None => {}
            }
        }
    }
    area_m2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::MapDrawing;

    #[test]
    fn a_long_frontier_promises_all_that_lies_behind_it() {
        // 8 m of unseen space, 1 m deep, along a free strip; walls around.
        let row = |what: &str| format!("#{}#", what.repeat(80));
        let unseen = row("?");
        let mut rows = vec![row("#")];
        rows.extend(vec![unseen; 10]);
        rows.extend([row("."), row("."), row("#")]);
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let map = MapDrawing::read(0.1, &rows).map;
        let frontier = &find_frontiers(&map, 0.8, |_| true)[0];
        let end = map.geometry().centre(frontier.cells[0]);
        let places = choose_lookouts(&map, end, &frontier.cells);
        assert!((6..=8).contains(&places.len()), "{} places", places.len());
        let one_m2 = unseen_m2(&map, &[end]);
        let all_m2 = unseen_m2(&map, &places);
        assert!(one_m2 < 4.0 && (7.0..9.0).contains(&all_m2), "{one_m2} m2, {all_m2} m2");
    }
}
