//! Seeded chance, so that a failure can be played again from its seed.

use std::time::Duration;

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

#[derive(Clone, Debug)]
pub(crate) struct Dice(Xoshiro256PlusPlus);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// 0 to `sides` - 1.
    pub(crate) fn roll(&mut self, sides: usize) -> usize {
        self.0.random_range(0..sides)
    }

    /// Whether one in `sides` came up.
    pub(crate) fn one_in(&mut self, sides: usize) -> bool {
        self.roll(sides) == 0
    }

    /// A duration from 0 to `most_ms` milliseconds.
    pub(crate) fn up_to_ms(&mut self, most_ms: usize) -> Duration {
        Duration::from_micros(self.roll(most_ms * 1000 + 1) as u64)
    }
}
