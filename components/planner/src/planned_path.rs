//! The path over the map: A* on the inflated grid, planned again about once a second.

use armor_grid::{CostMap, Grid, Inflation, Occupancy, Point2, Pose2, shortest_path};
use armor_zones::ZoneMap;

use crate::zone_costs::ZoneCosts;

/// A path is planned again no more often than this when the map changes, in seconds.
const CHANGED_S: f64 = 0.5;
/// A path is planned again after this in any case, in seconds: the robot has moved.
const RENEW_S: f64 = 1.0;
/// A goal that moved further than this is planned for immediately, in metres.
const GOAL_MOVED_M: f64 = 0.1;
/// Before the next tick, a path is planned no more often than this, in seconds: a goal that moves
/// with every message, such as one that is dragged, costs no more than the ticks.
const EAGER_S: f64 = 0.1;
/// How far into the closed border of a wall the robot or its goal may be, in metres.
const BORDER_M: f64 = 0.5;

/// The map and the path over it.
#[derive(Debug)]
pub(crate) struct PlannedPath {
    /// With the margin and, where that leaves no path, without: a map may be a cell thicker than
    /// the world, and close a gap that the robot came through.
    inflations: [Inflation; 2],
    /// The robot's fastest speed, in metres per second.
    speed_mps: f64,
    map: Option<Grid<Occupancy>>,
    zones: ZoneMap,
    /// What they cost on the map among the zones, as far as it was asked for.
    costs: [Option<CostMap>; 2],
    /// Whether `costs` are older than `map` or `zones`.
    map_changed: bool,
    goal: Option<Point2>,
    planned_s: f64,
    poses: Vec<Pose2>,
    /// The zone that the goal is in, if it is in one that no robot may be in.
    goal_zone: Option<String>,
}

impl PlannedPath {
    pub(crate) fn new(inflations: [Inflation; 2], speed_mps: f64) -> Self {
        Self {
            inflations,
            speed_mps,
            map: None,
            zones: ZoneMap::default(),
            costs: [None, None],
            map_changed: false,
            goal: None,
            planned_s: f64::NEG_INFINITY,
            poses: Vec::new(),
            goal_zone: None,
        }
    }

    /// Takes the newest map, replacing the one before.
    pub(crate) fn map_seen(&mut self, map: Grid<Occupancy>) {
        self.map = Some(map);
        self.map_changed = true;
    }

    /// Takes the newest zones, replacing those before. A path through one that is new must not be
    /// followed any longer.
    pub(crate) fn zones_seen(&mut self, zones: ZoneMap) {
        self.zones = zones;
        self.map_changed = true;
        self.forget_path();
    }

    /// Takes the newest map and zones out.
    pub(crate) fn take_map(&mut self) -> (Option<Grid<Occupancy>>, ZoneMap) {
        (self.map.take(), std::mem::take(&mut self.zones))
    }

    /// Returns the zone that the goal of the last path is in, if no robot may be there.
    pub(crate) fn goal_zone(&self) -> Option<&str> {
        self.goal_zone.as_deref()
    }

    /// Drops the map and the path.
    pub(crate) fn forget_map(&mut self) {
        (self.map, self.costs) = (None, [None, None]);
        self.forget_path();
    }

    /// Drops the path, so that the next goal gets a new one.
    pub(crate) fn forget_path(&mut self) {
        self.poses.clear();
        (self.goal, self.goal_zone) = (None, None);
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

    /// Returns whether a path to this goal is wanted and was not planned just now.
    pub(crate) fn leads_elsewhere(&self, goal: Point2, now_s: f64) -> bool {
        self.has_moved(goal) && (now_s - self.planned_s).abs() >= EAGER_S
    }

    fn has_moved(&self, goal: Point2) -> bool {
        self.goal.is_none_or(|planned| planned.distance_m(goal) > GOAL_MOVED_M)
    }

    fn is_due(&self, goal: Point2, now_s: f64) -> bool {
        let age_s = (now_s - self.planned_s).abs();
        let moved = self.has_moved(goal);
        moved || age_s >= RENEW_S || (self.map_changed && age_s >= CHANGED_S)
    }

    fn plan_path(&mut self, goal: Point2, robot: Point2) {
        if std::mem::take(&mut self.map_changed) {
            self.costs = [None, None];
        }
        let [_, Inflation { radius_m, .. }] = self.inflations;
        let barrier = self.zones.barrier_at(goal, radius_m);
        self.goal_zone = barrier.map(|barrier| barrier.name().to_owned());
        let points = if self.goal_zone.is_none() { self.search_path(robot, goal) } else { None };
        self.poses = looking_ahead(&points.unwrap_or_default());
        self.goal = Some(goal);
    }

    fn search_path(&mut self, robot: Point2, goal: Point2) -> Option<Vec<Point2>> {
        let Self { map, zones, costs, inflations, speed_mps, .. } = self;
        let (map, zones, inflations) = (map.as_ref()?, &*zones, &*inflations);
        costs.iter_mut().zip(inflations).find_map(|(costs, inflation)| {
            let by_zones = ZoneCosts { zones, inflation, speed_mps: *speed_mps };
            let build = |leaving: Option<Point2>| {
                let mut costs = CostMap::new(map, inflation);
                by_zones.apply(&mut costs, leaving);
                costs
            };
            let costs = costs.get_or_insert_with(|| build(None));
            if by_zones.is_too_near(map.geometry(), robot) {
                return search_costs(&build(Some(robot)), robot, costs, goal);
            }
            search_costs(costs, robot, costs, goal)
        })
    }
}

/// `goal_costs` decide where the path may end: a robot may be in a zone that it leaves, but it must
/// not stop there.
fn search_costs(
    costs: &CostMap,
    robot: Point2,
    goal_costs: &CostMap,
    goal: Point2,
) -> Option<Vec<Point2>> {
    let from = costs.nearest_open(robot, BORDER_M)?;
    let to = goal_costs.nearest_open(goal, BORDER_M)?;
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
