//! A compass: the heading against magnetic east, with noise.

use crate::pose::wrap_angle;
use crate::random::{NoiseStream, Random};

/// How good the compass is, and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompassModel {
    /// Standard deviation of a reading, in radians.
    pub sigma_rad: f64,
    /// How far magnetic north lies east of true north, in radians.
    pub declination_rad: f64,
}

impl Default for CompassModel {
    fn default() -> Self {
        Self { sigma_rad: 2f64.to_radians(), declination_rad: 0.0 }
    }
}

/// A compass and its noise.
#[derive(Clone, Debug)]
pub(crate) struct Compass {
    model: CompassModel,
    random: Random,
}

impl Compass {
    pub(crate) fn new(model: CompassModel, seed: u64) -> Self {
        Self { model, random: Random::new(seed, NoiseStream::Compass) }
    }

    /// Measures a heading given anticlockwise from true east; both in radians. Against a north that
    /// lies further east, everything is turned further to the left.
    pub(crate) fn read(&mut self, heading_rad: f64) -> f64 {
        let noise_rad = self.random.normal(self.model.sigma_rad);
        wrap_angle(heading_rad + self.model.declination_rad + noise_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declination_turns_every_heading() {
        let mut compass = Compass::new(CompassModel { sigma_rad: 0.0, declination_rad: 0.2 }, 1);
        assert!((compass.read(1.0) - 1.2).abs() < 1e-12);
        assert!((compass.read(3.1) - (3.3 - std::f64::consts::TAU)).abs() < 1e-12);
    }

    #[test]
    fn noise_has_its_deviation() {
        let mut compass = Compass::new(CompassModel { sigma_rad: 0.05, declination_rad: 0.0 }, 1);
        let variance = (0..20_000).map(|_| compass.read(0.0).powi(2)).sum::<f64>() / 20_000.0;
        assert!((variance.sqrt() - 0.05).abs() < 0.002, "{variance}");
    }
}
