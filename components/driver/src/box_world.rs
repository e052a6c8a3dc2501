//! A tiny world of walls for the closed-loop tests: a laser that casts rays, a base with limited
//! acceleration, an odometry that drifts, a mapper that knows where the robot is.

use armor_grid::{Geometry, Grid, Occupancy, Point2, Pose2, traverse};

use crate::limits::Velocity;
use crate::surroundings::DriverScan;

const BEAMS: usize = 180;
const RANGE_M: f64 = 8.0;
const ACCELERATION_MPS2: f64 = 1.0;

/// Walls as segments.
pub(crate) struct BoxWalls(pub(crate) Vec<(Point2, Point2)>);

impl BoxWalls {
    /// Adds walls from point to point.
    pub(crate) fn line(&mut self, points: &[(f64, f64)]) {
        let point = |at: (f64, f64)| Point2::new(at.0, at.1);
        self.0.extend(points.windows(2).map(|pair| (point(pair[0]), point(pair[1]))));
    }

    /// Puts six boxes of 10 to 40 cm anywhere but near the places to keep free.
    pub(crate) fn clutter(&mut self, seed: u64, keep_free: &[Point2]) {
        let mut random = fastrand::Rng::with_seed(seed);
        for _ in 0..6 {
            let (x, y) = (0.5 + 7.0 * random.f64(), 0.5 + 4.0 * random.f64());
            let size = 0.1 + 0.3 * random.f64();
            let middle = Point2::new(x + size / 2.0, y + size / 2.0);
            if keep_free.iter().all(|place| place.distance_m(middle) > 0.9) {
                self.line(&[(x, y), (x + size, y), (x + size, y + size), (x, y + size), (x, y)]);
            }
        }
    }

    /// Distance along a ray to the first wall, in metres; infinite if there is none.
    fn cast(&self, from: Point2, direction_rad: f64) -> f64 {
        let (sin, cos) = direction_rad.sin_cos();
        let hit = |&(a, b): &(Point2, Point2)| {
            let (wx, wy) = (b.x_m - a.x_m, b.y_m - a.y_m);
            let (ax, ay) = (a.x_m - from.x_m, a.y_m - from.y_m);
            let cross = cos * wy - sin * wx;
            let along_m = (ax * wy - ay * wx) / cross;
            let on_wall = (ax * sin - ay * cos) / cross;
            ((0.0..=1.0).contains(&on_wall) && along_m >= 0.0).then_some(along_m)
        };
        self.0.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
    }

    /// Distance from a point to the nearest wall, in metres.
    pub(crate) fn distance_m(&self, point: Point2) -> f64 {
        let away = |&(a, b): &(Point2, Point2)| {
            let (wx, wy) = (b.x_m - a.x_m, b.y_m - a.y_m);
            let along = ((point.x_m - a.x_m) * wx + (point.y_m - a.y_m) * wy) / (wx * wx + wy * wy);
            a.toward(b, along.clamp(0.0, 1.0)).distance_m(point)
        };
        self.0.iter().map(away).fold(f64::INFINITY, f64::min)
    }
}

/// How wrong the robot's senses are.
#[derive(Clone, Copy)]
pub(crate) struct Noise {
    pub(crate) range_m: f64,
    pub(crate) pose_m: f64,
    /// Part of each turn and each metre that the odometry gets wrong.
    pub(crate) odometry: f64,
    pub(crate) seed: u64,
}

pub(crate) struct BoxWorld {
    pub(crate) walls: BoxWalls,
    pub(crate) robot: Pose2,
    pub(crate) odometry: Pose2,
    pub(crate) map: Grid<Occupancy>,
    velocity: Velocity,
    field_rad: f64,
    noise: Noise,
    random: fastrand::Rng,
}

impl BoxWorld {
    /// `field_rad` is the angle the laser looks over, ahead in the middle.
    pub(crate) fn new(walls: BoxWalls, robot: Pose2, field_rad: f64, noise: Noise) -> Self {
        let geometry = Geometry {
            origin: Point2::new(-0.5, -0.5),
            resolution_m: 0.05,
            width: 180,
            height: 120,
        };
        Self {
            walls,
            robot,
            // Somewhere else than on the map, as odometry is.
            odometry: Pose2::new(3.0, -2.0, 1.0),
            map: Grid::filled(geometry, Occupancy::Unknown),
            velocity: Velocity::ZERO,
            field_rad,
            noise,
            random: fastrand::Rng::with_seed(noise.seed),
        }
    }

    /// Moves the base for `interval_s` towards the commanded velocity.
    pub(crate) fn drive(&mut self, command: Velocity, interval_s: f64) {
        let most = ACCELERATION_MPS2 * interval_s;
        let change = (command.speed_mps - self.velocity.speed_mps).clamp(-most, most);
        self.velocity.speed_mps += change;
        self.velocity.turn_radps = command.turn_radps;
        let Velocity { speed_mps, turn_radps } = self.velocity;
        self.robot = self.robot.after_arc(speed_mps, turn_radps, interval_s);
        let wrong = self.noise.odometry;
        let slip = 1.0 + wrong * self.normal();
        let twist_radps = turn_radps * (1.0 + wrong * self.normal()) + wrong * speed_mps;
        self.odometry = self.odometry.after_arc(speed_mps * slip, twist_radps, interval_s);
    }

    /// Takes a scan and draws it into the map, seen from where the robot really is.
    pub(crate) fn scan(&mut self, stamp_s: f64) -> DriverScan {
        let step_rad = self.field_rad / BEAMS as f64;
        let first_rad = (step_rad - self.field_rad) / 2.0;
        let mut ranges_m = Vec::with_capacity(BEAMS);
        for beam in 0..BEAMS {
            let direction_rad = self.robot.yaw_rad + first_rad + beam as f64 * step_rad;
            let true_m = self.walls.cast(self.robot.point(), direction_rad);
            let range_m = true_m + self.noise.range_m * self.normal();
            ranges_m.push(if range_m <= RANGE_M { range_m } else { f64::INFINITY });
            self.draw(direction_rad, range_m);
        }
        DriverScan { stamp_s, robot_from_laser: Pose2::IDENTITY, first_rad, step_rad, ranges_m }
    }

    /// The pose as a mapper would publish it.
    pub(crate) fn mapped_pose(&mut self) -> Pose2 {
        let off_m = self.noise.pose_m;
        let error = Pose2::new(off_m * self.normal(), off_m * self.normal(), off_m * self.normal());
        self.robot.compose(error)
    }

    fn draw(&mut self, direction_rad: f64, range_m: f64) {
        let hit = range_m <= RANGE_M;
        let ray = Pose2::new(self.robot.x_m, self.robot.y_m, direction_rad);
        let end = ray.apply(Point2::new(range_m.min(RANGE_M), 0.0));
        let geometry = *self.map.geometry();
        let last = geometry.cell_at(end);
        for cell in traverse(&geometry, self.robot.point(), end) {
            if let Some(known) = self.map.get_mut(cell) {
                if cell == last && hit {
                    *known = Occupancy::Occupied;
                } else if *known == Occupancy::Unknown {
                    *known = Occupancy::Free;
                }
            }
        }
    }

    /// Roughly normal, variance 1: the sum of twelve uniform numbers.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.random.f64()).sum::<f64>() - 6.0
    }
}

/// Two rooms of 4 x 5 m, a wall between them with one door of `door_m`, and a box in each.
pub(crate) fn two_rooms(door_m: f64) -> BoxWalls {
    let mut walls = BoxWalls(Vec::new());
    let mut line = |points: &[(f64, f64)]| walls.line(points);
    line(&[(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0), (0.0, 0.0)]);
    let (low, high) = (2.5 - door_m / 2.0, 2.5 + door_m / 2.0);
    line(&[(3.95, 0.0), (3.95, low), (4.05, low), (4.05, 0.0)]);
    line(&[(3.95, 5.0), (3.95, high), (4.05, high), (4.05, 5.0)]);
    line(&[(1.8, 1.9), (2.4, 1.9), (2.4, 2.5), (1.8, 2.5), (1.8, 1.9)]);
    line(&[(5.6, 2.6), (6.4, 2.6), (6.4, 3.2), (5.6, 3.2), (5.6, 2.6)]);
    walls
}
