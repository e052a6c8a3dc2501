//! Driving in closed loop with the planner: the real laser, base and odometry are replaced, nothing
//! else is.

use std::f64::consts::{PI, TAU};

use armor_planner::{Planning, Rank};

use super::*;
use crate::box_world::{BoxWalls, BoxWorld, Noise, two_rooms};
use crate::window::Distances;

#[path = "zone_tests.rs"]
mod zone_tests;

const TICK_S: f64 = 0.05;
const EXACT: Noise = Noise { range_m: 0.0, pose_m: 0.0, odometry: 0.0, seed: 1 };
const START: Pose2 = Pose2::new(1.0, 1.0, 0.0);

struct Trial {
    world: BoxWorld,
    planning: Planning,
    driving: Driving,
    now_s: f64,
    ticks: u64,
    nearest_m: f64,
    /// Poses on the map come this many ticks late.
    late: std::collections::VecDeque<(f64, Pose2)>,
}

impl Trial {
    fn new(walls: BoxWalls, field_rad: f64, noise: Noise) -> Self {
        let world = BoxWorld::new(walls, START, field_rad, noise);
        let planning = Planning::new(armor_planner::PlannerSettings::default());
        let driving = Driving::new(DriverSettings::default());
        let late = std::collections::VecDeque::new();
        Self { world, planning, driving, now_s: 100.0, ticks: 0, nearest_m: f64::INFINITY, late }
    }

    /// Drives on for a tick of the driver. Scans, poses and paths come at 10 Hz, poses 0.2 s late,
    /// maps at 1 Hz, the rest at 20 Hz.
    fn tick(&mut self, goal: Option<Pose2>) -> Velocity {
        let now_s = self.now_s;
        self.sense();
        if let Some(goal) = goal {
            self.planning.goal_seen(now_s, Rank::Task, goal);
        }
        if self.ticks.is_multiple_of(2)
            && let Some(path) = self.planning.step(now_s)
        {
            self.driving.path_seen(now_s, path.to_vec());
        }
        self.move_on()
    }

    /// Drives on by a manual velocity.
    fn tick_manually(&mut self, wanted: Velocity) -> Velocity {
        self.sense();
        self.driving.manual_seen(self.now_s, wanted);
        self.move_on()
    }

    fn sense(&mut self) {
        let now_s = self.now_s;
        self.driving.odometry_seen(now_s, now_s, self.world.odometry);
        if self.ticks.is_multiple_of(2) {
            let scan = self.world.scan(now_s);
            self.driving.scan_seen(now_s, scan);
            self.late.push_back((now_s, self.world.mapped_pose()));
            if self.late.len() > 2 {
                let (stamp_s, pose) = self.late.pop_front().expect("there are more than two");
                self.planning.pose_seen(pose);
                self.driving.pose_seen(stamp_s, pose);
            }
        }
        if self.ticks.is_multiple_of(20) {
            self.planning.map_seen(self.world.map.clone());
            self.driving.map_seen(self.world.map.clone());
        }
    }

    fn move_on(&mut self) -> Velocity {
        let command = self.driving.step(self.now_s);
        for _ in 0..5 {
            self.world.drive(command, TICK_S / 5.0);
            self.nearest_m =
                self.nearest_m.min(self.world.walls.distance_m(self.world.robot.point()));
        }
        self.now_s += TICK_S;
        self.ticks += 1;
        command
    }

    fn away_m(&self, goal: Pose2) -> f64 {
        self.world.robot.point().distance_m(goal.point())
    }

    /// Drives until the goal is reached; panics if it touches a wall or takes longer.
    fn reach(&mut self, goal: Pose2, within_s: f64) {
        let until_s = self.now_s + within_s;
        while self.away_m(goal) > 0.2 {
            self.tick(Some(goal));
            let radius_m = self.driving.settings.radius_m;
            assert!(self.nearest_m > radius_m, "touches a wall at {:?}", self.world.robot);
            assert!(self.now_s < until_s, "{goal:?} not reached from {:?}", self.world.robot);
        }
    }
}

/// Through the door and back, round the boxes, as an explorer would ask for it.
const TOUR: [Pose2; 5] = [
    Pose2::new(3.2, 2.5, 0.0),
    Pose2::new(5.0, 2.5, 0.0),
    Pose2::new(7.3, 4.3, 0.0),
    Pose2::new(7.2, 0.6, 0.0),
    Pose2::new(0.7, 4.2, 0.0),
];

/// Drives the tour; returns how close to a wall it came and how long it took.
fn check(walls: BoxWalls, field_rad: f64, noise: Noise) {
    let mut trial = Trial::new(walls, field_rad, noise);
    for goal in TOUR {
        trial.reach(goal, 60.0);
    }
    let took_s = trial.now_s - 100.0;
    println!("seed {}: nearest wall {:.3} m, {took_s:.1} s", noise.seed, trial.nearest_m);
}

#[test]
fn a_tour_through_a_door_touches_nothing() {
    check(two_rooms(0.9), TAU, EXACT);
}

#[test]
fn a_laser_that_looks_ahead_only_is_enough() {
    check(two_rooms(0.9), PI, EXACT);
}

#[test]
fn noise_and_drift_do_not_make_it_touch() {
    for seed in [11, 12, 13, 14] {
        check(two_rooms(0.9), TAU, Noise { range_m: 0.015, pose_m: 0.02, odometry: 0.05, seed });
    }
}

#[test]
fn rooms_full_of_boxes_are_passed() {
    let mut free: Vec<Point2> = TOUR.iter().map(|goal| goal.point()).collect();
    free.extend([START.point(), Point2::new(4.0, 2.1), Point2::new(4.0, 2.9)]);
    for seed in 100..106 {
        let mut walls = two_rooms(0.9);
        walls.clutter(seed, &free);
        let noise = Noise { range_m: 0.02, pose_m: 0.03, odometry: 0.05, seed };
        check(walls, if seed % 2 == 0 { TAU } else { 1.5 * PI }, noise);
    }
}

/// A trial that drives at some speed.
fn under_way() -> Trial {
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    for _ in 0..40 {
        trial.tick(Some(TOUR[0]));
    }
    assert!(trial.driving.command.speed_mps > 0.2, "{:?}", trial.driving.command);
    trial
}

#[test]
fn the_phase_is_what_the_robot_is_doing() {
    assert_eq!(Driving::new(DriverSettings::default()).phase(), DrivingPhase::Idle);
    let mut trial = under_way();
    let DrivingPhase::Following { to_go_m } = trial.driving.phase() else {
        panic!("{:?}", trial.driving.phase())
    };
    let straight_m = trial.away_m(TOUR[0]);
    assert!((straight_m - 0.3..2.0 * straight_m + 0.3).contains(&to_go_m), "{to_go_m} m");
    trial.tick_manually(Velocity::ZERO);
    assert_eq!(trial.driving.phase(), DrivingPhase::Manual);
    trial.driving.stop_seen(true);
    trial.tick(Some(TOUR[0]));
    assert_eq!(trial.driving.phase(), DrivingPhase::Stopped);
    trial.driving.stop_seen(false);
    trial.driving.forget_orders();
    trial.driving.path_seen(trial.now_s, Vec::new());
    trial.driving.step(trial.now_s);
    assert_eq!(trial.driving.phase(), DrivingPhase::WithoutPath);
    trial.driving.path_seen(trial.now_s + 3.0, vec![TOUR[0]]);
    trial.driving.step(trial.now_s + 3.0);
    assert_eq!(trial.driving.phase(), DrivingPhase::Blind);
    trial.driving.step(trial.now_s + 9.0);
    assert_eq!(trial.driving.phase(), DrivingPhase::Idle);
}

#[test]
fn without_a_fresh_path_it_stops() {
    let mut trial = under_way();
    for _ in 0..9 {
        trial.sense();
        trial.move_on();
    }
    assert_ne!(trial.driving.command, Velocity::ZERO);
    for _ in 0..3 {
        trial.sense();
        trial.move_on();
    }
    assert_eq!(trial.driving.command, Velocity::ZERO);
}

#[test]
fn when_the_goal_ends_it_stops_at_the_next_path() {
    let mut trial = under_way();
    trial.planning.forget_goals();
    trial.tick(None);
    trial.tick(None);
    assert_eq!(trial.driving.command, Velocity::ZERO);
}

#[test]
fn blind_it_stands() {
    let mut trial = under_way();
    // Paths and odometry still arrive, scans do not.
    for _ in 0..13 {
        trial.driving.odometry_seen(trial.now_s, trial.now_s, trial.world.odometry);
        trial.driving.path_seen(trial.now_s, vec![TOUR[0]]);
        trial.driving.step(trial.now_s);
        trial.now_s += TICK_S;
    }
    assert_eq!(trial.driving.command, Velocity::ZERO);
}

#[test]
fn ordered_to_stand_it_stands_whatever_the_other_inputs() {
    let mut trial = under_way();
    trial.driving.stop_seen(true);
    for _ in 0..20 {
        trial.driving.manual_seen(trial.now_s, FORWARD);
        assert_eq!(trial.tick(Some(TOUR[0])), Velocity::ZERO);
    }
    trial.driving.reset_state(DriverSettings::default());
    assert_eq!(trial.tick(Some(TOUR[0])), Velocity::ZERO, "after a reset it still stands");
    trial.driving.stop_seen(false);
    trial.reach(TOUR[0], 30.0);
}

const FORWARD: Velocity = Velocity { speed_mps: 0.4, turn_radps: 0.0 };
const BACKWARD: Velocity = Velocity { speed_mps: -0.4, turn_radps: 0.0 };

#[test]
fn a_manual_velocity_has_priority_over_the_path_while_it_is_fresh() {
    let mut trial = under_way();
    let before = trial.world.robot;
    for _ in 0..10 {
        trial.driving.manual_seen(trial.now_s, Velocity::spin(-1.0));
        trial.tick(Some(TOUR[0]));
    }
    let turned_rad = wrap_angle(trial.world.robot.yaw_rad - before.yaw_rad);
    assert!(turned_rad < -0.3, "turned by {turned_rad}");
    trial.reach(TOUR[0], 30.0);
}

#[test]
fn a_manual_velocity_is_limited_to_what_the_base_can_do() {
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    let limits = trial.driving.settings.limits;
    let much = Velocity { speed_mps: 9.0, turn_radps: 9.0 };
    let mut before = trial.tick_manually(Velocity::ZERO);
    for _ in 0..20 {
        let next = trial.tick_manually(much);
        assert!(next.speed_mps - before.speed_mps <= limits.acceleration_mps2 * TICK_S + 1e-9);
        let turned_radps = next.turn_radps - before.turn_radps;
        assert!(turned_radps <= limits.turn_acceleration_radps2 * TICK_S + 1e-9);
        before = next;
    }
    assert_eq!(before, Velocity { speed_mps: limits.speed_mps, turn_radps: limits.turn_radps });
}

#[test]
fn guarded_a_manual_velocity_does_not_reach_the_wall_and_may_back_off() {
    for noise in [EXACT, Noise { range_m: 0.015, pose_m: 0.02, odometry: 0.05, seed: 5 }] {
        let mut trial = Trial::new(two_rooms(0.9), TAU, noise);
        let before_m = trial.away_m(START);
        for _ in 0..300 {
            trial.tick_manually(FORWARD);
            assert!(trial.nearest_m > trial.driving.settings.radius_m, "{:?}", trial.world.robot);
        }
        assert!(trial.away_m(START) > before_m + 1.0, "it drives as long as there is room");
        assert!(trial.driving.command.speed_mps < 0.05, "{:?}", trial.driving.command);
        let at_wall = trial.world.robot;
        for _ in 0..40 {
            trial.tick_manually(BACKWARD);
        }
        assert!(trial.away_m(at_wall) > 0.3, "{:?}", trial.world.robot);
    }
}

#[test]
fn guarded_a_fast_base_looks_as_far_as_it_takes_to_stop() {
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    let mut settings = DriverSettings::default();
    settings.limits.speed_mps = 1.6;
    trial.driving.reset_state(settings);
    trial.world.robot = Pose2::new(0.4, 4.5, -0.05);
    for _ in 0..200 {
        trial.tick_manually(Velocity { speed_mps: 1.6, turn_radps: 0.0 });
        assert!(trial.nearest_m > settings.radius_m, "{:?}", trial.world.robot);
    }
    assert!(trial.world.robot.x_m > 3.0);
}

#[test]
fn what_is_no_number_stands_and_is_forgotten() {
    let mut trial = under_way();
    let nonsense = Velocity { speed_mps: f64::NAN, turn_radps: f64::INFINITY };
    for _ in 0..20 {
        assert!(trial.tick_manually(nonsense).speed_mps.is_finite());
    }
    assert_eq!(trial.driving.command, Velocity::ZERO);
    for _ in 0..11 {
        trial.sense();
        trial.move_on();
    }
    let nowhere = Pose2::new(f64::NAN, 1.0, 0.0);
    trial.driving.path_seen(trial.now_s, vec![trial.world.robot, nowhere]);
    trial.driving.pose_seen(trial.now_s, nowhere);
    trial.driving.odometry_seen(trial.now_s, trial.now_s, nowhere);
    assert_eq!(trial.move_on(), Velocity::ZERO);
    trial.reach(TOUR[0], 30.0);
}

#[test]
fn guarded_and_blind_it_follows_no_manual_velocity() {
    let mut trial = under_way();
    for _ in 0..13 {
        trial.driving.manual_seen(trial.now_s, FORWARD);
        trial.driving.step(trial.now_s);
        trial.now_s += TICK_S;
    }
    assert_eq!(trial.driving.command, Velocity::ZERO);
}

#[test]
fn unguarded_a_manual_velocity_may_run_into_the_wall() {
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    trial.driving.reset_state(DriverSettings { guarded: false, ..DriverSettings::default() });
    for _ in 0..300 {
        assert!(trial.tick_manually(FORWARD).speed_mps > 0.0);
    }
    assert!(trial.nearest_m < 0.05, "{}", trial.nearest_m);
}

#[test]
fn at_the_goal_it_turns_to_its_heading_and_stands() {
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    let goal = Pose2::new(1.0, 3.5, -2.0);
    trial.reach(goal, 30.0);
    for _ in 0..100 {
        trial.tick(Some(goal));
    }
    assert_eq!(trial.driving.command, Velocity::ZERO);
    assert!(wrap_angle(trial.world.robot.yaw_rad + 2.0).abs() < 0.2, "{:?}", trial.world.robot);
}

#[test]
fn a_base_that_rolls_along_a_wall_is_not_turned_into_it() {
    let wall: Vec<Point2> = (-20..20).map(|i| Point2::new(0.05 * f64::from(i), 0.25)).collect();
    let now = Velocity { speed_mps: 0.5, turn_radps: 0.1 };
    let window = DynamicWindow {
        limits: &DriverSettings::default().limits,
        distances: Distances { keep_m: 0.205, comfort_m: 0.355 },
        obstacles: &wall,
        zones: None,
        now,
        interval_s: TICK_S,
    };
    // The goal has come to lie where the robot is, and looks at the wall.
    let next = Driving::new(DriverSettings::default()).spin_by(PI / 2.0, &window);
    assert!(next.speed_mps < now.speed_mps && next.turn_radps < now.turn_radps, "{next:?}");
    let at_rest = DynamicWindow { now: Velocity::ZERO, ..window };
    assert!(Driving::new(DriverSettings::default()).spin_by(PI / 2.0, &at_rest).turn_radps > 0.1);
}

#[test]
fn a_thing_put_in_the_way_is_driven_around() {
    let mut trial = Trial::new(two_rooms(0.9), TAU, EXACT);
    for _ in 0..30 {
        trial.tick(Some(TOUR[4]));
    }
    trial.world.walls.line(&[(0.6, 2.6), (1.1, 2.6), (1.1, 2.7), (0.6, 2.7), (0.6, 2.6)]);
    trial.reach(TOUR[4], 40.0);
}

#[test]
fn a_goal_that_cannot_be_reached_is_not_forced() {
    let mut trial = Trial::new(two_rooms(0.3), TAU, EXACT);
    for _ in 0..600 {
        trial.tick(Some(TOUR[2]));
        assert!(trial.nearest_m > trial.driving.settings.radius_m);
    }
    assert!(trial.world.robot.x_m < 4.0);
}

#[test]
fn what_came_before_time_went_back_does_not_count() {
    let mut trial = Trial::new(two_rooms(1.0), TAU, EXACT);
    for _ in 0..5 {
        trial.tick_manually(Velocity { speed_mps: 0.3, turn_radps: 0.0 });
    }
    assert!(trial.driving.step(trial.now_s).speed_mps > 0.0, "the manual velocity has priority");
    let before_s = trial.now_s - 30.0;
    assert_eq!(trial.driving.step(before_s), Velocity::ZERO, "30 s before it arrived");
}

#[test]
fn a_covered_laser_is_no_free_world() {
    let mut trial = Trial::new(two_rooms(1.0), TAU, EXACT);
    let covered = |now_s: f64| DriverScan {
        stamp_s: now_s,
        robot_from_laser: Pose2::IDENTITY,
        first_rad: 0.0,
        step_rad: 0.1,
        ranges_m: vec![f64::NAN; 63],
    };
    for _ in 0..20 {
        let now_s = trial.now_s;
        trial.driving.odometry_seen(now_s, now_s, trial.world.odometry);
        trial.driving.pose_seen(now_s, trial.world.robot);
        trial.driving.scan_seen(now_s, covered(now_s));
        trial.driving.path_seen(now_s, vec![START, Pose2::new(2.0, 1.0, 0.0)]);
        assert_eq!(trial.move_on(), Velocity::ZERO);
    }
}
