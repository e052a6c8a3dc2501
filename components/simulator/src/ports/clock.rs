//! The time of the world, as it is told to those who live by it.

use armor_sdk::prelude::*;

use crate::pace::Pace;
use crate::simulation::{CATCH_UP_S, STEP_S, Simulation, Stamped};

/// How long others may take until they follow: as long as a mission waits for its links.
const GATHERING_S: f64 = 10.0;

/// The time as it was said last.
#[derive(Default)]
pub(super) struct ClockOutput {
    said_s: Option<f64>,
    /// Somebody's time follows it.
    pub(super) is_followed: bool,
    /// When it was first said to nobody, in the host's time.
    alone_since_s: Option<f64>,
    has_warned: bool,
}

impl ClockOutput {
    /// Catches up with the time. If others follow it, none is left out: where the machine is too slow
    /// for it, time passes more slowly.
    pub(super) fn advance(
        &self,
        simulation: &mut Simulation,
        pace: &mut Pace,
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

    /// Publishes the time, before what was measured until then.
    pub(super) fn say(&mut self, time_s: f64, armor: &Armor) -> Result<(), Fault> {
        if self.said_s != Some(time_s) {
            self.said_s = Some(time_s);
            let followers = armor.send_data("clock", &Clock { clock: time_s })?.to;
            self.said_to(followers, armor.timestamp());
        }
        Ok(())
    }

    fn said_to(&mut self, followers: usize, host_s: f64) {
        self.is_followed = followers > 0;
        let since_s = self.alone_since_s.unwrap_or(host_s);
        self.alone_since_s = (!self.is_followed).then_some(since_s);
    }

    /// Whether nobody follows, and nobody is about to.
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
    fn a_clock_is_alone_when_nobody_came_in_time_or_all_have_gone() {
        let mut clock = ClockOutput::default();
        assert!(!clock.is_alone(100.0));
        clock.said_to(0, 100.0);
        clock.said_to(0, 109.0);
        assert!(!clock.is_alone(110.0) && clock.is_alone(110.1));
        clock.said_to(2, 111.0);
        assert!(!clock.is_alone(200.0));
        clock.said_to(0, 200.0);
        assert!(!clock.is_alone(205.0) && clock.is_alone(211.0));
    }
}
