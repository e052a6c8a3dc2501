//! The state of the mission, as far as the screen shows it.

use crate::links::ClockTimes;

/// The newest state of the mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MissionState {
    /// Its name.
    pub name: String,
    /// Its stage, in a word.
    pub stage: String,
    /// Why it retreats or has given up; empty if it does not.
    pub why: String,
    /// Mission time when this was received, in seconds.
    pub now_at_s: f64,
    /// Whether that time passes.
    pub is_running: bool,
    /// Who has paused it; empty if it is not paused.
    pub paused_by: String,
    /// The components that are frozen.
    pub frozen: Vec<String>,
    /// The marked places.
    pub places: Vec<String>,
    /// Why the last transition fired: the report it waited for, or its name; empty if none has.
    pub last_cause: String,
    /// The transitions that ask the operator.
    pub questions: Vec<MissionQuestion>,
    /// When it was received, by the host's clock, in seconds.
    pub received_s: f64,
}

/// A transition that asks the operator whether it may fire.
#[derive(Clone, Debug, PartialEq)]
pub struct MissionQuestion {
    /// The transition.
    pub transition: String,
    /// Mission time until which an answer is waited for, in seconds, if not without a limit.
    pub answer_by_at_s: Option<f64>,
    /// What it does without an answer.
    pub unanswered: String,
}

impl MissionState {
    /// Returns whether the mission is over or has been ended, so that the system ends.
    pub fn is_over(&self) -> bool {
        ["ending", "stopping", "goal", "safe", "failed"].contains(&self.stage.as_str())
    }

    /// Returns mission time, in seconds.
    pub fn now_at_s(&self, now: ClockTimes) -> f64 {
        let passed_s = if self.is_running { (now.host_s - self.received_s).max(0.0) } else { 0.0 };
        self.now_at_s + passed_s
    }
}

/// Returns why the mission has left a place, for an operator: of a report `component.event`, or of the
/// name of a transition.
pub fn describe_cause(cause: &str) -> String {
    match cause.split_once('.') {
        Some((component, "frame_changed")) => {
            format!("{component} knows no place on a map with a new origin")
        }
        Some((component, event)) => format!("{component} reports {event}"),
        None => format!("{cause} has fired"),
    }
}

/// Returns a time as a person reads it: minutes and seconds.
pub fn format_clock(time_s: f64) -> String {
    let whole_s = if time_s.is_finite() { time_s.max(0.0) as u64 } else { 0 };
    format!("{}:{:02}", whole_s / 60, whole_s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mission_time_passes_only_while_the_mission_is_played() {
        let now = ClockTimes { host_s: 70.0, system_s: 0.0 };
        let mut mission = MissionState { now_at_s: 5.0, received_s: 10.0, ..Default::default() };
        assert_eq!(format_clock(mission.now_at_s(now)), "0:05");
        mission.is_running = true;
        assert_eq!(format_clock(mission.now_at_s(now)), "1:05");
        assert_eq!(format_clock(f64::NAN), "0:00");
    }
}
