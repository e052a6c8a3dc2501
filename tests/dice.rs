//! Choices that can be made again: the same seed makes the same ones.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

const SEED: &str = "ARMOR_SEED";

/// The seed that `ARMOR_SEED` says, else `usual`; printed, so that a failure can be had again.
pub fn seed(usual: u64) -> u64 {
    let seed = std::env::var(SEED).ok().and_then(|seed| seed.parse().ok()).unwrap_or(usual);
    println!("seed {seed}; {SEED}={seed} makes the same choices again");
    seed
}

/// A generator of choices.
pub struct Dice(Xoshiro256PlusPlus);

impl Dice {
    pub fn of(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// From 0 to `sides` - 1; 0 for none.
    pub fn throw(&mut self, sides: usize) -> usize {
        self.0.random_range(0..sides.max(1))
    }
}
