//! What the mission reports: its state, what a button has caused, and how it takes an answer.

use super::Console;
use crate::links::ClockTimes;
use crate::mission::{MissionState, describe_cause};
use crate::orders::OperatorEvent;

impl Console {
    /// Takes the state of the mission.
    pub fn set_mission(&mut self, mission: MissionState, now: ClockTimes) {
        let before = self.mission.replace(mission);
        let Some(mission) = &self.mission else { return };
        if before.as_ref().is_some_and(|before| before.places != mission.places) {
            self.orders.follow_button(&mission.places, now.host_s);
            self.alerts_of_button(now);
        }
        let Some(mission) = &self.mission else { return };
        let is_new = before.is_none_or(|before| before.why != mission.why);
        if is_new && !mission.why.is_empty() {
            let text = format!("mission {}: {}, {}", mission.name, mission.stage, mission.why);
            self.alerts.raise(text, now.host_s);
        }
    }

    /// Raises an alert if the mission has come back to where its last button was pressed, unless the
    /// operator has ordered that.
    fn alerts_of_button(&mut self, now: ClockTimes) {
        let (Some(mission), Some((button, _))) = (&self.mission, self.orders.pressed()) else {
            return;
        };
        let followed = self.orders.followed_button();
        let is_back = followed.len() > 1 && followed.last() == Some(&self.pressed_from);
        let event = mission.last_cause.rsplit('.').next().unwrap_or_default();
        let is_own = OperatorEvent::ORDERED.iter().any(|ordered| ordered.name() == event)
            || self.buttons.iter().any(|button| button == event);
        if is_back && !is_own {
            let text = format!(
                "{button} was refused: {}; the mission is in {} again",
                describe_cause(&mission.last_cause),
                self.pressed_from
            );
            self.alerts.raise(text, now.host_s);
        }
    }

    /// Records the executive's reply to an answer of the operator.
    pub fn record_answer(&mut self, order: &str, is_accepted: bool, text: &str, now: ClockTimes) {
        if !is_accepted {
            self.alerts.raise(format!("{order} was refused: {text}"), now.host_s);
        }
    }
}
