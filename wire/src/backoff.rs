//! How long to wait before the next try: doubling, bounded, and different for everyone.

use std::time::Duration;

/// Delays that double from `first` to `most`, each shortened by a random part of up to one half, so
/// that a hundred components that lost the same registry do not come back in step.
#[derive(Clone, Debug)]
pub struct Backoff {
    first: Duration,
    most: Duration,
    next: Duration,
    random: u64,
}

impl Backoff {
    /// Delays from `first` to `most`; `seed` makes them this process's own.
    pub fn new(first: Duration, most: Duration, seed: u64) -> Self {
        Self { first, most, next: first, random: seed | 1 }
    }

    /// The next delay.
    pub fn delay(&mut self) -> Duration {
        // xorshift64*: statistically plain, and plenty for jitter.
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        let unit =
            (self.random.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64;
        let delay = self.next.mul_f64(0.5 + 0.5 * unit);
        self.next = (self.next * 2).min(self.most);
        delay
    }

    /// Starts again from the first delay, after a success.
    pub fn reset(&mut self) {
        self.next = self.first;
    }
}
