//! A corridor around rooms whose walls are 0.1 m thick. Both sides of a wall are seen, one from the
//! corridor and one from a room: the pose must not jump from one to the other.

use armor_grid_slam::config::Config;
use armor_grid_slam::pose::{Pose, wrapped};
use armor_grid_slam::scan::MapperScan;
use armor_grid_slam::slam::Slam;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Solid rectangles, metres: the corner nearest to zero, and the size.
const SOLID: &[[f64; 4]] = &[
    // Around all, 18 m by 12 m.
    [0.0, 0.0, 18.0, 0.2],
    [0.0, 11.8, 18.0, 0.2],
    [0.0, 0.0, 0.2, 12.0],
    [17.8, 0.0, 0.2, 12.0],
    // The rooms: a door to each, and a closed shaft between them.
    [2.3, 2.3, 13.4, 0.1],
    [2.3, 9.6, 2.1, 0.1],
    [5.4, 9.6, 10.3, 0.1],
    [2.3, 2.3, 0.1, 7.4],
    [15.6, 2.3, 0.1, 2.2],
    [15.6, 5.6, 0.1, 4.1],
    [7.4, 2.4, 0.1, 7.2],
    [10.5, 2.4, 0.1, 7.2],
    // What stands around.
    [3.2, 0.2, 1.2, 0.35],
    [12.6, 0.2, 1.6, 0.35],
    [17.4, 7.7, 0.4, 1.4],
    [9.8, 11.45, 1.8, 0.35],
    [0.2, 4.2, 0.35, 0.7],
    [2.4, 4.2, 0.8, 1.8],
    [6.6, 7.2, 0.8, 1.6],
    [12.2, 7.6, 1.8, 0.9],
    [10.6, 2.4, 1.4, 0.6],
];
/// Into one room and out again, around the corner into the other, around to the begin, and into the
/// first room again.
const PATH: &[[f64; 2]] = &[
    [2.0, 10.7],
    [4.9, 10.7],
    [4.9, 7.0],
    [5.0, 3.5],
    [4.9, 7.0],
    [4.9, 10.7],
    [16.7, 10.7],
    [16.7, 5.05],
    [13.0, 5.05],
    [11.4, 6.0],
    [13.0, 5.05],
    [16.7, 5.05],
    [16.7, 1.4],
    [1.3, 1.4],
    [1.3, 10.7],
    [4.9, 10.7],
    [4.9, 7.0],
    [5.0, 3.5],
];
const BEAMS: i32 = 271;
const RANGE_M: f64 = 10.0;
const STEP_M: f64 = 0.1;
const STEP_RAD: f64 = 0.1;
/// Mean over the seeds of the greatest error of a pose, metres.
const BOUND_M: f64 = 0.1;

/// Normally distributed, of variance one.
fn gaussian(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| f64::from(random.next_u32()) / f64::from(u32::MAX)).sum::<f64>() - 6.0
}

/// How far it is from a point in a direction to the first solid.
fn range_m(from: [f64; 2], towards: [f64; 2]) -> f64 {
    let to = |[x, y, width, height]: &[f64; 4]| {
        let (low, high) = ([*x, *y], [x + width, y + height]);
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for axis in 0..2 {
            let [one, other] = [low[axis], high[axis]].map(|at| (at - from[axis]) / towards[axis]);
            (enters, leaves) = (enters.max(one.min(other)), leaves.min(one.max(other)));
        }
        if enters <= leaves { enters } else { f64::INFINITY }
    };
    SOLID.iter().map(to).fold(f64::INFINITY, f64::min)
}

fn seen_scan(truth: &Pose, stamp_s: f64, random: &mut ChaCha8Rng) -> MapperScan {
    let angle = |index: i32| f64::from(index - BEAMS / 2).to_radians();
    let range = |index: i32| {
        let (sin, cos) = (truth.yaw_rad + angle(index)).sin_cos();
        let range_m = range_m([truth.x_m, truth.y_m], [cos, sin]) + 0.01 * gaussian(random);
        if range_m < RANGE_M { range_m as f32 } else { f32::INFINITY }
    };
    MapperScan {
        stamp_s,
        angle_min_rad: angle(0),
        increment_rad: 1f64.to_radians(),
        range_min_m: 0.05,
        range_max_m: RANGE_M,
        ranges_m: (0..BEAMS).map(range).collect(),
    }
}

/// Every pose at which a scan is taken: turns on the spot and straight lines.
fn driven_poses() -> Vec<Pose> {
    let mut poses = vec![Pose::new(PATH[0][0], PATH[0][1], 0.0)];
    for &[x_m, y_m] in &PATH[1..] {
        let from = poses[poses.len() - 1];
        let (dx, dy) = (x_m - from.x_m, y_m - from.y_m);
        let turn_rad = wrapped(dy.atan2(dx) - from.yaw_rad);
        let turns = (turn_rad.abs() / STEP_RAD).ceil();
        let turned =
            |n: i32| Pose { yaw_rad: from.yaw_rad + turn_rad * f64::from(n) / turns, ..from };
        poses.extend((1..=turns as i32).map(turned));
        let steps = (dx.hypot(dy) / STEP_M).ceil();
        let yaw_rad = dy.atan2(dx);
        let moved = |n: i32| {
            let part = f64::from(n) / steps;
            Pose::new(from.x_m + part * dx, from.y_m + part * dy, yaw_rad)
        };
        poses.extend((1..=steps as i32).map(moved));
    }
    poses
}

/// The errors of the poses found in one drive.
struct DriveErrors {
    greatest_m: f64,
    /// Root of the mean square of the heading's, degrees.
    heading_deg: f64,
}

/// Drives the path with odometry that drifts by 1 % of scale and 0.2°/m, and noise.
fn drive(config: Config) -> DriveErrors {
    let mut random = ChaCha8Rng::seed_from_u64(config.seed);
    let mut slam = Slam::new(config);
    let poses = driven_poses();
    let (mut odometry, mut last) = (Pose::default(), poses[0]);
    let (mut greatest_m, mut squares) = (0.0_f64, 0.0);
    for (number, truth) in poses.iter().enumerate() {
        let Pose { x_m, y_m, yaw_rad } = last.inverse() * *truth;
        let bend_rad = 0.2_f64.to_radians() * x_m + 0.01 * yaw_rad;
        let mut noise = |sigma: f64| sigma * gaussian(&mut random);
        let moved = 1.01 * x_m + noise(0.02) * x_m.abs();
        let turned = yaw_rad + bend_rad + noise(0.01) * (x_m.abs() + yaw_rad.abs());
        odometry = odometry * Pose::new(moved, y_m, turned);
        let scan = seen_scan(truth, 0.1 * number as f64, &mut random);
        let found = slam.add(odometry, &scan).pose;
        let truth_in_map = poses[0].inverse() * *truth;
        greatest_m = greatest_m.max(found.distance_m(&truth_in_map));
        squares += wrapped(found.yaw_rad - truth_in_map.yaw_rad).to_degrees().powi(2);
        last = *truth;
    }
    DriveErrors { greatest_m, heading_deg: (squares / poses.len() as f64).sqrt() }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Two seeds in which the walls cause the greatest error. With `ARMOR_FULL` the mean over eight, in
/// some of which it is the drift until the first loop is closed.
#[test]
fn a_wall_is_not_taken_for_its_other_side() {
    let seeds = if is_full() { vec![1, 2, 3, 4, 5, 6, 7, 8] } else { vec![3, 5] };
    let error_m = |seed| drive(Config { seed, ..Config::default() }).greatest_m;
    let errors_m: Vec<_> = seeds.into_iter().map(error_m).collect();
    println!("at most {errors_m:.3?} m off");
    assert!(mean(&errors_m) < BOUND_M, "{errors_m:.3?}");
}

/// The walls of one corridor are parallel to those of another that was left long before.
#[test]
fn parallel_walls_keep_the_heading() {
    let seeds: Vec<_> = if is_full() { (1..=8).collect() } else { vec![3, 6] };
    let heading_deg = |parallel_walls| {
        let drive_once = |seed| drive(Config { seed, parallel_walls, ..Config::default() });
        let errors = seeds.iter().map(|&seed| drive_once(seed).heading_deg);
        errors.collect::<Vec<_>>()
    };
    let (with_deg, without_deg) = (heading_deg(true), heading_deg(false));
    println!("heading off by {with_deg:.3?}, without the walls {without_deg:.3?} degrees");
    // Over the eight seeds 0.18 degrees in the mean, without the walls 0.31.
    assert!(mean(&with_deg) < 0.8 * mean(&without_deg));
}

fn is_full() -> bool {
    std::env::var_os("ARMOR_FULL").is_some()
}
