//! What a rehearsal prints: a row for each step, where robots came too near to a zone, and how it ended.

use std::path::Path;
use std::time::Duration;

use anyhow::Result;
use armor_executive::MissionOutcome;
use armor_robotfile::MissionDuration;
use armor_robotfile::timing::{RehearsedEnd, RehearsedStep, StepBounds};
use serde_json::json;

use super::outcome::RehearsalOutcome;
use super::zone_rooms::ZoneRoom;
use crate::arguments::OutputFormat;
use crate::inspect_cli::mission::times::format_seconds;
use crate::print::{Table, print_line, print_text, terminal_width};

/// The end of a mission is journaled up to a step of its clock later than it was due.
const CLOCK_STEP_S: f64 = 0.1;

/// See the module.
pub struct RehearsalReport<'a> {
    pub file: &'a Path,
    pub outcome: &'a RehearsalOutcome,
    pub rooms: &'a [ZoneRoom],
    /// What the proof of the file states, if it does.
    pub duration: Option<&'a MissionDuration>,
    /// How many times faster than real time it was played.
    pub speed: f64,
    /// How long that took.
    pub took: Duration,
    /// The component that skipped the largest share of its ticks.
    pub skipped: Option<&'a (String, f64)>,
}

impl RehearsalReport<'_> {
    /// Returns whether the mission reached its goal, with everything within its bounds.
    pub fn is_as_predicted(&self) -> bool {
        self.outcome.end == Some(MissionOutcome::Goal)
            && self.outcome.rehearsal.list_outside().next().is_none()
            && self.is_within_duration() != Some(false)
            && !self.rooms.iter().any(ZoneRoom::is_breach)
    }

    /// Whether it ended within the proven duration; none if that has no end.
    fn is_within_duration(&self) -> Option<bool> {
        let longest_s = self.duration?.longest_s?;
        Some(self.outcome.took.as_secs_f64() <= longest_s + CLOCK_STEP_S)
    }

    /// Prints it.
    ///
    /// # Errors
    /// If it cannot be printed.
    pub fn print(&self, format: OutputFormat) -> Result<()> {
        match format {
            OutputFormat::Json => self.print_records(),
            _ => self.print_text(),
        }
    }

    fn print_text(&self) -> Result<()> {
        let (file, took_s) = (self.file.display(), self.took.as_secs_f64());
        print_line(format_args!(
            "rehearsed {file} at {} times real time, in {took_s:.1} s",
            self.speed
        ))?;
        let headings =
            ["route", "step", "earliest", "nominal", "latest", "driven", "difference", "bounds"];
        let steps = &self.outcome.rehearsal.steps;
        let rows = steps.iter().map(list_row).collect();
        print_text(Table::new(&headings, rows).format(terminal_width()))?;
        for room in self.rooms.iter().filter(|room| room.room_m < room.margin_m) {
            print_line(describe_room(room))?;
        }
        if let Some(error) = self.outcome.rehearsal.leg_error() {
            print_line(format_args!(
                "legs: nine of ten of {} within {} of their nominal time, on average {}",
                error.legs,
                percent(error.p90),
                signed_percent(error.mean)
            ))?;
        }
        if let Some((component, share)) = self.skipped.filter(|skipped| skipped.1 >= 0.01) {
            print_line(format_args!(
                "{component} skipped {} of its ticks: a lower --speed is closer to the real robot",
                percent(*share)
            ))?;
        }
        print_line(self.describe_end())
    }

    fn describe_end(&self) -> String {
        let took = format_seconds(self.outcome.took);
        let end = match self.outcome.end {
            Some(MissionOutcome::Goal) => format!("the mission reached its goal after {took}"),
            Some(MissionOutcome::Safe) => {
                format!("the mission ended in its safe place after {took}")
            }
            Some(MissionOutcome::Failed) => format!("the mission failed after {took}"),
            Some(MissionOutcome::Interrupted) | None => {
                format!("the mission was not over after {took}")
            }
        };
        let proven = self.duration.map(|duration| match (duration.longest_s, self.is_within_duration()) {
            (Some(longest_s), Some(false)) => {
                format!("; proven to be over after {longest_s:.1} s at the latest, which was not kept")
            }
            (Some(longest_s), _) => format!("; proven to be over after {longest_s:.1} s at the latest"),
            (None, _) => "; its proof has no latest end".to_owned(),
        });
        end + &proven.unwrap_or_default()
    }

    fn print_records(&self) -> Result<()> {
        for step in &self.outcome.rehearsal.steps {
            print_line(step_record(step))?;
        }
        for room in self.rooms {
            print_line(json!({ "zone": {
                "robot": room.robot,
                "zone": room.zone,
                "room_m": room.room_m,
                "margin_m": room.margin_m,
                "entered": room.is_breach(),
            }}))?;
        }
        let outcome = self.outcome.end.map(|end| match end {
            MissionOutcome::Goal => "goal",
            MissionOutcome::Safe => "safe",
            MissionOutcome::Failed => "failed",
            MissionOutcome::Interrupted => "interrupted",
        });
        let error = self.outcome.rehearsal.leg_error();
        print_line(json!({ "end": {
            "outcome": outcome,
            "after_s": self.outcome.took.as_secs_f64(),
            "proven_latest_s": self.duration.and_then(|duration| duration.longest_s),
            "within_proven": self.is_within_duration(),
            "as_predicted": self.is_as_predicted(),
            "speed": self.speed,
            "took_s": self.took.as_secs_f64(),
            "legs": error.map(|error| error.legs),
            "leg_error_p90": error.map(|error| error.p90),
            "leg_error_mean": error.map(|error| error.mean),
            "half_way_errors": self.outcome.rehearsal.half_way_errors(),
            "skipped": self.skipped.map(|(component, share)| {
                json!({ "component": component, "share": share })
            }),
        }}))
    }
}

fn list_row(step: &RehearsedStep) -> Vec<String> {
    let time = |time: Option<Duration>| time.map_or("?".to_owned(), format_seconds);
    let driven = match &step.end {
        RehearsedEnd::Done(at) => format_seconds(*at),
        RehearsedEnd::Left { at, .. } => format!("({})", format_seconds(*at)),
        RehearsedEnd::Open => "-".to_owned(),
    };
    vec![
        step.route.clone(),
        step.step.clone(),
        time(step.earliest),
        time(step.nominal),
        time(step.latest),
        driven,
        step.difference().map_or(String::new(), signed_percent),
        describe_bounds(step),
    ]
}

fn describe_bounds(step: &RehearsedStep) -> String {
    match (step.bounds(), &step.end) {
        (StepBounds::Within, _) if step.latest.is_none() => "no latest time".to_owned(),
        (StepBounds::Within, _) => "kept".to_owned(),
        (StepBounds::Early(by), _) => format!("{} early", format_seconds(by)),
        (StepBounds::Late(by), _) => format!("{} late", format_seconds(by)),
        (StepBounds::NotDone, RehearsedEnd::Left { by: Some(by), .. }) => format!("left by {by}"),
        (StepBounds::NotDone, RehearsedEnd::Left { by: None, .. }) => "given up".to_owned(),
        (StepBounds::NotDone, _) => "not reached".to_owned(),
    }
}

fn describe_room(room: &ZoneRoom) -> String {
    let ZoneRoom { robot, zone, room_m, margin_m } = room;
    if room.is_breach() {
        format!("{robot} was {:.2} m within what {zone} closes", -room_m)
    } else {
        format!(
            "{robot} came within {room_m:.2} m of what {zone} closes; its margin is {margin_m} m"
        )
    }
}

fn step_record(step: &RehearsedStep) -> serde_json::Value {
    let seconds = |time: Option<Duration>| time.map(|time| time.as_secs_f64());
    let (done, left, by) = match &step.end {
        RehearsedEnd::Done(at) => (Some(*at), None, None),
        RehearsedEnd::Left { at, by } => (None, Some(*at), by.as_deref()),
        RehearsedEnd::Open => (None, None, None),
    };
    json!({
        "route": step.route,
        "step": step.step,
        "leg": step.is_leg,
        "earliest_s": seconds(step.earliest),
        "nominal_s": seconds(step.nominal),
        "latest_s": seconds(step.latest),
        "driven_s": seconds(done),
        "difference": step.difference(),
        "nominal_length_s": seconds(step.nominal_length),
        "length_s": seconds(step.length),
        "left_s": seconds(left),
        "left_by": by,
        "bounds": describe_bounds(step),
        "within": step.bounds() == StepBounds::Within,
    })
}

fn percent(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}

/// `+3.1 %`; never `-0.0 %`.
fn signed_percent(share: f64) -> String {
    format!("{:+.1} %", (share * 1e3).round() / 10.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(end: RehearsedEnd) -> RehearsedStep {
        let time = |s| Some(Duration::from_secs(s));
        RehearsedStep {
            route: "red".into(),
            step: "l1".into(),
            is_leg: true,
            earliest: time(8),
            nominal: time(10),
            latest: time(12),
            nominal_length: time(10),
            end,
            length: None,
        }
    }

    #[test]
    fn a_row_states_how_the_step_ended() {
        let end_of = |end| list_row(&step(end)).split_off(5);
        let at = Duration::from_millis(12_500);
        assert_eq!(end_of(RehearsedEnd::Done(at)), ["12.5 s", "+25.0 %", "0.5 s late"]);
        let by = Some("red.l1.late".to_owned());
        assert_eq!(end_of(RehearsedEnd::Left { at, by }), ["(12.5 s)", "", "left by red.l1.late"]);
        assert_eq!(end_of(RehearsedEnd::Open), ["-", "", "not reached"]);
        assert_eq!(signed_percent(-0.0001), "+0.0 %");
    }

    #[test]
    fn a_zone_that_was_entered_is_no_margin() {
        let room =
            |room_m| ZoneRoom { robot: "red".into(), zone: "pond".into(), room_m, margin_m: 0.5 };
        assert_eq!(describe_room(&room(-0.13)), "red was 0.13 m within what pond closes");
        let near = "red came within 0.20 m of what pond closes; its margin is 0.5 m";
        assert_eq!(describe_room(&room(0.2)), near);
    }
}
