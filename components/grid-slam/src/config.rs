//! How the mapper works, and what it expects of the odometry. The defaults are good for buildings.

use crate::pose::Pose;
use crate::prior::Prior;
use crate::refine::Expected;
use crate::scan::BeamReach;
use nalgebra::{Matrix3, Vector3};

/// How the mapper works; the defaults are good for buildings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Hypotheses about trajectory and map that are followed in parallel.
    pub particles: usize,
    /// The same seed and data give the same map.
    pub seed: u64,
    /// Cores to use; 0 for all there are. It changes nothing but the speed.
    pub threads: usize,
    /// Whether old places are recognised and the whole map is corrected by them.
    pub loop_closing: bool,
    /// Whether walls that are nearly parallel are taken for parallel, so that they measure the
    /// heading.
    pub parallel_walls: bool,
    /// Side of a map cell, metres.
    pub resolution_m: f64,
    /// Where the laser sits on the robot.
    pub robot_from_laser: Pose,
    /// How far beams are believed.
    pub reach: BeamReach,
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
            particles: 8,
            seed: 1,
            threads: 0,
            loop_closing: true,
            parallel_walls: true,
            resolution_m: 0.05,
            robot_from_laser: Pose::default(),
            reach: BeamReach { hit_m: 40.0, clear_m: 4.0 },
            keyframe_m: 0.2,
            keyframe_rad: 10f64.to_radians(),
            keyframe_s: 10.0,
            slip: 0.06,
            bend_radpm: 0.02,
            skid: 0.08,
        }
    }
}

/// Errors of odometry that no motion explains: stamps, vibration.
const REST_M: f64 = 0.02;
const REST_RAD: f64 = 0.006;
/// Turning on the spot moves the wheels' contact points, metres per radian.
const TURN_M: f64 = 0.1;
/// The search looks this many sigmas around the prediction.
const SEARCH_SIGMAS: f64 = 3.0;
const LEAST_WINDOW_M: f64 = 0.2;
const LEAST_WINDOW_RAD: f64 = 0.35;

impl Config {
    /// Where the robot should be that was at `from` and moved by `motion` according to its
    /// odometry, as a Gaussian and as a window to search.
    pub(crate) fn expect_motion(&self, from: &Pose, motion: &Pose) -> (Expected, Prior) {
        let distance_m = motion.x_m.hypot(motion.y_m);
        let turned_rad = motion.yaw_rad.abs();
        let sigma_m = REST_M + self.slip * distance_m + TURN_M * turned_rad;
        let sigma_rad = REST_RAD + self.bend_radpm * distance_m + self.skid * turned_rad;
        let pose = *from * *motion;
        let information = Vector3::new(sigma_m, sigma_m, sigma_rad).map(|s| 1.0 / (s * s));
        let expected = Expected::new(pose, Matrix3::from_diagonal(&information));
        let window_m = (SEARCH_SIGMAS * sigma_m).max(LEAST_WINDOW_M);
        let window_rad = (SEARCH_SIGMAS * sigma_rad).max(LEAST_WINDOW_RAD);
        (expected, Prior { pose, sigma_m, sigma_rad, window_m, window_rad })
    }
}
