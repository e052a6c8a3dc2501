//! What lies between two components: every message comes a little late, now and then much later,
//! and never before the one sent before it.

use std::collections::VecDeque;

use armor_simulator::random::{NoiseStream, Random};

/// How late messages come.
#[derive(Clone, Copy, Debug)]
pub struct Delays {
    /// Always at least, in seconds.
    pub least_s: f64,
    /// As much more when the machine is busy, in seconds.
    pub busy_s: f64,
    /// Share of messages for which it is busy, 0 to 1.
    pub busy_share: f64,
}

/// A queue of messages in transit.
pub struct Delivery<T> {
    delays: Delays,
    random: Random,
    waiting: VecDeque<(f64, T)>,
}

impl<T> Delivery<T> {
    pub fn new(delays: Delays, seed: u64) -> Self {
        Self { delays, random: Random::new(seed, NoiseStream::Laser), waiting: VecDeque::new() }
    }

    pub fn send(&mut self, now_s: f64, message: T) {
        let busy = self.random.uniform() < self.delays.busy_share;
        let late_s = self.delays.least_s + if busy { self.delays.busy_s } else { 0.0 };
        let before_s = self.waiting.back().map_or(f64::NEG_INFINITY, |last| last.0);
        self.waiting.push_back((before_s.max(now_s + late_s), message));
    }

    /// Returns the next message that has arrived.
    pub fn receive(&mut self, now_s: f64) -> Option<T> {
        let is_here = self.waiting.front().is_some_and(|next| next.0 <= now_s + 1e-9);
        is_here.then(|| self.waiting.pop_front()).flatten().map(|next| next.1)
    }
}
