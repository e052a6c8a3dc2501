//! The path over the map: A* on the inflated grid, planned again about once a second.

use armor_grid::{CostMap, Grid, Inflation, Occupancy, Point2, Pose2, shortest_path};

/// A path is planned again no more often than this when the map changes, in seconds.
const CHANGED_S: f64 = 0.5;
/// A path is planned again after this in any case, in seconds: the robot has moved.
const RENEW_S: f64 = 1.0;
/// A goal that moved further than this is planned for immediately, in metres.
const GOAL_MOVED_M: f64 = 0.1;
/// How far into the closed border of a wall the robot or its goal may be, in metres.
const BORDER_M: f64 = 0.5;

/// The map and the path over it.
#[derive(Debug)]
pub(crate) struct PlannedPath {
    /// With the margin and, where that leaves no path, without: a map may be a cell thicker than
    /// the world, and close a gap that the robot came through.
    inflations: [Inflation; 2],
    map: Option<Grid<Occupancy>>,
    /// What they cost on the map, as far as it was asked for.
    costs: [Option<CostMap>; 2],
    /// Whether `costs` are older than `map`.
    map_changed: bool,
    goal: Option<Point2>,
    planned_s: f64,
    poses: Vec<Pose2>,
}

impl PlannedPath {
    pub(crate) fn new(inflations: [Inflation; 2]) -> Self {
        Self {
            inflations,
            map: None,
            costs: [None, None],
            map_changed: false,
            goal: None,
            planned_s: f64::NEG_INFINITY,
            poses: Vec::new(),
        }
    }

    /// Takes the newest map, replacing the one before.
    pub(crate) fn map_seen(&mut self, map: Grid<Occupancy>) {
        self.map = Some(map);
        self.map_changed = true;
    }

    /// Takes the newest map out.
    pub(crate) fn take_map(&mut self) -> Option<Grid<Occupancy>> {
        self.map.take()
    }

    /// Drops the map and the path.
    pub(crate) fn forget_map(&mut self) {
        (self.map, self.costs) = (None, [None, None]);
        self.forget_path();
    }

    /// Drops the path, so that the next goal gets a new one.
    pub(crate) fn forget_path(&mut self) {
        self.poses.clear();
        self.goal = None;
    }

    /// Returns the poses from where the robot was when the path was planned to the goal, each
    /// looking at the next, the last one as the goal; empty if no path exists.
    pub(crate) fn path_to(&mut self, goal: Pose2, robot: Point2, now_s: f64) -> &[Pose2] {
        if self.is_due(goal.point(), now_s) {
            self.plan_path(goal.point(), robot);
            self.planned_s = now_s;
        }
        if let Some(last) = self.poses.last_mut() {
            last.yaw_rad = goal.yaw_rad;
        }
        &self.poses
    }

    fn is_due(&self, goal: Point2, now_s: f64) -> bool {
        let age_s = (now_s - self.planned_s).abs();
        let moved = self.goal.is_none_or(|planned| planned.distance_m(goal) > GOAL_MOVED_M);
        moved || age_s >= RENEW_S || (self.map_changed && age_s >= CHANGED_S)
    }

    fn plan_path(&mut self, goal: Point2, robot: Point2) {
        if std::mem::take(&mut self.map_changed) {
            self.costs = [None, None];
        }
        let points = self.map.as_ref().and_then(|map| {
            self.costs.iter_mut().zip(&self.inflations).find_map(|(costs, by)| {
                let costs = costs.get_or_insert_with(|| CostMap::new(map, by));
                search_costs(costs, robot, goal)
            })
        });
        self.poses = looking_ahead(&points.unwrap_or_default());
        self.goal = Some(goal);
    }
}

fn search_costs(costs: &CostMap, robot: Point2, goal: Point2) -> Option<Vec<Point2>> {
    let from = costs.nearest_open(robot, BORDER_M)?;
    let to = costs.nearest_open(goal, BORDER_M)?;
    let mut points = shortest_path(costs, from, to)?;
    // Cells are coarse: the last step goes to the goal itself where a robot may stand there.
    if costs.geometry().cell_at(goal) == to {
        points.pop();
        points.push(goal);
    }
    Some(points)
}

/// Poses at the points, each heading at the next one.
fn looking_ahead(points: &[Point2]) -> Vec<Pose2> {
    let ahead = points.iter().skip(1).chain(points.last());
    let pose =
        |(here, next): (&Point2, &Point2)| Pose2::new(here.x_m, here.y_m, here.bearing_rad(*next));
    points.iter().zip(ahead).map(pose).collect()
}
