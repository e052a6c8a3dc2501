//! A gyroscope: the rate at which the base turns, with noise and a bias that walks at random (the
//! angle and rate random walk of IEEE Std 952).

use crate::random::{NoiseStream, Random};

/// How good the gyroscope is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuModel {
    /// Standard deviation of a reading, in radians per second.
    pub sigma_radps: f64,
    /// Bias at the start, in radians per second.
    pub bias_radps: f64,
    /// Standard deviation of what a second adds to the bias, in radians per second.
    pub walk_radps: f64,
}

impl Default for ImuModel {
    fn default() -> Self {
        Self { sigma_radps: 0.002, bias_radps: 0.0, walk_radps: 0.0001 }
    }
}

/// A gyroscope and its bias now.
#[derive(Clone, Debug)]
pub(crate) struct Gyroscope {
    model: ImuModel,
    random: Random,
    bias_radps: f64,
}

impl Gyroscope {
    pub(crate) fn new(model: ImuModel, seed: u64) -> Self {
        Self { model, random: Random::new(seed, NoiseStream::Imu), bias_radps: model.bias_radps }
    }

    /// Measures a true turn rate, `since_s` seconds after the reading before.
    pub(crate) fn read(&mut self, turn_radps: f64, since_s: f64) -> f64 {
        self.bias_radps += self.random.normal(self.model.walk_radps * libm::sqrt(since_s));
        turn_radps + self.bias_radps + self.random.normal(self.model.sigma_radps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_deviation() {
        let model = ImuModel { sigma_radps: 0.01, bias_radps: 0.1, walk_radps: 0.0 };
        let mut gyroscope = Gyroscope::new(model, 1);
        let errors: Vec<f64> = (0..20_000).map(|_| gyroscope.read(0.5, 0.01) - 0.6).collect();
        let mean = errors.iter().sum::<f64>() / 20_000.0;
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.0005, "{mean}");
        assert!((variance.sqrt() - 0.01).abs() < 0.0003, "{variance}");
    }

    #[test]
    fn the_bias_walks_as_far_whatever_the_rate() {
        let model = ImuModel { sigma_radps: 0.0, bias_radps: 0.0, walk_radps: 0.01 };
        for steps in [4, 64] {
            let end = |seed| {
                let mut gyroscope = Gyroscope::new(model, seed);
                let since_s = 4.0 / f64::from(steps);
                (0..steps).map(|_| gyroscope.read(0.0, since_s)).last().expect("a reading")
            };
            let variance = (0..2000).map(|seed| end(seed).powi(2)).sum::<f64>() / 2000.0;
            assert!((variance.sqrt() - 0.02).abs() < 0.0015, "{steps}: {variance}");
        }
    }
}
