//! The time of the world, as the output `clock` publishes it.

use armor_sdk::prelude::*;

use crate::pace::SimulationPace;
use crate::simulation::{CATCH_UP_S, STEP_S, Simulation, Stamped};

/// How long other processes may take until they follow: as long as a mission waits for its links.
const GATHERING_S: f64 = 10.0;

/// The last published time and its subscribers.
#[derive(Default)]
pub(super) struct ClockOutput {
    published_s: Option<f64>,
    /// Whether any process follows it.
    pub(super) is_followed: bool,
    /// Since when it has had no follower, in the host's time.
    alone_since_s: Option<f64>,
    has_warned: bool,
}

impl ClockOutput {
    /// Catches up with the time. If others follow it, none is left out: where the machine is too
    /// slow for it, time passes more slowly.
    pub(super) fn advance(
        &self,
        simulation: &mut Simulation,
        pace: &mut SimulationPace,
        host_s: f64,
        readings: &mut Vec<Stamped>,
    ) {
        let now_s = pace.time_s(host_s);
        if !self.is_followed {
            return simulation.advance_to(now_s, readings);
        }
        let latest_s = simulation.time_s() + CATCH_UP_S * pace.speed().max(1.0);
        if now_s > latest_s {
            pace.set_time(latest_s, host_s);
        }
        let end_s = now_s.min(latest_s);
        while simulation.time_s() + STEP_S <= end_s + 1e-6 {
            simulation.step(readings);
        }
    }

    /// Publishes the time before what was measured until that time.
    pub(super) fn publish_time(&mut self, time_s: f64, armor: &Armor) -> Result<(), Fault> {
        if self.published_s != Some(time_s) {
            self.published_s = Some(time_s);
            let followers = armor.send_data("clock", &Clock { clock: time_s })?.to;
            self.count_followers(followers, armor.timestamp());
        }
        Ok(())
    }

    fn count_followers(&mut self, followers: usize, host_s: f64) {
        self.is_followed = followers > 0;
        let since_s = self.alone_since_s.unwrap_or(host_s);
        self.alone_since_s = (!self.is_followed).then_some(since_s);
    }

    /// Whether no process follows it, and none is starting up.
    fn is_alone(&self, host_s: f64) -> bool {
        self.alone_since_s.is_some_and(|since_s| host_s - since_s > GATHERING_S)
    }

    /// Commands stamped with another time than the world's would never count, or for too long.
    pub(super) fn warn_if_unfollowed(&mut self, speed: f64, armor: &Armor) {
        let is_wrong = speed != 1.0 && self.is_alone(armor.timestamp());
        if is_wrong && !std::mem::replace(&mut self.has_warned, true) {
            let clock = armor.provided_data("clock").unwrap_or_default();
            tracing::warn!(
                "commands are stamped with the host's time, and this world's passes {speed} times \
                 as fast: write <clock source=\"{clock}\"/> into the system, or leave speed at 1"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_alone_when_no_subscriber_came_in_time_or_all_have_gone() {
        let mut clock = ClockOutput::default();
        assert!(!clock.is_alone(100.0));
        clock.count_followers(0, 100.0);
        clock.count_followers(0, 109.0);
        assert!(!clock.is_alone(110.0) && clock.is_alone(110.1));
        clock.count_followers(2, 111.0);
        assert!(!clock.is_alone(200.0));
        clock.count_followers(0, 200.0);
        assert!(!clock.is_alone(205.0) && clock.is_alone(211.0));
    }
}
