//! Random choices that a printed seed repeats.

const SEED: &str = "ARMOR_SEED";

/// Returns the seed in the environment variable `ARMOR_SEED`, or `default`; prints it, so that a
/// failing run can be repeated.
pub fn seed(default: u64) -> u64 {
    let seed = std::env::var(SEED).ok().and_then(|seed| seed.parse().ok()).unwrap_or(default);
    println!("seed {seed}; set {SEED}={seed} to repeat the same choices");
    seed
}

/// A generator of choices.
pub struct Dice(fastrand::Rng);

impl Dice {
    pub fn of(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// Returns a number from 0 to `sides` - 1; 0 if there are no sides.
    pub fn throw(&mut self, sides: usize) -> usize {
        self.0.usize(..sides.max(1))
    }
}
