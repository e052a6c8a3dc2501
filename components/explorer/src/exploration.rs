//! Decides where to look next, and when all has been seen. Time is passed in: there is no clock.

use armor_grid::{Grid, Occupancy, Point2, Pose2};

use crate::candidate::{GoalCandidate, ReachableSpace};

/// A new map is looked at no more often than this, in seconds: spreading over it costs time.
const EVALUATION_S: f64 = 0.5;
/// The same map is looked at again after this, in seconds: the robot has moved on.
const REVIEW_S: f64 = 1.0;
/// Goals closer together than this are one pursuit, in metres.
const SAME_PURSUIT_M: f64 = 1.0;
/// Coming this much closer is progress, in metres.
const PROGRESS_M: f64 = 0.2;
/// Learning this much of the world is progress, in square metres.
const PROGRESS_M2: f64 = 0.25;
/// This close to the goal the robot has arrived, in metres.
const ARRIVED_M: f64 = 0.3;
/// The part of the clearance that is kept where the map has closed the path back.
const TIGHT: f64 = 0.7;
/// Frontier cells within this distance of a given-up one are left alone, in metres.
const GIVEN_UP_M: f64 = 0.6;

/// What the robot is and how it shall explore.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExplorerSettings {
    /// Distance the robot's centre keeps from obstacles, in metres.
    pub clearance_m: f64,
    /// Frontiers shorter than this are not worth a trip, in metres: cells times their edge length.
    pub min_frontier_m: f64,
    /// Frontier cells closer to the robot than this will be seen as soon as it moves, in metres.
    pub underfoot_m: f64,
    /// Goals lie this far inside the known free space, in metres.
    pub setback_m: f64,
    /// Metres of detour that a square metre of unseen space is worth.
    pub worth_m_per_m2: f64,
    /// Unseen area that a trip must promise for each metre, in square metres per metre.
    pub least_yield_m2_per_m: f64,
    /// Metres of detour that it is worth not to turn by a radian first.
    pub turn_m_per_rad: f64,
    /// A goal must be better by this to replace the current one, in metres.
    pub switch_gain_m: f64,
    /// A goal without progress for this long is given up, in seconds.
    pub patience_s: f64,
    /// At the goal, a frontier that stays for this long is given up, in seconds.
    pub look_s: f64,
    /// Without a reachable frontier for this long, exploration is done, in seconds.
    pub confirm_s: f64,
}

impl Default for ExplorerSettings {
    fn default() -> Self {
        Self {
            clearance_m: 0.25,
            min_frontier_m: 0.8,
            underfoot_m: 1.0,
            setback_m: 0.2,
            worth_m_per_m2: 1.0,
            least_yield_m2_per_m: 0.2,
            turn_m_per_rad: 0.5,
            switch_gain_m: 1.5,
            patience_s: 8.0,
            look_s: 2.0,
            confirm_s: 1.5,
        }
    }
}

/// What to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExplorerDecision {
    /// Undecided: a map with the robot in it, or a confirmation, is missing.
    Wait,
    /// Drive here, in the map's frame.
    Goto(Pose2),
    /// No reachable frontier is left.
    Done,
}

/// The state of one exploration.
#[derive(Debug)]
pub struct Exploration {
    settings: ExplorerSettings,
    map: Option<Grid<Occupancy>>,
    map_is_new: bool,
    robot: Option<Pose2>,
    /// Its first pose: as it came from there, a path leads back.
    start: Option<Point2>,
    evaluated_s: f64,
    pursuit: Option<Pursuit>,
    given_up: Vec<Point2>,
    /// Since when no frontier is left.
    nothing_since_s: Option<f64>,
    explored_share: Option<f64>,
}

/// The goal being driven to, and the last signs of getting somewhere.
#[derive(Debug)]
struct Pursuit {
    goal: Pose2,
    /// The frontier cell it is for.
    target: Point2,
    /// The path that was left at the last progress, in weighted metres.
    closest_m: f64,
    /// The known area at the last progress.
    known_m2: f64,
    progress_s: f64,
    arrived_s: Option<f64>,
}

impl Exploration {
    /// Starts with nothing known.
    pub fn new(settings: ExplorerSettings) -> Self {
        Self {
            settings,
            map: None,
            map_is_new: false,
            robot: None,
            start: None,
            evaluated_s: f64::NEG_INFINITY,
            pursuit: None,
            given_up: Vec::new(),
            nothing_since_s: None,
            explored_share: None,
        }
    }

    /// Takes the newest map, replacing the one before.
    pub fn map_seen(&mut self, map: Grid<Occupancy>) {
        // A map in which nothing is free: mapping has not begun.
        if map.values().contains(&Occupancy::Free) {
            self.map = Some(map);
            self.map_is_new = true;
        }
    }

    /// Takes the robot's newest pose, in the map's frame.
    pub fn pose_seen(&mut self, world_from_robot: Pose2) {
        if world_from_robot.is_finite() {
            self.robot = Some(world_from_robot);
            self.start.get_or_insert(world_from_robot.point());
        }
    }

    /// Decides at time `now_s`.
    pub fn step(&mut self, now_s: f64) -> ExplorerDecision {
        let Some(robot) = self.robot else { return ExplorerDecision::Wait };
        self.watch_progress(robot, now_s);
        let interval_s = if self.map_is_new { EVALUATION_S } else { REVIEW_S };
        if now_s - self.evaluated_s >= interval_s {
            self.evaluate_map(robot, now_s);
        }
        match (&self.pursuit, self.nothing_since_s) {
            (Some(pursuit), _) => ExplorerDecision::Goto(pursuit.goal),
            (None, Some(since_s)) if now_s - since_s >= self.settings.confirm_s => {
                ExplorerDecision::Done
            }
            _ => ExplorerDecision::Wait,
        }
    }

    /// Returns the share that is explored, 0 … 1: the seen area by the sum of it and the area that
    /// the frontiers promise; `None` before the first map. It falls when the robot looks into a
    /// room that it did not expect.
    pub fn explored_share(&self) -> Option<f64> {
        self.explored_share
    }

    /// Returns the straight distance from the robot to its goal, in metres, if it has one.
    pub fn goal_distance_m(&self) -> Option<f64> {
        let (robot, pursuit) = self.robot.zip(self.pursuit.as_ref())?;
        Some(robot.point().distance_m(pursuit.goal.point()))
    }

    /// Gives up a goal that the robot gets no closer to, or that stays a frontier seen from it.
    fn watch_progress(&mut self, robot: Pose2, now_s: f64) {
        let Some(pursuit) = &mut self.pursuit else { return };
        let arrived = robot.point().distance_m(pursuit.goal.point()) <= ARRIVED_M;
        let arrived_s = pursuit.arrived_s.unwrap_or(now_s).max(pursuit.progress_s);
        pursuit.arrived_s = arrived.then_some(arrived_s);
        let looked = arrived && now_s - arrived_s >= self.settings.look_s;
        if looked || now_s - pursuit.progress_s >= self.settings.patience_s {
            self.given_up.push(pursuit.target);
            self.pursuit = None;
            self.evaluated_s = f64::NEG_INFINITY;
        }
    }

    fn evaluate_map(&mut self, robot: Pose2, now_s: f64) {
        let Some(map) = &self.map else { return };
        self.evaluated_s = now_s;
        self.map_is_new = false;
        let Some(reach) = self.compute_reach(map, robot) else { return };
        let given_up = &self.given_up;
        let avoid = |place: Point2| given_up.iter().any(|g| g.distance_m(place) < GIVEN_UP_M);
        let pursued = self.pursuit.as_ref().map(|pursuit| pursuit.target);
        let candidates = reach.list_candidates(map, &self.settings, pursued, avoid);
        let known = map.values().iter().filter(|&&o| o != Occupancy::Unknown).count();
        let known_m2 = known as f64 * map.geometry().resolution_m.powi(2);
        let expected_m2: f64 = candidates.iter().map(|candidate| candidate.gain_m2).sum();
        self.explored_share = Some(known_m2 / (known_m2 + expected_m2));
        match self.choose_best(&candidates) {
            Some(best) => {
                self.nothing_since_s = None;
                self.pursue_candidate(best, known_m2, now_s);
            }
            None => {
                self.pursuit = None;
                self.nothing_since_s.get_or_insert(now_s);
            }
        }
    }

    /// The places the robot can get to. A map may be a cell thicker than the world and close a gap
    /// that the robot came through: if no path leads back to the start, gaps count as wider.
    fn compute_reach(&self, map: &Grid<Occupancy>, robot: Pose2) -> Option<ReachableSpace> {
        let leads_back =
            |reach: &ReachableSpace| self.start.is_none_or(|start| reach.can_reach(start));
        let clearance_m = self.settings.clearance_m;
        let usual = ReachableSpace::new(map, robot, clearance_m).filter(leads_back);
        usual.or_else(|| ReachableSpace::new(map, robot, TIGHT * clearance_m))
    }

    /// The cheapest candidate, the one being pursued preferred.
    fn choose_best(&self, candidates: &[GoalCandidate]) -> Option<GoalCandidate> {
        let price = |candidate: &GoalCandidate| {
            let pursued = self.pursuit.as_ref().is_some_and(|p| p.is_for(candidate.goal));
            candidate.cost_m - if pursued { self.settings.switch_gain_m } else { 0.0 }
        };
        candidates.iter().min_by(|a, b| price(a).total_cmp(&price(b))).copied()
    }

    fn pursue_candidate(&mut self, best: GoalCandidate, known_m2: f64, now_s: f64) {
        match &mut self.pursuit {
            Some(pursuit) if pursuit.is_for(best.goal) => {
                let learned = known_m2 > pursuit.known_m2 + PROGRESS_M2;
                if learned || best.travel_m < pursuit.closest_m - PROGRESS_M {
                    pursuit.known_m2 = known_m2;
                    pursuit.closest_m = best.travel_m;
                    pursuit.progress_s = now_s;
                }
                (pursuit.goal, pursuit.target) = (best.goal, best.target);
            }
            _ => {
                self.pursuit = Some(Pursuit {
                    goal: best.goal,
                    target: best.target,
                    closest_m: best.travel_m,
                    known_m2,
                    progress_s: now_s,
                    arrived_s: None,
                });
            }
        }
    }
}

impl Pursuit {
    fn is_for(&self, goal: Pose2) -> bool {
        self.goal.point().distance_m(goal.point()) < SAME_PURSUIT_M
    }
}

#[cfg(test)]
#[path = "exploration_tests.rs"]
mod tests;
