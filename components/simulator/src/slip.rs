//! Wheels that slip: they turn further than the base moves, all the time by a share, and for a
//! moment by a larger one where the ground is bad. The odometry counts what the wheels turn.

use crate::random::{NoiseStream, Random};

/// The largest share of a motion that can be lost: the model of the odometry divides by the share
/// that is left.
const MOST: f64 = 0.95;

/// How much the wheels slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipModel {
    /// Share of the wheels' turning that moves nothing, always, 0 to 0.95.
    pub share: f64,
    /// Slippery moments per second of driving.
    pub events_hz: f64,
    /// How long one lasts, in seconds.
    pub event_s: f64,
    /// Share lost in one, 0 to 0.95.
    pub event_share: f64,
}

impl Default for SlipModel {
    fn default() -> Self {
        Self { share: 0.0, events_hz: 0.0, event_s: 0.3, event_share: 0.5 }
    }
}

/// The ground under the wheels.
#[derive(Clone, Debug)]
pub(crate) struct Slip {
    model: SlipModel,
    random: Random,
    left_s: f64,
}

impl Slip {
    pub(crate) fn new(model: SlipModel, seed: u64) -> Self {
        Self { model, random: Random::new(seed, NoiseStream::Slip), left_s: 0.0 }
    }

    /// The share that is lost in a step of driving of `step_s` seconds.
    pub(crate) fn share(&mut self, step_s: f64) -> f64 {
        if self.model.events_hz > 0.0 && self.random.uniform() < self.model.events_hz * step_s {
            self.left_s = self.model.event_s;
        }
        let is_slippery = self.left_s > 0.0;
        self.left_s -= step_s;
        let share = if is_slippery { self.model.event_share } else { 0.0 };
        share.max(self.model.share).clamp(0.0, MOST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_come_at_their_rate_and_last_their_time() {
        let model = SlipModel { share: 0.1, events_hz: 0.2, event_s: 0.5, event_share: 0.6 };
        let mut slip = Slip::new(model, 1);
        let shares: Vec<f64> = (0..200_000).map(|_| slip.share(0.01)).collect();
        assert!(shares.iter().all(|&share| share == 0.1 || share == 0.6));
        let slippery = shares.iter().filter(|&&share| share == 0.6).count() as f64 / 200_000.0;
        // 0.2 a second of half a second each, some of which overlap.
        assert!((0.08..0.11).contains(&slippery), "{slippery}");
    }

    #[test]
    fn by_default_nothing_slips() {
        let mut slip = Slip::new(SlipModel::default(), 1);
        assert!((0..1000).all(|_| slip.share(0.01) == 0.0));
    }
}
