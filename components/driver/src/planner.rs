//! The way over the map: A* on the inflated grid, renewed about once a second.

use armor_grid::{CostMap, Grid, Inflation, Occupancy, Point2, shortest_path, traverse};

/// A way is renewed no more often than this when the map changes, in seconds.
const CHANGED_S: f64 = 0.5;
/// A way is renewed after this in any case, in seconds: the robot has moved.
const RENEW_S: f64 = 1.0;
/// A goal that moved further than this needs a new way at once, in metres.
const GOAL_MOVED_M: f64 = 0.1;
/// How far into the closed border of a wall the robot or its goal may be, in metres.
const BORDER_M: f64 = 0.5;

/// The map and the way over it.
#[derive(Debug)]
pub(crate) struct Planner {
    inflation: Inflation,
    map: Option<Grid<Occupancy>>,
    costs: Option<CostMap>,
    /// Whether `costs` are older than `map`.
    map_changed: bool,
    goal: Option<Point2>,
    planned_s: f64,
    path: Vec<Point2>,
}

impl Planner {
    pub(crate) fn new(inflation: Inflation) -> Self {
        Self {
            inflation,
            map: None,
            costs: None,
            map_changed: false,
            goal: None,
            planned_s: f64::NEG_INFINITY,
            path: Vec::new(),
        }
    }

    /// Takes the newest map, replacing the one before.
    pub(crate) fn map_seen(&mut self, map: Grid<Occupancy>) {
        self.map = Some(map);
        self.map_changed = true;
    }

    /// Returns the newest map.
    pub(crate) fn map(&self) -> Option<&Grid<Occupancy>> {
        self.map.as_ref()
    }

    /// Returns the way, from where the robot was when it was planned; empty if there is none.
    pub(crate) fn path(&self) -> &[Point2] {
        &self.path
    }

    /// Drops the way, so that the next goal gets a new one.
    pub(crate) fn forget(&mut self) {
        self.path.clear();
        self.goal = None;
    }

    /// Renews the way if it is time to; says whether it did.
    pub(crate) fn renew(&mut self, robot: Point2, goal: Point2, now_s: f64) -> bool {
        let age_s = now_s - self.planned_s;
        let moved = self.goal.is_none_or(|planned| planned.distance_m(goal) > GOAL_MOVED_M);
        let changed = self.map_changed && age_s >= CHANGED_S;
        if !(moved || changed || age_s >= RENEW_S) {
            return false;
        }
        if self.map_changed || self.costs.is_none() {
            self.costs = self.map.as_ref().map(|map| CostMap::new(map, &self.inflation));
            self.map_changed = false;
        }
        self.goal = Some(goal);
        self.planned_s = now_s;
        self.path =
            self.costs.as_ref().and_then(|costs| plan(costs, robot, goal)).unwrap_or_default();
        true
    }

    /// Says whether a robot can go straight between two points.
    pub(crate) fn is_straight_open(&self, from: Point2, to: Point2) -> bool {
        self.costs.as_ref().is_some_and(|costs| {
            traverse(costs.geometry(), from, to).all(|cell| costs.is_open(cell))
        })
    }
}

fn plan(costs: &CostMap, robot: Point2, goal: Point2) -> Option<Vec<Point2>> {
    let from = costs.nearest_open(robot, BORDER_M)?;
    let to = costs.nearest_open(goal, BORDER_M)?;
    let mut path = shortest_path(costs, from, to)?;
    // Cells are coarse: the last step goes to the goal itself where a robot may stand there.
    if costs.geometry().cell_at(goal) == to {
        path.pop();
        path.push(goal);
    }
    Some(path)
}
