//! One mission in simulated time: the algorithms of the simulator, the mapper, the explorer, the
//! planner, the driver and homing, joined as the mission file joins their components, without
//! processes.

use std::collections::VecDeque;
use std::path::Path;

use armor_driver::{DriverScan, Driving, Velocity};
use armor_evaluation::map_score::{MapScore, score_map};
use armor_explorer::{Exploration, ExplorerDecision};
use armor_grid::{Geometry, Grid, Occupancy, Point2, Pose2, Thresholds};
use armor_grid_slam::config::Config;
use armor_grid_slam::pairing::Pairing;
use armor_grid_slam::pose::Pose as MapperPose;
use armor_grid_slam::scan::MapperScan;
use armor_grid_slam::slam::Slam;
use armor_homing::{Homecoming, HomingStep};
use armor_planner::{Planning, Rank};
use armor_simulator::laser::{LaserModel, RANGE_MIN_M};
use armor_simulator::random::{NoiseStream, Random};
use armor_simulator::simulation::{Models, SensorReading, Simulation, Stamped};
use armor_simulator::world::World;

use crate::delivery::{Delays, Delivery};

/// The mission's clock: the simulation's step.
const TICK_S: f64 = 0.01;
const DRIVER_TICKS: u64 = 5;
const PLANNER_TICKS: u64 = 10;
const EXPLORER_TICKS: u64 = 20;
const MAP_TICKS: u64 = 50;
/// A mission that takes longer has failed, in seconds.
const GIVE_UP_S: f64 = 400.0;

/// How the mission runs.
#[derive(Clone, Copy, Debug)]
pub struct Conditions {
    pub seed: u64,
    pub explorer: armor_explorer::ExplorerSettings,
    pub planner: armor_planner::PlannerSettings,
    pub driver: armor_driver::DriverSettings,
    /// Messages in transit to and from planner, driver and mapper.
    pub delays: Delays,
    /// From a scan to the pose it gives, in seconds.
    pub pose_late_s: f64,
    /// Standard deviation of what is added to each pose, in metres.
    pub pose_jump_m: f64,
}

/// Its result.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// When the explorer was done, in seconds.
    pub explored_s: Option<f64>,
    /// When the robot was home, in seconds.
    pub home_s: Option<f64>,
    pub way_m: f64,
    /// All turning, in radians.
    pub turned_rad: f64,
    /// Time at less than 0.1 m/s, in seconds.
    pub slow_s: f64,
    /// Least distance of the base's edge to a wall, in metres.
    pub nearest_m: f64,
    pub collisions: u64,
    /// Goals more than a metre from the goal before.
    pub goals: u32,
    /// Share of the free space that was seen.
    pub explored: f64,
    pub wall_precision: f64,
    /// Between where the robot is and where it believes it is, at the end, in metres.
    pub pose_error_m: f64,
}

enum Sent {
    Odometry(f64, Pose2),
    Scan(f64, Vec<f32>),
    Pose(f64, Pose2),
    Map(Grid<Occupancy>),
    Goal(Rank, Pose2),
    Path(Vec<Pose2>),
}

/// A mission under way.
pub struct Trial {
    conditions: Conditions,
    simulation: Simulation,
    mapper: Slam,
    pairing: Pairing,
    map_is_new: bool,
    exploration: Exploration,
    homecoming: Homecoming,
    planning: Planning,
    driving: Driving,
    to_mapper: Delivery<Sent>,
    to_planner: Delivery<Sent>,
    to_driver: Delivery<Sent>,
    poses: Delivery<(f64, Pose2)>,
    maps: Delivery<[Grid<Occupancy>; 2]>,
    velocities: Delivery<(f64, Velocity)>,
    random: Random,
    ticks: u64,
    goal: Option<Pose2>,
    believed: Pose2,
    verbose: bool,
    report: Report,
    /// Where the robot was at each scan that is not mapped yet.
    scanned: VecDeque<(f64, Pose2)>,
    mapped: Vec<MappedScan>,
}

/// What the mapper was given, and where the robot truly was.
#[derive(Clone, Debug)]
pub struct MappedScan {
    pub odometry: MapperPose,
    pub scan: MapperScan,
    pub truth: Pose2,
}

impl Trial {
    /// Puts the robot at the start of a world in `missions/worlds`.
    pub fn new(world: &str, conditions: Conditions) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions/worlds");
        let world = World::read(&folder.join(world)).expect("a world that reads");
        let Conditions { seed, delays, .. } = conditions;
        let models = Models { seed, ..Models::default() };
        let mount = models.laser.mount;
        let robot_from_laser = MapperPose::new(mount.x_m, mount.y_m, mount.yaw_rad);
        let steady = |least_s| Delays { least_s, busy_share: 0.0, busy_s: 0.0 };
        Self {
            conditions,
            simulation: Simulation::new(world, models, 0.0).expect("room at the start"),
            mapper: Slam::new(Config { robot_from_laser, ..Config::default() }),
            pairing: Pairing::default(),
            map_is_new: false,
            exploration: Exploration::new(conditions.explorer),
            homecoming: Homecoming::new(Pose2::IDENTITY, 0.25),
            planning: Planning::new(conditions.planner),
            driving: Driving::new(conditions.driver),
            to_mapper: Delivery::new(delays, seed + 1000),
            to_planner: Delivery::new(delays, seed + 5000),
            to_driver: Delivery::new(delays, seed + 2000),
            poses: Delivery::new(steady(conditions.pose_late_s), seed),
            maps: Delivery::new(steady(0.05), seed),
            velocities: Delivery::new(delays, seed + 3000),
            random: Random::new(seed + 4000, NoiseStream::Laser),
            ticks: 0,
            goal: None,
            believed: Pose2::IDENTITY,
            verbose: std::env::var_os("ARMOR_TRACE").is_some(),
            report: Report { nearest_m: f64::INFINITY, ..Report::default() },
            scanned: VecDeque::new(),
            mapped: Vec::new(),
        }
    }

    /// Explores and goes home, or gives up.
    pub fn run(mut self) -> Report {
        self.go_home();
        let MapScore { free_recall, wall_precision, .. } = self.score();
        (self.report.explored, self.report.wall_precision) = (free_recall, wall_precision);
        self.report.pose_error_m = self.simulation.pose().point().distance_m(self.believed.point());
        self.report
    }

    /// The same, for all that the mapper was given.
    pub fn record(mut self) -> Vec<MappedScan> {
        self.go_home();
        self.mapped
    }

    fn go_home(&mut self) {
        while self.report.home_s.is_none() && self.now_s() < GIVE_UP_S {
            self.tick();
        }
    }

    /// The map so far.
    fn map(&self, thresholds: Thresholds) -> Grid<Occupancy> {
        let snapshot = self.mapper.snapshot();
        let geometry = Geometry {
            origin: Point2::new(snapshot.origin.x_m, snapshot.origin.y_m),
            resolution_m: snapshot.resolution_m,
            width: snapshot.width,
            height: snapshot.height,
        };
        Grid::classified_by(thresholds, geometry, &snapshot.cells)
            .expect("as many cells as the size requires")
    }

    fn score(&self) -> MapScore {
        let truth = self.simulation.world().free_space(0.05).expect("a raster");
        score_map(&self.map(Thresholds::default()), &truth, 1.5)
    }

    fn now_s(&self) -> f64 {
        self.ticks as f64 * TICK_S
    }

    fn tick(&mut self) {
        self.ticks += 1;
        let now_s = self.now_s();
        while let Some((given_s, velocity)) = self.velocities.receive(now_s) {
            self.simulation.command(velocity.speed_mps, velocity.turn_radps, given_s, now_s);
        }
        self.simulate(now_s);
        self.map_scans(now_s);
        while let Some((stamp_s, pose)) = self.poses.receive(now_s) {
            self.believed = pose;
            self.exploration.pose_seen(pose);
            self.homecoming.pose_seen(pose);
            self.to_planner.send(now_s, Sent::Pose(stamp_s, pose));
            self.to_driver.send(now_s, Sent::Pose(stamp_s, pose));
        }
        while let Some([seen, certain]) = self.maps.receive(now_s) {
            self.exploration.map_seen(seen);
            self.to_planner.send(now_s, Sent::Map(certain.clone()));
            self.to_driver.send(now_s, Sent::Map(certain));
        }
        if self.ticks.is_multiple_of(EXPLORER_TICKS) {
            self.decide(now_s);
        }
        while let Some(message) = self.to_planner.receive(now_s) {
            self.send_to_planner(message, now_s);
        }
        if self.ticks.is_multiple_of(PLANNER_TICKS)
            && let Some(path) = self.planning.step(now_s)
        {
            self.to_driver.send(now_s, Sent::Path(path.to_vec()));
        }
        while let Some(message) = self.to_driver.receive(now_s) {
            self.send_to_driver(message, now_s);
        }
        if self.ticks.is_multiple_of(DRIVER_TICKS) {
            let velocity = self.driving.step(now_s);
            self.velocities.send(now_s, (now_s, velocity));
            if self.verbose && self.ticks.is_multiple_of(500) {
                println!("{now_s:7.2} seen {:.4}", self.score().free_recall);
            }
            if self.verbose && self.ticks.is_multiple_of(20) {
                let robot = self.simulation.pose();
                let off_m = robot.point().distance_m(self.believed.point());
                let turned_rad = armor_grid::wrap_angle(self.believed.yaw_rad - robot.yaw_rad);
                println!(
                    "{now_s:7.2} at {:.2} {:.2} {:.2} v {:.2} w {:.2} off {off_m:.3} {turned_rad:.3}",
                    robot.x_m, robot.y_m, robot.yaw_rad, velocity.speed_mps, velocity.turn_radps
                );
            }
        }
    }

    fn simulate(&mut self, now_s: f64) {
        let before = self.simulation.pose();
        let mut readings = Vec::new();
        self.simulation.advance_to(now_s, &mut readings);
        let after = self.simulation.pose();
        let moved_m = before.point().distance_m(after.point());
        self.report.way_m += moved_m;
        self.report.turned_rad += armor_grid::wrap_angle(after.yaw_rad - before.yaw_rad).abs();
        self.report.slow_s += if moved_m < 0.1 * TICK_S { TICK_S } else { 0.0 };
        let radius_m = Models::default().drive.radius_m;
        let clear_m = self.simulation.world().clearance_m(after.x_m, after.y_m) - radius_m;
        self.report.nearest_m = self.report.nearest_m.min(clear_m);
        for Stamped { time_s, reading } in readings {
            match reading {
                SensorReading::Odometry(motion) => {
                    self.to_mapper.send(now_s, Sent::Odometry(time_s, motion.pose));
                    self.to_driver.send(now_s, Sent::Odometry(time_s, motion.pose));
                }
                SensorReading::Scan(ranges) => {
                    self.scanned.push_back((time_s, after));
                    self.to_mapper.send(now_s, Sent::Scan(time_s, ranges.clone()));
                    self.to_driver.send(now_s, Sent::Scan(time_s, ranges));
                }
                SensorReading::Collisions(count) => {
                    self.report.collisions = count;
                    if self.verbose && count > 0 {
                        let bodies = self.simulation.bodies();
                        println!("{now_s:7.2} COLLISION at {after:?} among {bodies:?}");
                    }
                }
                _ => {}
            }
        }
    }

    fn map_scans(&mut self, now_s: f64) {
        while let Some(message) = self.to_mapper.receive(now_s) {
            match message {
                Sent::Odometry(stamp_s, Pose2 { x_m, y_m, yaw_rad }) => {
                    self.pairing.odometry_seen(stamp_s, MapperPose::new(x_m, y_m, yaw_rad));
                }
                Sent::Scan(stamp_s, ranges_m) => {
                    self.pairing.scan_seen(for_mapper(stamp_s, ranges_m));
                }
                _ => {}
            }
        }
        while let Some((odometry, scan)) = self.pairing.next_pair() {
            let estimate = self.mapper.add(odometry, &scan);
            self.map_is_new |= estimate.drawn;
            while let Some((stamp_s, truth)) = self.scanned.pop_front() {
                if stamp_s >= scan.stamp_s {
                    self.mapped.push(MappedScan { odometry, scan: scan.clone(), truth });
                    break;
                }
            }
            let mut jump_m = || self.random.normal(self.conditions.pose_jump_m);
            let MapperPose { x_m, y_m, yaw_rad } = estimate.pose;
            let pose = Pose2::new(x_m + jump_m(), y_m + jump_m(), yaw_rad);
            self.poses.send(now_s, (scan.stamp_s, pose));
        }
        if self.map_is_new && self.ticks.is_multiple_of(MAP_TICKS) {
            self.map_is_new = false;
            let maps = [Thresholds::SEEN, Thresholds::default()].map(|by| self.map(by));
            self.maps.send(now_s, maps);
        }
    }

    /// The explorer's tick, or homing's once the explorer is done.
    fn decide(&mut self, now_s: f64) {
        if self.report.explored_s.is_some() {
            match self.homecoming.step(now_s) {
                HomingStep::Home => self.report.home_s = Some(now_s),
                HomingStep::Goto(home) => {
                    self.to_planner.send(now_s, Sent::Goal(Rank::Override, home));
                }
            }
            return;
        }
        match self.exploration.step(now_s) {
            ExplorerDecision::Wait => {}
            ExplorerDecision::Done => self.report.explored_s = Some(now_s),
            ExplorerDecision::Goto(goal) => {
                let is_other =
                    self.goal.is_none_or(|last| last.point().distance_m(goal.point()) > 1.0);
                self.report.goals += u32::from(is_other);
                if self.verbose && self.goal != Some(goal) {
                    println!("{now_s:7.2} goal {:.2} {:.2}", goal.x_m, goal.y_m);
                }
                self.goal = Some(goal);
                self.to_planner.send(now_s, Sent::Goal(Rank::Task, goal));
            }
        }
    }

    fn send_to_planner(&mut self, message: Sent, now_s: f64) {
        match message {
            Sent::Pose(_, pose) => self.planning.pose_seen(pose),
            Sent::Map(map) => self.planning.map_seen(map),
            Sent::Goal(rank, goal) => self.planning.goal_seen(now_s, rank, goal),
            _ => {}
        }
    }

    fn send_to_driver(&mut self, message: Sent, now_s: f64) {
        let driving = &mut self.driving;
        match message {
            Sent::Odometry(stamp_s, pose) => driving.odometry_seen(now_s, stamp_s, pose),
            Sent::Scan(stamp_s, ranges_m) => {
                driving.scan_seen(now_s, for_driver(stamp_s, &ranges_m));
            }
            Sent::Pose(stamp_s, pose) => driving.pose_seen(stamp_s, pose),
            Sent::Map(map) => driving.map_seen(map),
            Sent::Path(path) => driving.path_seen(now_s, path),
            Sent::Goal(..) => {}
        }
    }
}

fn for_mapper(stamp_s: f64, ranges_m: Vec<f32>) -> MapperScan {
    let laser = LaserModel::default();
    MapperScan {
        stamp_s,
        angle_min_rad: laser.angle_min_rad(),
        increment_rad: laser.angle_increment_rad(),
        range_min_m: RANGE_MIN_M,
        range_max_m: laser.range_max_m,
        ranges_m,
    }
}

fn for_driver(stamp_s: f64, ranges_m: &[f32]) -> DriverScan {
    let laser = LaserModel::default();
    let seen = (RANGE_MIN_M as f32)..=(laser.range_max_m as f32);
    let range_m =
        |range: &f32| if seen.contains(range) { f64::from(*range) } else { f64::INFINITY };
    DriverScan {
        stamp_s,
        robot_from_laser: laser.mount,
        first_rad: laser.angle_min_rad(),
        step_rad: laser.angle_increment_rad(),
        ranges_m: ranges_m.iter().map(range_m).collect(),
    }
}
