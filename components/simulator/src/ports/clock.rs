//! The time of the world, as it is told to those who live by it.

use armor_sdk::prelude::*;

use crate::pace::Pace;
use crate::simulation::{CATCH_UP_S, STEP_S, Simulation, Stamped};

/// The time as it was said last.
#[derive(Default)]
pub(super) struct ClockOutput {
    said_s: Option<f64>,
    /// Somebody's time follows it.
    pub(super) is_followed: bool,
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
            self.is_followed = armor.send_data("clock", &Clock { clock: time_s })?.to > 0;
        }
        Ok(())
    }

    /// Commands stamped with another time than the world's would never count, or for too long.
    pub(super) fn warn_if_unfollowed(&mut self, speed: f64, armor: &Armor) {
        if speed != 1.0 && !self.is_followed && !std::mem::replace(&mut self.has_warned, true) {
            let clock = armor.provided_data("clock").unwrap_or_default();
            tracing::warn!(
                "commands are stamped with the host's time, and this world's passes {speed} times \
                 as fast: write <clock source=\"{clock}\"/> into the system, or leave speed at 1"
            );
        }
    }
}
