//! One hypothesis: a trajectory and the map drawn along it. A new scan proposes its next pose: from
//! the optimum of the scan on its own map, by samples around it (Grisetti, Stachniss and Burgard,
//! T-RO 2007, section III).

use crate::config::Config;
use crate::grid::SurfaceGrid;
use crate::matching::{BELIEVED_SUPPORT, place_scan};
use crate::pose::{Point, Pose};
use crate::refine::{BEAM_WORTH, Expected, Landscape, move_pose, pose_difference, refine};
use crate::scan::{Beam, ScanPoint};
use crate::wall_directions::WallCompass;
use nalgebra::{Matrix3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// Samples around the optimum, in pairs on opposite sides.
const SAMPLES: usize = 16;
/// They are drawn this much wider than the optimum's own Gaussian, as deviations.
const WIDER: f64 = 1.5;
/// Where another hypothesis' motion fits this much worse on the own map, the own is searched for.
const FOLLOWED_SUPPORT: f64 = 0.8;

/// A drawn scan on a particle's trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScanStep {
    /// Where it fits best: the middle of the proposal, not the sample that was drawn from it.
    pub(crate) pose: Pose,
    /// How well that is known from the map before it.
    pub(crate) covariance: Matrix3<f64>,
}

/// A trajectory and its map.
#[derive(Clone)]
pub(crate) struct Particle {
    pub(crate) pose: Pose,
    pub(crate) grid: SurfaceGrid,
    /// Logarithm of its weight.
    pub(crate) weight: f64,
    /// Its trajectory since the last step that all particles share.
    pub(crate) steps: Vec<ScanStep>,
}

/// A drawn scan, as all particles receive it.
pub(crate) struct ScanNews<'a> {
    pub(crate) points: &'a [ScanPoint],
    pub(crate) beams: &'a [Beam],
    /// The motion since the last drawn scan according to the odometry.
    pub(crate) odometry: Pose,
    /// … and as the best particle saw it, with the share of points that lay on its map then.
    pub(crate) followed: Pose,
    pub(crate) support: f64,
    /// What its walls measure.
    pub(crate) compass: Option<&'a WallCompass>,
    /// Number of the scan.
    pub(crate) number: u64,
}

impl Particle {
    /// Advances by one scan: updates the weight, draws a pose from the proposal, and inserts the
    /// scan into the map at that pose.
    pub(crate) fn go_on(&mut self, config: &Config, news: &ScanNews<'_>, index: usize) {
        let (step, pose) = self.propose_pose(config, news, index);
        self.pose = pose;
        self.steps.push(step);
        self.draw(config, &pose, news.beams);
    }

    /// Draws a scan into the map.
    pub(crate) fn draw(&mut self, config: &Config, pose: &Pose, beams: &[Beam]) {
        let laser = config.robot_from_laser;
        self.grid.insert(pose, Point { x_m: laser.x_m, y_m: laser.y_m }, beams);
    }

    fn propose_pose(
        &mut self,
        config: &Config,
        news: &ScanNews<'_>,
        index: usize,
    ) -> (ScanStep, Pose) {
        let (mut expected, prior) = config.expect_motion(&self.pose, &news.odometry);
        let start = self.pose * news.followed;
        expected.wall_heading =
            news.compass.and_then(|compass| compass.measure_heading(start.yaw_rad));
        let near = expected.doubted(&start);
        let mut refined = refine(&self.grid, news.points, start, &near);
        if refined.support < FOLLOWED_SUPPORT * news.support
            && let Some(own) =
                place_scan(&self.grid, &mut None, news.points, &expected, &prior, news.compass)
            && own.support > refined.support
        {
            refined = own;
        }
        let mut random = ParticleRandom::new(config.seed, news.number, index);
        let is_believed = refined.support >= BELIEVED_SUPPORT;
        let (centre, spread) = if is_believed {
            let sharp = refined.information / BEAM_WORTH + near.information;
            (refined.pose, sharp.try_inverse().unwrap_or(refined.covariance))
        } else {
            refined.covariance = expected.information.try_inverse().unwrap_or_default();
            refined.landscape = Landscape::new(&self.grid, news.points, &expected.pose);
            (expected.pose, refined.covariance)
        };
        // The scan may be placed far from where it was supposed to be: there other walls measure.
        expected.wall_heading =
            news.compass.and_then(|compass| compass.measure_heading(centre.yaw_rad));
        let proposal =
            Proposal::sample_pose(&refined.landscape, &expected, &centre, &spread, &mut random);
        self.weight += BEAM_WORTH * proposal.weight;
        let step = ScanStep { pose: centre, covariance: refined.covariance };
        if config.particles == 1 {
            return (step, centre);
        }
        let drawn = move_pose(&proposal.mean, &(proposal.root * random.draw_normals()));
        // In directions that the scan does not measure, such as along an aisle, particles would only
        // guess apart, and the one whose guess fits marks on a bare wall best would win.
        let measured = expected.measured_part(&refined.information);
        (step, move_pose(&centre, &(measured * pose_difference(&drawn, &centre))))
    }
}

/// The Gaussian that the next pose is drawn from.
struct Proposal {
    mean: Pose,
    /// A square root of its covariance.
    root: Matrix3<f64>,
    /// Logarithm of how likely the scan was: the integral over likelihood times motion.
    weight: f64,
}

impl Proposal {
    fn sample_pose(
        landscape: &Landscape,
        expected: &Expected,
        centre: &Pose,
        spread: &Matrix3<f64>,
        random: &mut ParticleRandom,
    ) -> Self {
        let root = spread.cholesky().map_or_else(Matrix3::zeros, |c| c.l());
        let mut samples = Vec::with_capacity(SAMPLES);
        for number in 0..SAMPLES {
            let drawn =
                if number % 2 == 0 { random.draw_normals() } else { -samples_last(&samples) };
            let pose = move_pose(centre, &(root * drawn * WIDER));
            let value = landscape.likelihood(&pose) + expected.likelihood(&pose);
            samples.push((drawn, value + drawn.norm_squared() / 2.0));
        }
        let most = samples.iter().map(|(_, value)| *value).fold(f64::NEG_INFINITY, f64::max);
        let all: f64 = samples.iter().map(|(_, value)| (value - most).exp()).sum();
        let share = |value: f64| (value - most).exp() / all;
        let mean: Vector3<f64> = samples.iter().map(|(drawn, value)| drawn * share(*value)).sum();
        let about = |drawn: &Vector3<f64>| (drawn - mean) * (drawn - mean).transpose();
        let covariance: Matrix3<f64> =
            samples.iter().map(|(drawn, value)| about(drawn) * share(*value)).sum();
        // In the units of the samples; the little that is added keeps few heavy samples a Gaussian.
        let inner = (covariance * WIDER * WIDER + Matrix3::identity() * 0.05).cholesky();
        let weight = most + (all / SAMPLES as f64).ln() + root.determinant().max(1e-300).ln();
        Self {
            mean: move_pose(centre, &(root * mean * WIDER)),
            root: inner.map_or(root, |inner| root * inner.l()),
            weight,
        }
    }
}

fn samples_last(samples: &[(Vector3<f64>, f64)]) -> Vector3<f64> {
    samples.last().map_or_else(Vector3::zeros, |(drawn, _)| *drawn)
}

/// Random numbers of one particle at one scan, so that no thread's turn matters.
pub(crate) struct ParticleRandom(ChaCha8Rng);

impl ParticleRandom {
    pub(crate) fn new(seed: u64, scan: u64, particle: usize) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        // Fewer than 2^16 particles.
        generator.set_stream(scan << 16 | particle as u64);
        Self(generator)
    }

    /// Draws evenly from 0 to just under 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        // The 53 bits that a double can hold.
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Draws three independent normal numbers (Box and Muller).
    fn draw_normals(&mut self) -> Vector3<f64> {
        let mut pair = || {
            let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
            let (sin, cos) = (TAU * self.uniform()).sin_cos();
            (radius * cos, radius * sin)
        };
        let ((a, b), (c, _)) = (pair(), pair());
        Vector3::new(a, b, c)
    }
}
