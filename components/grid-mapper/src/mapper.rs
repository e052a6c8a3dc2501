//! The online mapper: odometry predicts, the map corrects, and what the corrected scan adds is
//! drawn into the map. Deterministic: the same scans give the same map.

use crate::field::{Field, Window};
use crate::grid::{Grid, Snapshot};
use crate::pose::{Point, Pose, wrapped};
use crate::refine::{Expected, Refined, refine};
use crate::scan::{Reach, Scan, thinned};
use crate::search::{Prior, search};
use nalgebra::{Matrix3, Vector3};

/// How the mapper works; the defaults are good for buildings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Side of a map cell, metres.
    pub resolution_m: f64,
    /// Where the laser sits on the robot.
    pub robot_from_laser: Pose,
    /// How far beams are believed.
    pub reach: Reach,
    /// The map is drawn on after moving this far, metres …
    pub keyframe_m: f64,
    /// … or turning this far, radians …
    pub keyframe_rad: f64,
    /// … or after this long, seconds.
    pub keyframe_s: f64,
    /// Expected odometry error: share of the distance travelled.
    pub slip: f64,
    /// Expected odometry error: radians of heading per metre travelled.
    pub bend_radpm: f64,
    /// Expected odometry error: share of the angle turned.
    pub skid: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            resolution_m: 0.05,
            robot_from_laser: Pose::default(),
            reach: Reach { hit_m: 40.0, clear_m: 4.0 },
            keyframe_m: 0.2,
            keyframe_rad: 10f64.to_radians(),
            keyframe_s: 10.0,
            slip: 0.06,
            bend_radpm: 0.02,
            skid: 0.08,
        }
    }
}

/// Where the robot was when a scan was taken.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// `map_from_robot`.
    pub pose: Pose,
    /// Covariance of x, y (m²) and heading (rad²).
    pub covariance: Matrix3<f64>,
    /// Share of the scan's points that lie on surfaces of the map, 0..1.
    pub score: f64,
    /// Whether the map changed.
    pub drawn: bool,
    /// `map_from_odom`: what brings the odometry into the map.
    pub map_from_odom: Pose,
}

/// Errors of odometry that no motion explains: stamps, vibration.
const REST_M: f64 = 0.02;
const REST_RAD: f64 = 0.006;
/// The search looks this many sigmas around the prediction.
const SEARCH_SIGMAS: f64 = 3.0;
const LEAST_WINDOW_M: f64 = 0.2;
const LEAST_WINDOW_RAD: f64 = 0.35;
/// Blur of the likelihood field, metres.
const BLUR_M: f64 = 0.1;
/// Levels of maxima above the finest; squares of 8 cells at the top.
const LEVELS: usize = 3;
/// Scans with fewer points are not matched.
const FEWEST_POINTS: usize = 8;
/// Below this fit a match is not believed, and odometry goes on alone.
const BELIEVED_SUPPORT: f64 = 0.35;
/// One scan alone is not believed by anyone who plans on the map: the first few are all drawn.
const FIRST_KEYFRAMES: u32 = 6;
const EVERYTHING: u16 = u16::MAX;

/// Builds a map from scans and odometry, one scan at a time.
pub struct Mapper {
    config: Config,
    grid: Grid,
    field: Option<Field>,
    travelled_m: f64,
    last: Option<Last>,
    drawn: Option<(Pose, f64)>,
    /// Scans drawn so far, up to [`FIRST_KEYFRAMES`].
    keyframes: u32,
}

struct Last {
    pose: Pose,
    odometry: Pose,
}

impl Mapper {
    /// Makes a mapper whose map begins where the robot stands.
    pub fn new(config: Config) -> Self {
        let grid = Grid::new(config.resolution_m);
        Self { config, grid, field: None, travelled_m: 0.0, last: None, drawn: None, keyframes: 0 }
    }

    /// Places a scan, taken where the odometry says `odometry`, and draws it if it brings news.
    pub fn add(&mut self, odometry: Pose, scan: &Scan) -> Estimate {
        let beams = scan.beams(&self.config.robot_from_laser, self.config.reach);
        let points = thinned(&beams, 2.0 * self.config.resolution_m);
        let (expected, prior) = self.predict(odometry);
        let (pose, covariance, score) = match self.place(&points, &expected, &prior) {
            Some(placed) => (placed.pose, placed.covariance, placed.support),
            None => (expected.pose, expected.information.try_inverse().unwrap_or_default(), 0.0),
        };
        let drawn = self.is_news(&pose, scan.stamp_s);
        if drawn {
            let mount = self.config.robot_from_laser;
            let laser = Point { x_m: mount.x_m, y_m: mount.y_m };
            self.grid.insert(&pose, laser, &beams, self.travelled_m);
            self.field = None;
            self.drawn = Some((pose, scan.stamp_s));
            self.keyframes = (self.keyframes + 1).min(FIRST_KEYFRAMES);
        }
        self.last = Some(Last { pose, odometry });
        Estimate { pose, covariance, score, drawn, map_from_odom: pose * odometry.inverse() }
    }

    /// The map as it is now.
    pub fn snapshot(&self) -> Snapshot {
        self.grid.snapshot()
    }

    fn predict(&mut self, odometry: Pose) -> (Expected, Prior) {
        let Some(last) = &self.last else {
            let pose = Pose::default();
            return expectation(pose, 1e-6, 1e-6);
        };
        let motion = last.odometry.inverse() * odometry;
        let distance_m = motion.x_m.hypot(motion.y_m);
        self.travelled_m += distance_m;
        let turned_rad = motion.yaw_rad.abs();
        let sigma_m = REST_M + self.config.slip * distance_m + 0.1 * turned_rad;
        let sigma_rad =
            REST_RAD + self.config.bend_radpm * distance_m + self.config.skid * turned_rad;
        expectation(last.pose * motion, sigma_m, sigma_rad)
    }

    fn place(&mut self, points: &[Point], expected: &Expected, prior: &Prior) -> Option<Refined> {
        if points.len() < FEWEST_POINTS || self.last.is_none() {
            return None;
        }
        let window = self.window(points, prior);
        if !self.field.as_ref().is_some_and(|field| field.window().contains(&window)) {
            let wide = window.widened((1.0 / self.config.resolution_m) as i32);
            self.field = Some(Field::draw(&self.grid, wide, EVERYTHING, BLUR_M, LEVELS));
        }
        let field = self.field.as_ref()?;
        let found = search(field, points, prior, self.config.resolution_m)?;
        let expected = expected.doubted(&found.pose);
        let refined = refine(&self.grid, points, found.pose, &expected, EVERYTHING);
        (refined.support >= BELIEVED_SUPPORT).then_some(refined)
    }

    /// The cells that the search can touch.
    fn window(&self, points: &[Point], prior: &Prior) -> Window {
        let far_m = points.iter().map(|p| p.x_m.hypot(p.y_m)).fold(0.0, f64::max);
        let margin_m = prior.window_m + far_m * prior.window_rad + 3.0 * BLUR_M;
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for point in points.iter().map(|p| prior.pose.apply(*p)) {
            for (axis, metres) in [point.x_m, point.y_m].into_iter().enumerate() {
                low[axis] = low[axis].min(metres - margin_m);
                high[axis] = high[axis].max(metres + margin_m);
            }
        }
        let cell = |metres: f64| (metres / self.config.resolution_m).floor() as i32;
        Window { low: low.map(cell), high: high.map(|metres| cell(metres) + 1) }
    }

    fn is_news(&self, pose: &Pose, stamp_s: f64) -> bool {
        let Some((drawn, drawn_s)) = &self.drawn else { return true };
        self.keyframes < FIRST_KEYFRAMES
            || pose.distance_m(drawn) >= self.config.keyframe_m
            || wrapped(pose.yaw_rad - drawn.yaw_rad).abs() >= self.config.keyframe_rad
            || (stamp_s - drawn_s).abs() >= self.config.keyframe_s
    }
}

fn expectation(pose: Pose, sigma_m: f64, sigma_rad: f64) -> (Expected, Prior) {
    let information = |sigma: f64| 1.0 / (sigma * sigma);
    let diagonal = Vector3::new(information(sigma_m), information(sigma_m), information(sigma_rad));
    let expected = Expected { pose, information: Matrix3::from_diagonal(&diagonal) };
    let window_m = (SEARCH_SIGMAS * sigma_m).max(LEAST_WINDOW_M);
    let window_rad = (SEARCH_SIGMAS * sigma_rad).max(LEAST_WINDOW_RAD);
    (expected, Prior { pose, sigma_m, sigma_rad, window_m, window_rad })
}
