//! A rehearsal: `armor mission rehearse` as a child process, the true positions that it prints meanwhile, and
//! the times of the steps that it prints at its end.

mod on_map;
mod strip;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use armor_geo::MapPoint;
use armor_inspect::launch::{ChildRun, LaunchError, LaunchPlan, LaunchVerb, RunStage};
use armor_inspect::log::RunLog;
use eframe::egui;
use serde_json::Value;

use crate::kinds::find_armor;
use crate::workspace::Workspace;

/// Positions of a trail: the oldest are forgotten.
const MAX_TRAIL: usize = 4_000;
/// The most messages of the program that are shown.
const MAX_MESSAGES: usize = 8;

/// How many times faster than real time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RehearsalSpeed {
    /// Real time.
    Real,
    /// Five times.
    Five,
    /// Twenty times.
    #[default]
    Twenty,
}

impl RehearsalSpeed {
    /// Each with its name and the argument of the program.
    pub const NAMED: [(&str, &str, Self); 3] =
        [("1×", "1", Self::Real), ("5×", "5", Self::Five), ("20×", "20", Self::Twenty)];

    fn argument(self) -> &'static str {
        Self::NAMED[self as usize].1
    }
}

/// The rehearsal of a map, if there is one.
#[derive(Default)]
pub struct MapRehearsal {
    pub speed: RehearsalSpeed,
    /// It begins when the files are saved.
    is_wanted: bool,
    /// Saving them was ordered.
    is_ordered: bool,
    run: Option<ChildRun>,
    log: RunLog,
    /// How many lines of the log were read.
    read: u64,
    /// What it has printed so far.
    pub records: RehearsalRecords,
}

/// What a rehearsal has printed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RehearsalRecords {
    /// The robots, by the routes that are theirs.
    pub robots: BTreeMap<Vec<String>, RehearsedPosition>,
    /// The steps that were compared, in their order.
    pub steps: Vec<ComparedStep>,
    /// Where a robot was in a zone that it must not enter.
    pub breaches: Vec<String>,
    /// How the mission ended.
    pub end: Option<RehearsalEnd>,
    /// What the program reports otherwise.
    pub messages: Vec<String>,
}

/// Where a robot truly is.
#[derive(Clone, Debug, PartialEq)]
pub struct RehearsedPosition {
    /// Mission time, in seconds.
    pub time_s: f64,
    /// Its position.
    pub at: MapPoint,
    /// Its direction, anticlockwise from x.
    pub heading_rad: f64,
    /// Where it was, the oldest first.
    pub trail: Vec<MapPoint>,
}

/// A step, predicted and driven.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedStep {
    /// The route.
    pub route: String,
    /// The step.
    pub step: String,
    /// When it ends at exactly the speeds of the file, in seconds.
    pub nominal_s: Option<f64>,
    /// When it has ended.
    pub driven_s: Option<f64>,
    /// By which share that is later.
    pub difference: Option<f64>,
    /// What its bounds are, in words.
    pub bounds: String,
    /// Whether it ended within them.
    pub is_within: bool,
}

/// How a mission ended.
#[derive(Clone, Debug, PartialEq)]
pub struct RehearsalEnd {
    /// `goal`, `safe`, …; none if it was not over.
    pub outcome: Option<String>,
    /// Mission time.
    pub after_s: f64,
    /// The proven latest end.
    pub proven_latest_s: Option<f64>,
    /// Whether everything was within its bounds.
    pub is_as_predicted: bool,
    /// How many times faster than real time it was played.
    pub speed: f64,
}

impl RehearsalRecords {
    /// Takes a line of the program.
    fn read_line(&mut self, text: &str) {
        let Ok(record) = serde_json::from_str::<Value>(text) else {
            return self.add_message(text);
        };
        let number = |of: &Value, key: &str| of.get(key).and_then(Value::as_f64);
        let words = |of: &Value, key: &str| of[key].as_str().unwrap_or_default().to_owned();
        let is_true = |of: &Value, key: &str| of[key] == Value::Bool(true);
        if let Some(position) = record.get("position") {
            self.read_position(position);
        } else if record.get("step").is_some() {
            self.steps.push(ComparedStep {
                route: words(&record, "route"),
                step: words(&record, "step"),
                nominal_s: number(&record, "nominal_s"),
                driven_s: number(&record, "driven_s"),
                difference: number(&record, "difference"),
                bounds: words(&record, "bounds"),
                is_within: is_true(&record, "within"),
            });
        } else if let Some(zone) = record.get("zone") {
            if is_true(zone, "entered") {
                let within_m = -number(zone, "room_m").unwrap_or_default();
                let (robot, zone) = (words(zone, "robot"), words(zone, "zone"));
                self.breaches
                    .push(format!("{robot} was {within_m:.2} m within what {zone} closes"));
            }
        } else if let Some(end) = record.get("end") {
            self.end = Some(RehearsalEnd {
                outcome: end["outcome"].as_str().map(ToOwned::to_owned),
                after_s: number(end, "after_s").unwrap_or_default(),
                proven_latest_s: number(end, "proven_latest_s"),
                is_as_predicted: is_true(end, "as_predicted"),
                speed: number(end, "speed").unwrap_or_default(),
            });
        } else if record.get("code").is_some() {
            self.add_message(&format!("{}: {}", words(&record, "code"), words(&record, "message")));
        }
    }

    fn read_position(&mut self, position: &Value) {
        let routes = position["routes"].as_array().into_iter().flatten();
        let routes: Vec<_> = routes.filter_map(Value::as_str).map(ToOwned::to_owned).collect();
        let number = |value: &Value| value.as_f64();
        let (Some(time_s), Some(x_m), Some(y_m), Some(heading_rad)) = (
            number(&position["time_s"]),
            number(&position["at"][0]),
            number(&position["at"][1]),
            number(&position["heading_rad"]),
        ) else {
            return;
        };
        let Ok(at) = MapPoint::new(x_m, y_m) else { return };
        let mut trail = match self.robots.remove(&routes) {
            // Time goes back where it is rehearsed again, more slowly.
            Some(before) if before.time_s <= time_s => before.trail,
            _ => Vec::new(),
        };
        if trail.len() == MAX_TRAIL {
            trail.remove(0);
        }
        trail.push(at);
        self.robots.insert(routes, RehearsedPosition { time_s, at, heading_rad, trail });
    }

    fn add_message(&mut self, text: &str) {
        if !text.trim().is_empty() && self.messages.len() < MAX_MESSAGES {
            self.messages.push(text.to_owned());
        }
    }

    /// The newest mission time of a position.
    pub fn time_s(&self) -> Option<f64> {
        self.robots.values().map(|robot| robot.time_s).reduce(f64::max)
    }
}

impl MapRehearsal {
    /// Whether one runs, or waits for the files to be saved.
    pub fn is_going_on(&self) -> bool {
        self.is_wanted || self.is_running()
    }

    fn is_running(&self) -> bool {
        self.run.as_ref().is_some_and(|run| !run.has_ended())
    }

    /// Begins as soon as the files are saved.
    pub fn request(&mut self) {
        if !self.is_going_on() {
            (self.is_wanted, self.is_ordered) = (true, false);
        }
    }

    /// Ends it in order; what it has shown so far remains.
    pub fn stop(&mut self) {
        self.is_wanted = false;
        if let Some(run) = &self.run {
            run.stop();
        }
    }

    /// Begins what was requested, and takes what was printed since the last frame.
    pub fn follow(&mut self, ctx: &egui::Context, workspace: &mut Workspace) {
        if self.is_wanted {
            self.begin_if_saved(ctx, workspace);
        }
        let (first, lines) = self.log.since(self.read);
        self.read = first + lines.len() as u64;
        for line in lines {
            self.records.read_line(&line.text);
        }
    }

    fn begin_if_saved(&mut self, ctx: &egui::Context, workspace: &mut Workspace) {
        let project = &workspace.project;
        let is_saved = !project.is_dirty() && !project.is_draft();
        match project.path().map(ToOwned::to_owned).filter(|_| is_saved) {
            Some(path) => {
                self.is_wanted = false;
                let folders = workspace.live.component_folders().to_vec();
                if let Err(error) = self.begin(ctx, &path, folders) {
                    workspace.messages.warn(error.to_string());
                }
            }
            None if !self.is_ordered => {
                self.is_ordered = true;
                workspace.order_command(crate::commands::Command::Save);
            }
            None => {}
        }
    }

    fn begin(
        &mut self,
        ctx: &egui::Context,
        file: &Path,
        components: Vec<std::path::PathBuf>,
    ) -> Result<(), LaunchError> {
        let plan = LaunchPlan {
            program: find_armor().ok_or(LaunchError::NoProgram)?,
            verb: LaunchVerb::Rehearse,
            file: file.into(),
            components,
            arguments: vec!["--speed".into(), self.speed.argument().into()],
            ..LaunchPlan::default()
        };
        (self.log, self.read) = (RunLog::default(), 0);
        self.records = RehearsalRecords::default();
        let ctx = ctx.clone();
        let wake = Arc::new(move || ctx.request_repaint());
        self.run = Some(ChildRun::start(&plan, self.log.clone(), wake)?);
        Ok(())
    }

    /// How the program ended, if it did so without the end of the mission.
    fn failure(&self) -> Option<String> {
        match self.run.as_ref()?.stage() {
            RunStage::Ended { how, .. } if self.records.end.is_none() => Some(how),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_become_positions_steps_and_an_end() {
        let mut records = RehearsalRecords::default();
        let position = |time_s: f64, x_m: f64| {
            format!(
                r#"{{"position":{{"routes":["red"],"time_s":{time_s},"at":[{x_m},2],"heading_rad":0}}}}"#
            )
        };
        records.read_line(&position(1.0, 0.5));
        records.read_line(&position(2.0, 1.5));
        let robot = &records.robots[&vec!["red".to_owned()]];
        assert_eq!((robot.at.x_m(), robot.trail.len(), records.time_s()), (1.5, 2, Some(2.0)));
        records.read_line(&position(0.5, 0.0));
        let again = &records.robots[&vec!["red".to_owned()]];
        assert_eq!(again.trail.len(), 1, "it was begun again");
        records.read_line(
            r#"{"route":"red","step":"l1","nominal_s":10,"driven_s":11,"difference":0.1,"bounds":"kept","within":true}"#,
        );
        records.read_line(r#"{"zone":{"robot":"red","zone":"pond","room_m":-0.2,"entered":true}}"#);
        records.read_line(
            r#"{"end":{"outcome":"goal","after_s":11,"as_predicted":false,"speed":20}}"#,
        );
        records.read_line("at 20 times real time mapper skips its ticks");
        assert_eq!((records.steps.len(), records.messages.len()), (1, 1));
        assert_eq!(records.breaches, ["red was 0.20 m within what pond closes"]);
        let end = records.end.expect("an end");
        assert_eq!((end.outcome.as_deref(), end.is_as_predicted), (Some("goal"), false));
    }
}
