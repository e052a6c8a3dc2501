//! The delay before the next attempt: doubling, bounded, and different in each process.

use std::time::Duration;

/// Delays that double from `first` to `most`, each shortened by a random part of up to one half, so
/// that a hundred components that lost the same registry do not come back in step.
#[derive(Clone, Debug)]
pub struct Backoff {
    first: Duration,
    most: Duration,
    next: Duration,
    random: fastrand::Rng,
}

impl Backoff {
    /// Delays from `first` to `most`; `seed` makes them this process's own.
    pub fn new(first: Duration, most: Duration, seed: u64) -> Self {
        let first = first.min(most);
        Self { first, most, next: first, random: fastrand::Rng::with_seed(seed) }
    }

    /// The next delay.
    pub fn delay(&mut self) -> Duration {
        let delay = self.next.mul_f64(0.5 + 0.5 * self.random.f64());
        self.next = self.next.saturating_mul(2).min(self.most);
        delay
    }

    /// Starts again from the first delay, after a success.
    pub fn reset(&mut self) {
        self.next = self.first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_double_up_to_a_bound_and_are_shortened_by_at_most_half() {
        for seed in [0, 1, 2, u64::MAX] {
            let most = Duration::from_secs(10);
            let mut backoff = Backoff::new(Duration::from_millis(100), most, seed);
            for full in [0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 10.0, 10.0] {
                let delay_s = backoff.delay().as_secs_f64();
                assert!(
                    (full / 2.0 - 1e-6..=full + 1e-6).contains(&delay_s),
                    "{delay_s} of {full}"
                );
            }
            backoff.reset();
            assert!(backoff.delay() <= Duration::from_millis(100));
        }
    }

    #[test]
    fn two_processes_do_not_keep_step() {
        let delays =
            |seed| Backoff::new(Duration::from_secs(1), Duration::from_secs(1), seed).delay();
        assert_ne!(delays(10), delays(12));
    }

    #[test]
    fn no_bound_overflows() {
        let mut backoff = Backoff::new(Duration::MAX / 2, Duration::MAX / 2, 5);
        assert!((0..5).all(|_| backoff.delay() <= Duration::MAX / 2));
    }
}
