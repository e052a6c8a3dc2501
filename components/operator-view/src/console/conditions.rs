//! What is wrong now: each condition is an alert for as long as it lasts.

use super::Console;
use crate::connection::{CUT, SystemConnection};
use crate::links::{ClockTimes, Freshness, InputLink};
use crate::readings::BatteryReading;
use crate::stop_delivery::StopStatus;

/// A lost connection is an alert after this time, in seconds: a component that is restarted returns
/// sooner.
const CUT_ALERT_S: f64 = 2.0;

impl Console {
    /// Raises an alert for each thing that has gone wrong.
    pub fn watch_conditions(&mut self, now: ClockTimes) {
        let mut conditions = Vec::new();
        match &self.connection {
            SystemConnection::Ended { system, is_normal: false, .. } => {
                conditions.push(format!("{system} has ended"));
            }
            SystemConnection::Cut { .. } if now.host_s - self.lost_s >= CUT_ALERT_S => {
                conditions.push(CUT.into());
            }
            SystemConnection::Cut { .. }
            | SystemConnection::Ending { .. }
            | SystemConnection::Ended { .. }
            | SystemConnection::Awaited { .. } => {}
            SystemConnection::Part | SystemConnection::Live { .. } => {
                let silent = self.list_silent(now);
                let gone = silent.filter(|(_, how, _)| *how == Freshness::Gone);
                conditions.extend(gone.map(|(link, ..)| format!("no data at {}", link.input)));
                conditions.extend(self.delivery_warning());
                if self.goal_problem(now).is_some() && !self.unheard.contains("goal") {
                    conditions.push("no path to the goal".into());
                }
                if self.orders.is_frame_new() {
                    conditions.push("the map has a new origin".into());
                }
                let battery = self.readings.newest::<BatteryReading>();
                if battery.is_some_and(BatteryReading::is_low) {
                    conditions.push("the battery is low".into());
                }
            }
        }
        if self.stop_status(now) == Some(StopStatus::NotDelivered) {
            conditions.push("STOP not delivered".into());
        }
        self.alerts.update_conditions(conditions, now.host_s);
    }

    /// Returns the steady links without recent data, each with the age of its newest data in
    /// seconds.
    pub fn list_silent(
        &self,
        now: ClockTimes,
    ) -> impl Iterator<Item = (&InputLink, Freshness, f64)> {
        let status =
            move |link: &InputLink| (link.freshness(now), link.age_s(now).unwrap_or_default());
        self.links.iter().map(move |link| (link, status(link))).filter_map(
            |(link, (how, age_s))| {
                matches!(how, Freshness::Late | Freshness::Gone).then_some((link, how, age_s))
            },
        )
    }
}
