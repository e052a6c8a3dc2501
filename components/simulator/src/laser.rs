//! A scanning laser: one ray per beam, all at the same instant. A reading is a mixture as in Thrun,
//! Burgard & Fox, Probabilistic Robotics, table 6.1: a hit with normal noise, a short one by
//! something that is not in the world, a random one, or none.

use std::f64::consts::TAU;

use crate::pose::{Portable, Pose2};
use crate::random::{NoiseStream, Random};
use crate::scene::WorldScene;

/// Nearest range that a laser measures by default, in metres.
pub const RANGE_MIN_M: f64 = 0.02;

/// What kind of laser it is and where it sits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserModel {
    /// Number of beams, at least 2, if no resolution is given.
    pub beams: u32,
    /// Angle from beam to beam, in radians; 0: as the number of beams gives it.
    pub resolution_rad: f64,
    /// Angle from the first beam (right) to the last (left), in radians; with a full turn the last
    /// beam stops one step before the first.
    pub field_of_view_rad: f64,
    /// Nearest range that is measured, in metres; what is nearer is lost.
    pub range_min_m: f64,
    /// Farthest range that returns, in metres.
    pub range_max_m: f64,
    /// Standard deviation of a range, in metres.
    pub sigma_m: f64,
    /// Share of beams that return nothing although something is in range, 0 to 1.
    pub dropout: f64,
    /// Share of beams that something between stops, more often near than far, 0 to 1 (z_short).
    pub short: f64,
    /// How much more often near: per metre, the λ of the exponential distribution.
    pub short_per_m: f64,
    /// Share of beams that return anything, evenly from 0 to the farthest range, 0 to 1 (z_rand).
    pub random: f64,
    /// Where the laser sits: base_from_laser.
    pub mount: Pose2,
}

impl Default for LaserModel {
    fn default() -> Self {
        Self {
            beams: 271,
            resolution_rad: 0.0,
            field_of_view_rad: 270f64.to_radians(),
            range_min_m: RANGE_MIN_M,
            range_max_m: 10.0,
            sigma_m: 0.01,
            dropout: 0.002,
            short: 0.0,
            short_per_m: 0.5,
            random: 0.0,
            mount: Pose2::new(0.08, 0.0, 0.0),
        }
    }
}

impl LaserModel {
    /// Direction of the first beam in the laser's frame, in radians.
    pub fn angle_min_rad(&self) -> f64 {
        -self.field_of_view_rad / 2.0
    }

    /// How many beams a scan has.
    pub fn beam_count(&self) -> u32 {
        if self.resolution_rad <= 0.0 {
            return self.beams;
        }
        let steps = libm::floor(self.field_of_view_rad / self.resolution_rad + 1e-6);
        (if self.is_full_turn() { steps } else { steps + 1.0 }).clamp(2.0, f64::from(MOST_BEAMS))
            as u32
    }

    /// Angle from one beam to the next, in radians.
    pub fn angle_increment_rad(&self) -> f64 {
        if self.resolution_rad > 0.0 {
            return self.resolution_rad;
        }
        let steps = if self.is_full_turn() { self.beams } else { self.beams.saturating_sub(1) };
        self.field_of_view_rad / f64::from(steps.max(1))
    }

    fn is_full_turn(&self) -> bool {
        self.field_of_view_rad >= TAU - 1e-6
    }
}

/// Most beams of a scan: a tenth of a millirad all round.
pub const MOST_BEAMS: u32 = 10_000;

/// A laser and its noise.
#[derive(Clone, Debug)]
pub struct Laser {
    model: LaserModel,
    random: Random,
    /// Of its own, so that noise and dropouts are the same with and without a mixture.
    mixture: Random,
}

impl Laser {
    /// A laser with the noise of a seed.
    pub fn new(model: LaserModel, seed: u64) -> Self {
        let stream = |stream| Random::new(seed, stream);
        Self { model, random: stream(NoiseStream::Laser), mixture: stream(NoiseStream::Mixture) }
    }

    /// Takes a scan from where the base is: ranges in metres, from right to left. As REP-117 has
    /// it, +∞ is "nothing within range" and NaN a beam that was lost.
    pub fn scan(&mut self, scene: WorldScene<'_>, map_from_base: Pose2) -> Vec<f32> {
        let model = self.model;
        let map_from_laser = map_from_base.then(model.mount);
        (0..model.beam_count())
            .map(|beam| {
                let angle_rad =
                    model.angle_min_rad() + f64::from(beam) * model.angle_increment_rad();
                let ray = Pose2 { yaw_rad: map_from_laser.yaw_rad + angle_rad, ..map_from_laser };
                self.measure_range(scene.range_m(ray, model.range_max_m))
            })
            .collect()
    }

    /// Makes a measurement of a true range. Draws the same number of times whatever the range is,
    /// so that one beam's wall does not change the next beam's noise.
    fn measure_range(&mut self, true_range_m: Option<f64>) -> f32 {
        let model = self.model;
        let is_lost = self.random.uniform() < model.dropout;
        let noise_m = self.random.normal(model.sigma_m);
        let mixed_m = self.mix_range(true_range_m.unwrap_or(model.range_max_m));
        let range_m = match (mixed_m, true_range_m) {
            _ if is_lost && (mixed_m.is_some() || true_range_m.is_some()) => return f32::NAN,
            (Some(range_m), _) => range_m,
            (None, Some(range_m)) => range_m + noise_m,
            (None, None) => return f32::INFINITY,
        };
        if range_m < model.range_min_m {
            f32::NAN
        } else if range_m > model.range_max_m {
            f32::INFINITY
        } else {
            range_m as f32
        }
    }

    /// A short or a random reading, in its share of beams.
    fn mix_range(&mut self, reach_m: f64) -> Option<f64> {
        let LaserModel { short, short_per_m, random, range_max_m, .. } = self.model;
        if short + random <= 0.0 {
            return None;
        }
        let (which, share) = (self.mixture.uniform(), self.mixture.uniform());
        if which < short {
            // The exponential distribution, cut off at the true range.
            let most = 1.0 - libm::exp(-short_per_m * reach_m);
            Some(-libm::log1p(-share * most) / short_per_m)
        } else if which < short + random {
            Some(share * range_max_m)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::world::World;

    /// A box from −4 to 4 m in x and y around the start.
    fn room() -> World {
        let text = r#"<svg><rect x="-4" y="-4" width="8" height="8"/><circle id="start"/></svg>"#;
        World::parse("room.svg", text.as_bytes()).expect("a readable world")
    }

    const EXACT: LaserModel = LaserModel {
        beams: 181,
        resolution_rad: 0.0,
        field_of_view_rad: std::f64::consts::PI,
        range_min_m: RANGE_MIN_M,
        range_max_m: 20.0,
        sigma_m: 0.0,
        dropout: 0.0,
        short: 0.0,
        short_per_m: 0.5,
        random: 0.0,
        mount: Pose2::new(0.0, 0.0, 0.0),
    };

    fn scan(model: LaserModel, pose: Pose2, seed: u64) -> Vec<f32> {
        Laser::new(model, seed).scan(WorldScene::from(&room()), pose)
    }

    #[test]
    fn beams_go_from_right_to_left() {
        // 1 m right of the middle, looking along x: 3 m to the right, 4 ahead, 5 to the left.
        let ranges = scan(EXACT, Pose2::new(0.0, -1.0, 0.0), 1);
        assert_eq!(ranges.len(), 181);
        for (beam, expected_m) in [(0, 3.0), (90, 4.0), (180, 5.0)] {
            assert!((ranges[beam] - expected_m).abs() < 1e-6, "{beam}: {}", ranges[beam]);
        }
    }

    #[test]
    fn the_mount_moves_and_turns_the_laser() {
        let mount = Pose2::new(0.5, 0.0, FRAC_PI_2);
        let ranges = scan(LaserModel { mount, ..EXACT }, Pose2::new(0.0, 1.0, 0.0), 1);
        for (beam, expected_m) in [(0, 3.5), (90, 3.0), (180, 4.5)] {
            assert!((ranges[beam] - expected_m).abs() < 1e-6, "{beam}: {}", ranges[beam]);
        }
    }

    #[test]
    fn a_full_turn_has_no_beam_twice() {
        let model = LaserModel { beams: 360, field_of_view_rad: TAU, ..EXACT };
        assert!((model.angle_increment_rad().to_degrees() - 1.0).abs() < 1e-9);
        assert!((EXACT.angle_increment_rad().to_degrees() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn beyond_the_range_is_infinite() {
        let ranges = scan(LaserModel { range_max_m: 4.5, ..EXACT }, Pose2::default(), 1);
        assert!(ranges[90].is_finite() && ranges[45].is_infinite());
    }

    #[test]
    fn noise_has_its_deviation_and_dropouts_their_share() {
        let model = LaserModel { beams: 20_000, sigma_m: 0.03, dropout: 0.1, ..EXACT };
        let exact = scan(LaserModel { sigma_m: 0.0, dropout: 0.0, ..model }, Pose2::default(), 3);
        let noisy = scan(model, Pose2::default(), 3);
        let errors: Vec<f64> = noisy
            .iter()
            .zip(&exact)
            .filter(|(noisy, _)| !noisy.is_nan())
            .map(|(noisy, exact)| f64::from(noisy - exact))
            .collect();
        let lost = 1.0 - errors.len() as f64 / f64::from(model.beams);
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        assert!((lost - 0.1).abs() < 0.01, "{lost}");
        assert!(mean.abs() < 0.001, "{mean}");
        assert!((variance.sqrt() - 0.03).abs() < 0.001, "{variance}");
    }

    #[test]
    fn a_resolution_gives_the_number_of_beams() {
        let model = LaserModel { resolution_rad: 0.5f64.to_radians(), ..EXACT };
        assert_eq!(model.beam_count(), 361);
        let all_round = LaserModel { field_of_view_rad: TAU, ..model };
        assert_eq!(scan(all_round, Pose2::default(), 1).len(), 720);
    }

    #[test]
    fn what_is_too_near_is_lost() {
        let ranges = scan(LaserModel { range_min_m: 0.5, ..EXACT }, Pose2::new(3.6, 0.0, 0.0), 1);
        assert!(ranges[90].is_nan() && (ranges[0] - 4.0).abs() < 1e-6, "{}", ranges[90]);
    }

    #[test]
    fn the_mixture_has_its_shares_and_distributions() {
        let model = LaserModel { beams: 40_000, short: 0.2, random: 0.1, ..EXACT };
        let exact = scan(LaserModel { short: 0.0, random: 0.0, ..model }, Pose2::default(), 3);
        let mixed = scan(model, Pose2::default(), 3);
        let differs = |(mixed, exact): &(&f32, &f32)| (**mixed - **exact).abs() > 1e-4;
        let pairs = mixed.iter().zip(&exact);
        let beyond = pairs.clone().filter(|(mixed, exact)| **mixed > **exact + 1e-4).count();
        let nearer: Vec<f64> = pairs
            .filter(differs)
            .filter(|(mixed, exact)| mixed < exact)
            .map(|(mixed, exact)| f64::from(mixed / exact))
            .collect();
        let share = |count: usize| count as f64 / 40_000.0;
        // Random readings reach to 20 m, the walls are 4 to 5.7 m away: three in four lie beyond.
        assert!((0.07..0.085).contains(&share(beyond)), "{}", share(beyond));
        assert!((0.21..0.235).contains(&share(nearer.len())), "{}", share(nearer.len()));
        // Near ones are more frequent than far ones.
        let half = nearer.iter().filter(|&&part| part < 0.5).count();
        assert!(half as f64 > 0.65 * nearer.len() as f64, "{half} of {}", nearer.len());
    }

    #[test]
    fn a_mixture_leaves_the_noise_of_other_beams_as_it_is() {
        let noisy = LaserModel { sigma_m: 0.02, ..EXACT };
        let plain = scan(noisy, Pose2::default(), 3);
        let mixed = scan(LaserModel { random: 0.1, ..noisy }, Pose2::default(), 3);
        let same = plain.iter().zip(&mixed).filter(|(plain, mixed)| plain == mixed).count();
        assert!((150..181).contains(&same), "{same}");
    }

    #[test]
    fn a_seed_repeats_a_scan() {
        let bits = |seed| -> Vec<u32> {
            scan(LaserModel::default(), Pose2::default(), seed)
                .iter()
                .map(|r| r.to_bits())
                .collect()
        };
        assert_eq!(bits(5), bits(5));
        assert_ne!(bits(5), bits(6));
    }
}
