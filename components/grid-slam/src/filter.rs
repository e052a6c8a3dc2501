//! The front: a Rao-Blackwellized particle filter on occupancy grids (Grisetti, Stachniss and
//! Burgard, *Improved Techniques for Grid Mapping With Rao-Blackwellized Particle Filters*, T-RO
//! 2007). The best particle follows the robot scan by scan; all of them advance when a scan brings
//! news. Deterministic for a seed, whatever the number of threads.

use crate::config::Config;
use crate::field::LikelihoodField;
use crate::grid::SurfaceGrid;
use crate::matching::place_scan;
use crate::particle::{Particle, ParticleRandom, ScanNews, ScanStep};
use crate::pose::{Pose, wrapped};
use crate::refine::pose_difference;
use crate::scan::{Beam, ScanPoint};
use crate::snapshot::GridSnapshot;
use crate::wall_directions::{StraightWall, WallCompass, WallDirections, find_straight_walls};
use nalgebra::Matrix3;
use std::num::NonZero;

/// No planner relies on one scan alone: the first few are all drawn.
const FIRST_KEYFRAMES: u64 = 6;
/// Particles are resampled when their effective number falls below this share.
const RESAMPLED_SHARE: f64 = 0.5;

/// Where the robot was when a scan was taken.
#[derive(Clone, Copy, Debug)]
pub struct ScanEstimate {
    /// `map_from_robot`.
    pub pose: Pose,
    /// Covariance of x, y (m²) and heading (rad²).
    pub covariance: Matrix3<f64>,
    /// Share of the scan's points that lie on surfaces of the map, 0..1.
    pub score: f64,
    /// Effective number of particles.
    pub effective: f64,
    /// Whether the map changed.
    pub drawn: bool,
    /// `map_from_odom`: what brings the odometry into the map.
    pub map_from_odom: Pose,
}

/// Builds maps from scans and odometry, one scan at a time.
pub(crate) struct ParticleFilter {
    config: Config,
    particles: Vec<Particle>,
    best: usize,
    effective: f64,
    /// The best particle's likelihood field, while its map does not change.
    field: Option<LikelihoodField>,
    directions: WallDirections,
    travelled_m: f64,
    /// Where the best particle sees the robot, and the odometry of that moment.
    followed: Option<(Pose, Pose)>,
    drawn: Option<DrawnScan>,
    /// Number of scans drawn.
    count: u64,
}

/// The last scan that was drawn.
struct DrawnScan {
    odometry: Pose,
    stamp_s: f64,
}

impl ParticleFilter {
    /// Makes a filter whose map begins where the robot stands.
    pub(crate) fn new(config: Config) -> Self {
        let grid = SurfaceGrid::new(config.resolution_m);
        let pose = Pose::default();
        let count = config.particles.max(1);
        let one = Particle { pose, grid, weight: -(count as f64).ln(), steps: Vec::new() };
        Self {
            config,
            particles: vec![one; count],
            best: 0,
            effective: count as f64,
            field: None,
            directions: WallDirections::default(),
            travelled_m: 0.0,
            followed: None,
            drawn: None,
            count: 0,
        }
    }

    /// Places a scan, taken at the odometry pose `odometry`, and draws it if it brings news.
    pub(crate) fn add(
        &mut self,
        odometry: Pose,
        stamp_s: f64,
        beams: &[Beam],
        points: &[ScanPoint],
    ) -> ScanEstimate {
        let walls = self.find_walls(beams);
        let compass = self.directions.build_compass(&walls);
        let (mut pose, mut covariance, score) =
            self.follow_motion(odometry, points, compass.as_ref());
        let drawn = self.is_news(&pose, stamp_s);
        if drawn {
            let from = self.drawn.as_ref().map_or(odometry, |drawn| drawn.odometry);
            let news = ScanNews {
                points,
                beams,
                odometry: from.inverse() * odometry,
                followed: self.keyframe().inverse() * pose,
                support: score,
                compass: compass.as_ref(),
                number: self.count,
            };
            self.go_on(&news);
            self.directions.count_walls(&walls, &self.keyframe());
            self.drawn = Some(DrawnScan { odometry, stamp_s });
            (pose, covariance) = (self.keyframe(), self.particle_covariance());
        }
        self.followed = Some((pose, odometry));
        let map_from_odom = pose * odometry.inverse();
        let effective = self.effective;
        ScanEstimate { pose, covariance, score, effective, drawn, map_from_odom }
    }

    /// Where the best particle took the last scan that was drawn.
    pub(crate) fn keyframe(&self) -> Pose {
        self.steps().last().map_or(Pose::default(), |step| step.pose)
    }

    /// Where the best particle sees the robot.
    pub(crate) fn robot(&self) -> Pose {
        self.followed.map_or(Pose::default(), |(pose, _)| pose)
    }

    /// Where each particle has the robot: it has gone on from its last drawn scan as the best one
    /// has.
    pub(crate) fn robots(&self) -> impl Iterator<Item = Pose> + '_ {
        let since = self.keyframe().inverse() * self.robot();
        self.particles.iter().map(move |particle| particle.pose * since)
    }

    /// The end of the best particle's trajectory: the part that resampling may still replace.
    pub(crate) fn steps(&self) -> &[ScanStep] {
        &self.particles[self.best].steps
    }

    /// Way driven by the odometry, metres.
    pub(crate) fn travelled_m(&self) -> f64 {
        self.travelled_m
    }

    /// The best particle's map.
    pub(crate) fn snapshot(&self) -> GridSnapshot {
        self.particles[self.best].grid.snapshot()
    }

    /// Tiles of all particles' maps: how many there are, and how many they would be unshared.
    pub(crate) fn tiles(&self) -> (usize, usize) {
        crate::grid::shared_tiles(self.particles.iter().map(|particle| &particle.grid))
    }

    /// Redraws the map from scans at other poses, the last of which is where the robot was at
    /// the last drawn scan; all particles continue from there.
    pub(crate) fn redraw_map<'a>(&mut self, scans: impl Iterator<Item = (Pose, &'a [Beam])>) {
        let before = self.keyframe();
        let grid = SurfaceGrid::new(self.config.resolution_m);
        let weight = -(self.particles.len() as f64).ln();
        let mut one = Particle { pose: before, grid, weight, steps: Vec::new() };
        self.directions = WallDirections::default();
        for (pose, beams) in scans {
            one.draw(&self.config, &pose, beams);
            self.directions.count_walls(&self.find_walls(beams), &pose);
            one.pose = pose;
        }
        one.steps.push(ScanStep { pose: one.pose, covariance: Matrix3::identity() * 1e-6 });
        if let Some((followed, _)) = &mut self.followed {
            *followed = one.pose * (before.inverse() * *followed);
        }
        self.particles = vec![one; self.particles.len()];
        (self.best, self.field) = (0, None);
        self.effective = self.particles.len() as f64;
    }

    /// Makes a filter that knows a map, as drawn from scans at their poses, and not yet where the
    /// robot is on it.
    pub(crate) fn restore<'a>(
        config: Config,
        scans: impl ExactSizeIterator<Item = (Pose, &'a [Beam])>,
        travelled_m: f64,
    ) -> Self {
        let count = scans.len() as u64;
        let mut filter = Self { travelled_m, count, ..Self::new(config) };
        filter.redraw_map(scans);
        filter
    }

    /// Sets where the robot is on a restored map, and the odometry of that moment.
    pub(crate) fn set_robot(&mut self, robot: Pose, odometry: Pose, stamp_s: f64) {
        self.followed = Some((robot, odometry));
        // The odometry as it would have been at the last drawn scan, if it had erred nowhere since.
        let odometry = odometry * (robot.inverse() * self.keyframe());
        self.drawn = Some(DrawnScan { odometry, stamp_s });
    }

    /// The best particle's map.
    pub(crate) fn grid(&self) -> &SurfaceGrid {
        &self.particles[self.best].grid
    }

    /// Finds the scan on the best particle's map: pose, covariance and support.
    fn follow_motion(
        &mut self,
        odometry: Pose,
        points: &[ScanPoint],
        compass: Option<&WallCompass>,
    ) -> (Pose, Matrix3<f64>, f64) {
        let Some((from, last)) = self.followed else {
            return (Pose::default(), Matrix3::identity() * 1e-6, 0.0);
        };
        let motion = last.inverse() * odometry;
        self.travelled_m += motion.x_m.hypot(motion.y_m);
        let (expected, prior) = self.config.expect_motion(&from, &motion);
        let grid = &self.particles[self.best].grid;
        match place_scan(grid, &mut self.field, points, &expected, &prior, compass) {
            Some(placed) => (placed.pose, placed.covariance, placed.support),
            None => (expected.pose, expected.information.try_inverse().unwrap_or_default(), 0.0),
        }
    }

    /// Returns the walls of a scan that may measure the heading.
    fn find_walls(&self, beams: &[Beam]) -> Vec<StraightWall> {
        if self.config.parallel_walls { find_straight_walls(beams) } else { Vec::new() }
    }

    fn is_news(&self, pose: &Pose, stamp_s: f64) -> bool {
        let Some(drawn) = &self.drawn else { return true };
        let keyframe = self.keyframe();
        self.count < FIRST_KEYFRAMES
            || pose.distance_m(&keyframe) >= self.config.keyframe_m
            || wrapped(pose.yaw_rad - keyframe.yaw_rad).abs() >= self.config.keyframe_rad
            || (stamp_s - drawn.stamp_s).abs() >= self.config.keyframe_s
    }

    fn go_on(&mut self, news: &ScanNews<'_>) {
        let config = self.config;
        if self.count == 0 {
            // Nothing to compare with yet: all begin alike.
            let one = &mut self.particles[0];
            let covariance = Matrix3::identity() * 1e-6;
            one.steps.push(ScanStep { pose: one.pose, covariance });
            one.draw(&config, &Pose::default(), news.beams);
            self.particles = vec![one.clone(); self.particles.len()];
        } else {
            self.resample_particles(news.number);
            self.forget_shared_steps();
            for_each_particle(&mut self.particles, config.threads, |index, particle| {
                particle.go_on(&config, news, index);
            });
            self.weigh_particles();
        }
        self.field = None;
        self.count += 1;
    }

    /// Brings the weights to a sum of one and finds the best.
    fn weigh_particles(&mut self) {
        let most = self.particles.iter().map(|p| p.weight).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = self.particles.iter().map(|p| (p.weight - most).exp()).sum();
        for particle in &mut self.particles {
            particle.weight -= most + sum.ln();
        }
        let squares: f64 = self.particles.iter().map(|p| (2.0 * p.weight).exp()).sum();
        self.effective = 1.0 / squares;
        let weight = |index: &usize| self.particles[*index].weight;
        let best = (0..self.particles.len()).max_by(|a, b| weight(a).total_cmp(&weight(b)));
        self.best = best.unwrap_or(0);
    }

    /// Resamples the particles by their weights when few of them carry most of it (low variance
    /// sampling, Thrun, Burgard and Fox, *Probabilistic Robotics*, table 4.4).
    fn resample_particles(&mut self, number: u64) {
        let count = self.particles.len();
        if self.effective >= RESAMPLED_SHARE * count as f64 {
            return;
        }
        let first = ParticleRandom::new(self.config.seed, number, count).uniform();
        let (mut chosen, mut passed) = (0, self.particles[0].weight.exp());
        let (mut drawn, mut best) = (Vec::with_capacity(count), None);
        for number in 0..count {
            let at = (first + number as f64) / count as f64;
            while at > passed && chosen + 1 < count {
                chosen += 1;
                passed += self.particles[chosen].weight.exp();
            }
            if chosen == self.best {
                best = best.or(Some(number));
            }
            drawn.push(Particle { weight: -(count as f64).ln(), ..self.particles[chosen].clone() });
        }
        // The heaviest is always drawn, but for rounding.
        self.best = best.unwrap_or(0);
        self.particles = drawn;
        self.effective = count as f64;
    }

    /// Drops the steps that all trajectories have in common: it cannot become another's any more.
    fn forget_shared_steps(&mut self) {
        let Some((first, others)) = self.particles.split_first() else { return };
        let is_shared = |&at: &usize| others.iter().all(|p| p.steps[at] == first.steps[at]);
        let shared = (0..first.steps.len()).take_while(is_shared).count();
        for particle in &mut self.particles {
            // The last step stays: the next one's motion is measured from it.
            let known = shared.saturating_sub(1).min(particle.steps.len() - 1);
            particle.steps.drain(..known);
        }
    }

    /// Covariance of all particles' poses around the best one's.
    fn particle_covariance(&self) -> Matrix3<f64> {
        let best = &self.particles[self.best];
        let mut all = Matrix3::zeros();
        for particle in &self.particles {
            let apart = pose_difference(&particle.pose, &best.pose);
            let own = particle.steps.last().map_or_else(Matrix3::zeros, |step| step.covariance);
            all += (own + apart * apart.transpose()) * particle.weight.exp();
        }
        all
    }
}

/// Does something to every particle on several threads; which one does which changes nothing.
fn for_each_particle(
    particles: &mut [Particle],
    threads: usize,
    work: impl Fn(usize, &mut Particle) + Sync,
) {
    let cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
    let threads = if threads == 0 { cores() } else { threads };
    let share = particles.len().div_ceil(threads.max(1)).max(1);
    let work = |first: usize, chunk: &mut [Particle]| {
        chunk.iter_mut().enumerate().for_each(|(index, one)| work(first + index, one));
    };
    let (mine, others) = particles.split_at_mut(share.min(particles.len()));
    std::thread::scope(|scope| {
        for (number, chunk) in others.chunks_mut(share).enumerate() {
            let work = &work;
            scope.spawn(move || work((number + 1) * share, chunk));
        }
        work(0, mine);
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Point;
    use crate::scan::thinned;

    /// What a laser in the middle of the robot sees in a hall of 12 x 8 m with a corner cut off.
    fn seen(pose: &Pose) -> Vec<Beam> {
        let walls =
            [[1.0, 0.0, 6.0], [-1.0, 0.0, 6.0], [0.0, 1.0, 4.0], [0.0, -1.0, 4.0], [0.6, 0.8, 5.0]];
        let beam = |index: i32| {
            let angle = f64::from(index - 90).to_radians();
            let (sin, cos) = (pose.yaw_rad + angle).sin_cos();
            let to = |[x, y, far]: [f64; 3]| {
                let (towards, gap) = (x * cos + y * sin, far - x * pose.x_m - y * pose.y_m);
                if towards > 1e-9 { gap / towards } else { f64::INFINITY }
            };
            let range_m = walls.map(to).into_iter().fold(f64::INFINITY, f64::min);
            let end = Point { x_m: range_m * angle.cos(), y_m: range_m * angle.sin() };
            Beam { end, hit: true }
        };
        (0..=180).map(beam).collect()
    }

    /// Drives a circle whose odometry bends; gives the poses found, the true ones and the filter.
    fn driven(config: Config) -> (Vec<Pose>, Vec<Pose>, ParticleFilter) {
        let (mut truth, mut odometry) = (Pose::default(), Pose::default());
        let (mut found, mut true_poses) = (Vec::new(), Vec::new());
        let mut filter = ParticleFilter::new(config);
        for step in 0..60 {
            let beams = seen(&truth);
            let points = thinned(&beams, 0.1);
            found.push(filter.add(odometry, f64::from(step), &beams, &points).pose);
            true_poses.push(truth);
            truth = truth * Pose::new(0.3, 0.0, 0.15);
            odometry = odometry * Pose::new(0.31, 0.0, 0.16);
        }
        (found, true_poses, filter)
    }

    #[test]
    fn the_way_is_found_through_bending_odometry() {
        for particles in [1, 12] {
            let (found, truth, filter) = driven(Config { particles, ..Config::default() });
            for (found, truth) in found.iter().zip(&truth) {
                assert!(found.distance_m(truth) < 0.06, "{particles}: {found:?}, not {truth:?}");
            }
            assert!((1.0..=particles as f64 + 1e-9).contains(&filter.effective));
        }
    }

    #[test]
    fn threads_change_nothing_and_seeds_do() {
        let run =
            |threads, seed| driven(Config { particles: 7, threads, seed, ..Config::default() }).0;
        let one = run(1, 5);
        assert_eq!(one, run(3, 5));
        assert_eq!(one, run(16, 5));
        assert_ne!(one, run(1, 6));
    }

    #[test]
    fn resampled_particles_share_their_maps_and_their_past() {
        let (_, _, mut filter) = driven(Config { particles: 20, ..Config::default() });
        let (apart, all) = filter.tiles();
        for (number, particle) in filter.particles.iter_mut().enumerate() {
            particle.weight = if number == 4 { 0.0 } else { -1e3 };
        }
        filter.weigh_particles();
        assert!(filter.best == 4 && filter.effective < 1.01, "{}", filter.effective);
        let [first, second] = [0, 19].map(|number| filter.robots().nth(number));
        assert_ne!(first, second, "each has the robot where it believes it");
        let best = filter.steps().to_vec();
        filter.resample_particles(1);
        filter.forget_shared_steps();
        let (shared, after) = filter.tiles();
        assert!(
            shared * 20 == after && shared < apart,
            "{shared} of {after}, were {apart} of {all}"
        );
        assert_eq!(filter.steps(), &best[best.len() - 1..], "nothing before it can change");
        let first = filter.robots().next();
        assert!(filter.robots().all(|pose| Some(pose) == first), "all are the best's");
    }
}
