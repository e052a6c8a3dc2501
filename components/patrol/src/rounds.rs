//! Which waypoint is next: reached, waited at, given up; lap after lap. Time is passed in.

use armor_grid::Point2;

/// The settings of a patrol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatrolSettings {
    /// How many times the route is driven; 0 is without end.
    pub laps: u32,
    /// A waypoint is reached within this, in metres.
    pub tolerance_m: f64,
    /// How long the robot stays at each, in seconds.
    pub stay_s: f64,
    /// A waypoint that the robot comes no nearer to for this long is given up, in seconds.
    pub patience_s: f64,
}

/// What to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatrolStep {
    /// Nothing: it is not known where the robot is.
    Wait,
    /// Drive there.
    Goto(Point2),
    /// This waypoint is reached; numbered from 1. Ask again what to do.
    Reached(usize),
    /// This waypoint is given up; numbered from 1. Ask again what to do.
    Skipped(usize),
    /// So many laps are walked. Ask again what to do.
    Lap(u32),
    /// All laps are walked.
    Done,
    /// Not one waypoint of a lap could be reached.
    Stuck,
}

/// How far a patrol has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatrolProgress {
    /// The waypoint being driven to, numbered from 1, and the number of waypoints.
    pub waypoint: (usize, usize),
    /// The lap, numbered from 1, and the number of laps; 0 is without end.
    pub lap: (u32, u32),
    /// The straight distance to the waypoint, in metres, if the robot's position is known.
    pub distance_m: Option<f64>,
    /// The share of all waypoints of all laps that lie behind the robot, 0 … 1; `None` without end.
    pub done_share: Option<f64>,
}

/// Nearer by this is progress, in metres.
const PROGRESS_M: f64 = 0.1;

/// A patrol in progress.
#[derive(Clone, Debug)]
pub struct Rounds {
    route: Vec<Point2>,
    settings: PatrolSettings,
    robot: Option<Point2>,
    next: usize,
    laps: u32,
    /// Waypoints reached in this lap.
    reached: usize,
    /// The robot is at the waypoint since then.
    there_since_s: Option<f64>,
    /// The least distance to the waypoint so far, and when it was last bettered.
    nearest: Option<(f64, f64)>,
}

impl Rounds {
    /// A patrol along `route`, which has at least one waypoint.
    pub fn new(route: Vec<Point2>, settings: PatrolSettings) -> Self {
        Self {
            route,
            settings,
            robot: None,
            next: 0,
            laps: 0,
            reached: 0,
            there_since_s: None,
            nearest: None,
        }
    }

    /// Returns whether it is known where the robot is.
    pub fn is_robot_known(&self) -> bool {
        self.robot.is_some()
    }

    /// Takes the robot's position on the map.
    pub fn robot_seen(&mut self, robot: Point2) {
        self.robot = Some(robot);
    }

    /// Returns the waypoint that is next; `None` between two laps and after the last one.
    pub fn waypoint(&self) -> Option<Point2> {
        self.route.get(self.next).copied()
    }

    /// Decides at time `now_s`.
    pub fn step(&mut self, now_s: f64) -> PatrolStep {
        if self.next == self.route.len() {
            return self.end_lap();
        }
        let Some(robot) = self.robot else { return PatrolStep::Wait };
        let goal = self.route[self.next];
        let distance_m = robot.distance_m(goal);
        if distance_m <= self.settings.tolerance_m || self.there_since_s.is_some() {
            let since_s = *self.there_since_s.get_or_insert(now_s);
            if now_s - since_s < self.settings.stay_s {
                return PatrolStep::Goto(goal);
            }
            self.reached += 1;
            return PatrolStep::Reached(self.leave_waypoint());
        }
        let (nearest_m, since_s) = *self.nearest.get_or_insert((distance_m, now_s));
        if distance_m < nearest_m - PROGRESS_M {
            self.nearest = Some((distance_m, now_s));
        } else if now_s - since_s >= self.settings.patience_s {
            return PatrolStep::Skipped(self.leave_waypoint());
        }
        PatrolStep::Goto(goal)
    }

    /// Returns how far the patrol has come; `None` between two laps, after the last one, and
    /// without a route.
    pub fn progress(&self) -> Option<PatrolProgress> {
        let goal = self.waypoint()?;
        let PatrolSettings { laps, .. } = self.settings;
        let per_lap = self.route.len() as f64;
        let left_behind = f64::from(self.laps) * per_lap + self.next as f64;
        Some(PatrolProgress {
            waypoint: (self.next + 1, self.route.len()),
            lap: (self.laps + 1, laps),
            distance_m: self.robot.map(|robot| robot.distance_m(goal)),
            done_share: (laps != 0).then(|| left_behind / (f64::from(laps) * per_lap)),
        })
    }

    /// Turns to the next waypoint; the number of the one left.
    fn leave_waypoint(&mut self) -> usize {
        (self.there_since_s, self.nearest) = (None, None);
        self.next += 1;
        self.next
    }

    fn end_lap(&mut self) -> PatrolStep {
        let all = self.settings.laps != 0 && self.laps >= self.settings.laps;
        if all {
            return PatrolStep::Done;
        }
        if self.reached == 0 {
            return PatrolStep::Stuck;
        }
        self.laps += 1;
        if self.settings.laps == 0 || self.laps < self.settings.laps {
            (self.next, self.reached) = (0, 0);
        }
        PatrolStep::Lap(self.laps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: PatrolSettings =
        PatrolSettings { laps: 2, tolerance_m: 0.3, stay_s: 1.0, patience_s: 5.0 };

    fn route() -> Vec<Point2> {
        vec![Point2::new(2.0, 0.0), Point2::new(2.0, 2.0), Point2::new(0.0, 0.0)]
    }

    /// Drives straight to each goal at 1 m/s, except to those `blocked`; all that is not driving.
    fn patrol(settings: PatrolSettings, blocked: &[Point2], most_steps: usize) -> Vec<PatrolStep> {
        let mut rounds = Rounds::new(route(), settings);
        let (mut robot, mut reported) = (Point2::new(0.0, 0.0), Vec::new());
        for step in 0..most_steps {
            rounds.robot_seen(robot);
            match rounds.step(step as f64 * 0.1) {
                PatrolStep::Goto(goal) if blocked.contains(&goal) => {}
                PatrolStep::Goto(goal) => {
                    let left_m = robot.distance_m(goal);
                    let share = if left_m > 0.1 { 0.1 / left_m } else { 1.0 };
                    robot = Point2::new(
                        robot.x_m + share * (goal.x_m - robot.x_m),
                        robot.y_m + share * (goal.y_m - robot.y_m),
                    );
                }
                other => {
                    reported.push(other);
                    if matches!(other, PatrolStep::Done | PatrolStep::Stuck) {
                        break;
                    }
                }
            }
        }
        reported
    }

    #[test]
    fn every_waypoint_is_reached_in_order_lap_after_lap() {
        use PatrolStep::{Done, Lap, Reached};
        let lap = |number| [Reached(1), Reached(2), Reached(3), Lap(number)];
        let expected: Vec<_> = lap(1).into_iter().chain(lap(2)).chain([Done]).collect();
        assert_eq!(patrol(SETTINGS, &[], 1000), expected);
    }

    #[test]
    fn progress_counts_waypoints_of_all_laps() {
        let mut rounds = Rounds::new(route(), SETTINGS);
        let check = |rounds: &Rounds, waypoint, lap, share: f64, distance_m| {
            let progress = rounds.progress().expect("a waypoint is next");
            assert_eq!((progress.waypoint, progress.lap), ((waypoint, 3), (lap, 2)));
            assert_eq!((progress.done_share, progress.distance_m), (Some(share), distance_m));
        };
        check(&rounds, 1, 1, 0.0, None);
        rounds.robot_seen(Point2::new(2.0, 0.0));
        rounds.step(0.0);
        check(&rounds, 1, 1, 0.0, Some(0.0));
        assert_eq!(rounds.step(1.0), PatrolStep::Reached(1));
        check(&rounds, 2, 1, 1.0 / 6.0, Some(2.0));
        for _ in 0..2 {
            rounds.leave_waypoint();
        }
        assert_eq!((rounds.progress(), rounds.step(2.0)), (None, PatrolStep::Lap(1)));
        check(&rounds, 1, 2, 0.5, Some(0.0));
        let endless = Rounds::new(route(), PatrolSettings { laps: 0, ..SETTINGS });
        assert_eq!(endless.progress().expect("a waypoint is next").done_share, None);
    }

    #[test]
    fn without_a_number_of_laps_it_continues() {
        let reported = patrol(PatrolSettings { laps: 0, ..SETTINGS }, &[], 2000);
        assert!(
            reported.iter().filter(|step| matches!(step, PatrolStep::Lap(_))).count() > 5,
            "{reported:?}"
        );
        assert!(!reported.contains(&PatrolStep::Done));
    }

    #[test]
    fn what_cannot_be_reached_is_given_up_and_the_patrol_continues() {
        let reported = patrol(PatrolSettings { laps: 1, ..SETTINGS }, &route()[1..2], 1000);
        use PatrolStep::{Done, Lap, Reached, Skipped};
        assert_eq!(reported, [Reached(1), Skipped(2), Reached(3), Lap(1), Done]);
    }

    #[test]
    fn a_lap_in_which_nothing_is_reached_is_a_failure() {
        let far: Vec<_> = route()[..2].to_vec();
        let mut rounds = Rounds::new(far, SETTINGS);
        rounds.robot_seen(Point2::new(9.0, 9.0));
        let reported: Vec<_> = (0..).map(|step| rounds.step(f64::from(step))).take(20).collect();
        assert!(
            reported.contains(&PatrolStep::Skipped(1))
                && reported.contains(&PatrolStep::Skipped(2)),
            "{reported:?}"
        );
        assert_eq!(reported.last(), Some(&PatrolStep::Stuck));
    }

    #[test]
    fn the_robot_stays_at_each_waypoint_and_without_a_pose_it_waits() {
        let mut rounds = Rounds::new(route(), SETTINGS);
        assert_eq!(rounds.step(0.0), PatrolStep::Wait);
        rounds.robot_seen(Point2::new(1.9, 0.0));
        assert_eq!(rounds.step(1.0), PatrolStep::Goto(route()[0]));
        // A pose that jumps while it stays does not restart the stay.
        rounds.robot_seen(Point2::new(1.5, 0.0));
        assert_eq!(rounds.step(1.5), PatrolStep::Goto(route()[0]));
        assert_eq!(rounds.step(2.0), PatrolStep::Reached(1));
        assert_eq!(rounds.step(2.1), PatrolStep::Goto(route()[1]));
    }
}
