//! How long an answer takes, smoothed, and how long to wait for one before a message is sent again
//! (RFC 6298, with shorter limits).

use std::time::Duration;

/// Before the first measurement.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// Shortest and longest wait.
const WAIT: (Duration, Duration) = (Duration::from_millis(2), Duration::from_millis(500));

/// The time from a datagram to its receipt.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RoundTrip {
    mean: Option<Duration>,
    deviation: Duration,
}

impl RoundTrip {
    pub fn add_measurement(&mut self, measured: Duration) {
        match &mut self.mean {
            None => {
                self.mean = Some(measured);
                self.deviation = measured / 2;
            }
            Some(mean) => {
                self.deviation = (self.deviation * 3 + mean.abs_diff(measured)) / 4;
                *mean = (*mean * 7 + measured) / 8;
            }
        }
    }

    /// How long to wait for a receipt.
    pub fn wait(&self) -> Duration {
        match self.mean {
            None => FIRST_WAIT,
            Some(mean) => (mean + (self.deviation * 2).max(mean / 16)).clamp(WAIT.0, WAIT.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_follows_what_was_measured() {
        let mut trip = RoundTrip::default();
        assert_eq!(trip.wait(), FIRST_WAIT);
        for _ in 0..40 {
            trip.add_measurement(Duration::from_millis(40));
        }
        let wait = trip.wait();
        assert!(wait > Duration::from_millis(40) && wait < Duration::from_millis(45), "{wait:?}");
        trip.add_measurement(Duration::from_millis(400));
        assert!(trip.wait() > Duration::from_millis(200), "{:?}", trip.wait());
        let mut short = RoundTrip::default();
        short.add_measurement(Duration::from_micros(20));
        assert_eq!(short.wait(), WAIT.0);
    }
}
