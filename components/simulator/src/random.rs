//! The seeded source of all noise: ChaCha with 8 rounds, and arithmetic that rounds the same way
//! on every machine. One seed gives independent streams, so that changing the laser does not
//! change the odometry.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Which noise a stream feeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseStream {
    /// Range noise and dropouts.
    Laser = 1,
    /// Motion noise in the odometry.
    Odometry = 2,
    /// Short and random readings of the laser.
    Mixture = 3,
    /// Slippery moments.
    Slip = 4,
    /// Noise and bias of the gyroscope.
    Imu = 5,
    /// Noise of the compass.
    Compass = 6,
    /// Errors of satellite positions.
    Gps = 7,
}

/// A reproducible stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    generator: ChaCha8Rng,
}

impl Random {
    /// Opens one stream of a seed.
    pub fn new(seed: u64, stream: NoiseStream) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream as u64);
        Self { generator }
    }

    /// Draws evenly from 0 to just under 1.
    pub fn uniform(&mut self) -> f64 {
        // The 53 bits that a double can hold.
        (self.generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Draws from a normal distribution around 0 with standard deviation `sigma`, cut off at 6
    /// sigma: the sum of twelve uniform draws (Thrun, Burgard & Fox, Probabilistic Robotics, table
    /// 5.4).
    pub fn normal(&mut self, sigma: f64) -> f64 {
        let sum: f64 = (0..12).map(|_| self.uniform()).sum();
        sigma * (sum - 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_numbers_on_every_machine() {
        let mut random = Random::new(7, NoiseStream::Laser);
        let drawn: Vec<f64> = (0..3).map(|_| random.uniform()).collect();
        assert_eq!(
            drawn,
            [0.992_108_775_223_498_4, 0.009_051_410_273_493_876, 0.721_611_729_582_508_7]
        );
    }

    #[test]
    fn streams_and_seeds_differ() {
        let mut first = Random::new(7, NoiseStream::Laser);
        assert_ne!(first.uniform(), Random::new(7, NoiseStream::Odometry).uniform());
        assert_ne!(
            Random::new(7, NoiseStream::Laser).uniform(),
            Random::new(8, NoiseStream::Laser).uniform()
        );
    }

    #[test]
    fn normal_draws_have_their_mean_and_deviation() {
        let mut random = Random::new(1, NoiseStream::Odometry);
        let count = 20_000;
        let draws: Vec<f64> = (0..count).map(|_| random.normal(0.3)).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(count);
        let variance =
            draws.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / f64::from(count);
        assert!(mean.abs() < 0.01, "{mean}");
        assert!((variance - 0.09).abs() < 0.003, "{variance}");
        assert_eq!(random.normal(0.0), 0.0);
    }
}
