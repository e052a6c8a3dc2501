//! A scanning laser: one ray per beam, all at the same instant, with range noise and dropouts.

use std::f64::consts::TAU;

use crate::pose::{Portable, Pose2};
use crate::random::Random;
use crate::world::World;

/// Nearest range that the laser can measure, in metres.
pub const RANGE_MIN_M: f64 = 0.02;

/// What kind of laser it is and where it sits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserModel {
    /// Number of beams, at least 2.
    pub beams: u32,
    /// Angle from the first beam (right) to the last (left), in radians; with a full turn the last
    /// beam stops one step before the first.
    pub field_of_view_rad: f64,
    /// Farthest range that returns, in metres.
    pub range_max_m: f64,
    /// Standard deviation of a range, in metres.
    pub sigma_m: f64,
    /// Share of beams that return nothing although something is there, 0 to 1.
    pub dropout: f64,
    /// Where the laser sits: base_from_laser.
    pub mount: Pose2,
}

impl Default for LaserModel {
    fn default() -> Self {
        Self {
            beams: 271,
            field_of_view_rad: 270f64.to_radians(),
            range_max_m: 10.0,
            sigma_m: 0.01,
            dropout: 0.002,
            mount: Pose2::new(0.08, 0.0, 0.0),
        }
    }
}

impl LaserModel {
    /// Direction of the first beam in the laser's frame, in radians.
    pub fn angle_min_rad(&self) -> f64 {
        -self.field_of_view_rad / 2.0
    }

    /// Angle from one beam to the next, in radians.
    pub fn angle_increment_rad(&self) -> f64 {
        let is_full_turn = self.field_of_view_rad >= TAU - 1e-6;
        let steps = if is_full_turn { self.beams } else { self.beams.saturating_sub(1) };
        self.field_of_view_rad / f64::from(steps.max(1))
    }

    /// Takes a scan from where the base is: ranges in metres, from right to left. As REP-117 has
    /// it, +∞ is "nothing within range" and NaN a beam that was lost.
    pub fn scan(&self, world: &World, map_from_base: Pose2, random: &mut Random) -> Vec<f32> {
        let map_from_laser = map_from_base.then(self.mount);
        (0..self.beams)
            .map(|beam| {
                let angle_rad = self.angle_min_rad() + f64::from(beam) * self.angle_increment_rad();
                let ray = Pose2 { yaw_rad: map_from_laser.yaw_rad + angle_rad, ..map_from_laser };
                self.measure(world.range_m(ray, self.range_max_m), random)
            })
            .collect()
    }

    /// Makes a measurement of a true range. Draws the same number of times whatever the range is,
    /// so that one beam's wall does not change the next beam's noise.
    fn measure(&self, true_range_m: Option<f64>, random: &mut Random) -> f32 {
        let is_lost = random.uniform() < self.dropout;
        let noise_m = random.normal(self.sigma_m);
        let Some(range_m) = true_range_m else { return f32::INFINITY };
        if is_lost {
            return f32::NAN;
        }
        let range_m = (range_m + noise_m).max(RANGE_MIN_M);
        if range_m > self.range_max_m { f32::INFINITY } else { range_m as f32 }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::random::Stream;

    /// A box from −4 to 4 m in x and y around the start.
    fn room() -> World {
        let text = r#"<svg><rect x="-4" y="-4" width="8" height="8"/><circle id="start"/></svg>"#;
        World::parse("room.svg", text.as_bytes()).expect("a readable world")
    }

    const EXACT: LaserModel = LaserModel {
        beams: 181,
        field_of_view_rad: std::f64::consts::PI,
        range_max_m: 20.0,
        sigma_m: 0.0,
        dropout: 0.0,
        mount: Pose2::new(0.0, 0.0, 0.0),
    };

    fn scan(model: LaserModel, pose: Pose2, seed: u64) -> Vec<f32> {
        model.scan(&room(), pose, &mut Random::new(seed, Stream::Laser))
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
