//! What the wheels believe: the true motion, with the noise of the odometry motion model of Thrun,
//! Burgard & Fox, Probabilistic Robotics, section 5.4 (table 5.6), and with two systematic faults
//! that real robots have, a wrong wheel size (scale) and a pull to one side (heading bias).
//!
//! The book's variances hold for one leg of motion: rotate, translate, rotate. A simulation step is
//! a short leg, so its variances are divided by its share of [`LEG_S`]: whatever the step, one
//! second of steady motion has the spread that the book gives a leg of one second.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::pose::{Portable, Pose2, wrap_angle};
use crate::random::{NoiseStream, Random};

/// The time that a leg of the motion model stands for, in seconds.
pub const LEG_S: f64 = 1.0;

/// How wrong the odometry is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryModel {
    /// Variance of a rotation per squared rotation (α₁, no unit).
    pub alpha1: f64,
    /// Variance of a rotation per squared translation (α₂, rad²/m²).
    pub alpha2: f64,
    /// Variance of a translation per squared translation (α₃, no unit).
    pub alpha3: f64,
    /// Variance of a translation per squared rotation (α₄, m²/rad²).
    pub alpha4: f64,
    /// Measured length per true length: 1 is right, 1.02 makes paths 2% too long.
    pub scale: f64,
    /// Turn to the left that is believed in per metre driven, in radians.
    pub bias_rad_per_m: f64,
}

impl Default for OdometryModel {
    fn default() -> Self {
        Self {
            alpha1: 0.002,
            alpha2: 0.000_5,
            alpha3: 0.002,
            alpha4: 0.000_2,
            scale: 1.01,
            bias_rad_per_m: 0.2f64.to_radians(),
        }
    }
}

impl OdometryModel {
    /// No fault at all: the odometry is the truth, seen from the start.
    pub const EXACT: Self = Self {
        alpha1: 0.0,
        alpha2: 0.0,
        alpha3: 0.0,
        alpha4: 0.0,
        scale: 1.0,
        bias_rad_per_m: 0.0,
    };
}

/// The estimate of the wheels, which drifts away from the truth.
#[derive(Clone, Debug)]
pub struct WheelOdometry {
    model: OdometryModel,
    random: Random,
    pose: Pose2,
}

impl WheelOdometry {
    /// Starts at the origin of the odom frame, with the odometry stream of a seed.
    pub fn new(model: OdometryModel, seed: u64) -> Self {
        Self { model, random: Random::new(seed, NoiseStream::Odometry), pose: Pose2::default() }
    }

    /// Where the wheels believe the base is: odom_from_base.
    pub fn pose(&self) -> Pose2 {
        self.pose
    }

    /// Adds a true motion from one pose to the next, made in `step_s` seconds.
    pub fn moved(&mut self, from: Pose2, to: Pose2, step_s: f64) {
        self.slipped(from, to, 0.0, step_s);
    }

    /// Adds a true motion for which the wheels turned further: a share of it, less than 1, moved
    /// nothing.
    pub fn slipped(&mut self, from: Pose2, to: Pose2, lost: f64, step_s: f64) {
        let OdometryLeg { first_rad, length_m, second_rad } =
            OdometryLeg::between(from, to).times(1.0 / (1.0 - lost));
        let OdometryModel { alpha1, alpha2, alpha3, alpha4, scale, bias_rad_per_m } = self.model;
        let legs_per_step = LEG_S / step_s;
        let mut noise = |variance: f64| self.random.normal(libm::sqrt(variance * legs_per_step));
        let length_squared = length_m * length_m;
        let first = first_rad + noise(alpha1 * first_rad * first_rad + alpha2 * length_squared);
        let rotations_squared = first_rad * first_rad + second_rad * second_rad;
        let length = length_m * scale + noise(alpha3 * length_squared + alpha4 * rotations_squared);
        let second = second_rad
            + noise(alpha1 * second_rad * second_rad + alpha2 * length_squared)
            + bias_rad_per_m * length_m.abs();
        let ahead = self.pose.then(Pose2::new(0.0, 0.0, first));
        self.pose = ahead.then(Pose2::new(length, 0.0, second));
    }
}

/// A motion taken apart into a rotation, a straight motion (negative: backwards) and a rotation.
struct OdometryLeg {
    first_rad: f64,
    length_m: f64,
    second_rad: f64,
}

impl OdometryLeg {
    fn times(self, factor: f64) -> Self {
        let Self { first_rad, length_m, second_rad } = self;
        Self {
            first_rad: first_rad * factor,
            length_m: length_m * factor,
            second_rad: second_rad * factor,
        }
    }
}

/// Below this length a motion has no direction, in metres.
const STANDING_M: f64 = 1e-9;

impl OdometryLeg {
    fn between(from: Pose2, to: Pose2) -> Self {
        let turn_rad = wrap_angle(to.yaw_rad - from.yaw_rad);
        let (x_m, y_m) = (to.x_m - from.x_m, to.y_m - from.y_m);
        let length_m = libm::hypot(x_m, y_m);
        if length_m < STANDING_M {
            return Self { first_rad: 0.0, length_m: 0.0, second_rad: turn_rad };
        }
        let first_rad = wrap_angle(libm::atan2(y_m, x_m) - from.yaw_rad);
        // A base that backs up does not turn round twice, as the book's formula would have it.
        let (first_rad, length_m) = if first_rad.abs() > FRAC_PI_2 {
            (wrap_angle(first_rad + PI), -length_m)
        } else {
            (first_rad, length_m)
        };
        Self { first_rad, length_m, second_rad: wrap_angle(turn_rad - first_rad) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 0.01;

    /// Feeds a steady motion of one second in steps and gives back the estimate.
    fn second_of(model: OdometryModel, seed: u64, speed_mps: f64, turn_radps: f64) -> Pose2 {
        let mut odometry = WheelOdometry::new(model, seed);
        let mut pose = Pose2::default();
        for _ in 0..100 {
            let next = pose.then(Pose2::new(0.0, 0.0, turn_radps * STEP_S / 2.0)).then(Pose2::new(
                speed_mps * STEP_S,
                0.0,
                turn_radps * STEP_S / 2.0,
            ));
            odometry.moved(pose, next, STEP_S);
            pose = next;
        }
        odometry.pose()
    }

    /// Mean and variance over 2,000 seeds of one number of the estimate.
    fn statistics(
        model: OdometryModel,
        motion: (f64, f64),
        number: impl Fn(Pose2) -> f64,
    ) -> (f64, f64) {
        let values: Vec<f64> =
            (0..2000).map(|seed| number(second_of(model, seed, motion.0, motion.1))).collect();
        let mean = values.iter().sum::<f64>() / 2000.0;
        (mean, values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 2000.0)
    }

    #[track_caller]
    fn check(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() <= tolerance, "{value}, expected {expected}");
    }

    #[test]
    fn without_faults_it_is_the_truth() {
        for (speed_mps, turn_radps) in [(1.0, 0.0), (-1.0, 0.5), (0.7, -2.0), (0.0, 3.0)] {
            let pose = second_of(OdometryModel::EXACT, 1, speed_mps, turn_radps);
            check(pose.yaw_rad, turn_radps, 1e-9);
            let chord_m = libm::hypot(pose.x_m, pose.y_m);
            let half_rad: f64 = turn_radps / 2.0;
            let sinc = if half_rad == 0.0 { 1.0 } else { half_rad.sin() / half_rad };
            check(chord_m, (speed_mps * sinc).abs(), 1e-4);
            assert_eq!(pose.x_m < -1e-9, speed_mps < 0.0);
        }
    }

    #[test]
    fn the_wheels_count_what_slips() {
        let mut odometry = WheelOdometry::new(OdometryModel::EXACT, 1);
        odometry.slipped(Pose2::default(), Pose2::new(0.3, 0.0, 0.0), 0.4, 1.0);
        check(odometry.pose().x_m, 0.5, 1e-12);
        odometry.slipped(Pose2::default(), Pose2::new(0.0, 0.0, 0.1), 0.5, 1.0);
        check(odometry.pose().yaw_rad, 0.2, 1e-12);
    }

    #[test]
    fn a_second_straight_on_spreads_as_in_the_book() {
        let model = OdometryModel { alpha2: 0.01, alpha3: 0.02, ..OdometryModel::EXACT };
        let (mean_m, variance) =
            statistics(OdometryModel { alpha2: 0.0, ..model }, (0.5, 0.0), |pose| pose.x_m);
        check(mean_m, 0.5, 0.006);
        check(variance, 0.02 * 0.25, 0.02 * 0.25 * 0.12);
        // Both rotations of a leg carry α₂.
        let (mean_rad, variance) = statistics(model, (0.5, 0.0), |pose| pose.yaw_rad);
        check(mean_rad, 0.0, 0.006);
        check(variance, 2.0 * 0.01 * 0.25, 2.0 * 0.01 * 0.25 * 0.12);
    }

    #[test]
    fn a_second_on_the_spot_spreads_as_in_the_book() {
        let model = OdometryModel { alpha1: 0.03, alpha4: 0.001, ..OdometryModel::EXACT };
        let (mean_rad, variance) = statistics(model, (0.0, 1.0), |pose| pose.yaw_rad);
        check(mean_rad, 1.0, 0.012);
        check(variance, 0.03, 0.03 * 0.12);
        let moved = statistics(model, (0.0, 1.0), |pose| pose.x_m * pose.x_m + pose.y_m * pose.y_m);
        check(moved.0, 0.001, 0.001 * 0.12);
    }

    #[test]
    fn the_spread_does_not_depend_on_the_step() {
        let model = OdometryModel { alpha3: 0.02, ..OdometryModel::EXACT };
        let end = |seed| {
            let mut odometry = WheelOdometry::new(model, seed);
            odometry.moved(Pose2::default(), Pose2::new(0.5, 0.0, 0.0), 1.0);
            odometry.pose().x_m - 0.5
        };
        let variance = (0..2000).map(|seed| end(seed) * end(seed)).sum::<f64>() / 2000.0;
        check(variance, 0.02 * 0.25, 0.02 * 0.25 * 0.12);
    }

    #[test]
    fn scale_and_bias_are_systematic() {
        let model = OdometryModel { scale: 1.02, bias_rad_per_m: 0.1, ..OdometryModel::EXACT };
        let forward = second_of(model, 1, 1.0, 0.0);
        check(forward.yaw_rad, 0.1, 1e-9);
        check(libm::hypot(forward.x_m, forward.y_m), 1.02, 0.001);
        check(second_of(model, 1, -1.0, 0.0).yaw_rad, 0.1, 1e-9);
        check(second_of(model, 1, 0.0, 1.0).yaw_rad, 1.0, 1e-9);
    }

    #[test]
    fn a_seed_repeats_a_run() {
        let model = OdometryModel::default();
        assert_eq!(second_of(model, 4, 0.5, 0.2), second_of(model, 4, 0.5, 0.2));
        assert_ne!(second_of(model, 4, 0.5, 0.2), second_of(model, 5, 0.5, 0.2));
    }
}
