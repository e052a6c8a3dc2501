//! One run of the copy: started as `armor run` starts it, with the true positions of its robots from the
//! simulators, and given up if its components do not keep up with the speed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use armor_inspect::launch::{ChildRun, LaunchPlan, RunStage};
use armor_inspect::log::RunLog;
use armor_inspect::{MissionWatch, ObservedSystem};
use armor_sdk::messages::Odometry;
use armor_wire::codec;
use serde_json::json;

use super::draft::RehearsalDraft;
use super::signals::ReceivedSignals;
use super::stand_in::StandIn;
use super::zone_rooms::{ZoneMeter, ZoneRoom};
use crate::arguments::OutputFormat;
use crate::inspect_cli::mission::arguments::RehearseArguments;
use crate::print::print_line;
use crate::run::process::OWN_PROGRAM;

/// Period of looking at the run.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Period of the positions in JSON.
const SHOW_EVERY: Duration = Duration::from_millis(100);
/// Period of asking the components for the ticks that they have skipped.
const ASK_EVERY: Duration = Duration::from_secs(1);
/// The components do not keep up if one skips more than this share of its ticks ...
const MAX_SKIPPED: f64 = 0.2;
/// ... for this many times in a row: the first ticks of a run are late.
const MAX_LATE_LOOKS: u32 = 2;
/// Least number of ticks between two looks that a share is taken of.
const MIN_TICKS: u64 = 5;
/// How long the simulator may take to publish.
const PROVIDER_WITHIN: Duration = Duration::from_secs(20);
/// After a signal that the terminal may also have sent to the run, it is asked to stop only after this: a
/// second request would kill it.
const STOPS_BY_ITSELF_WITHIN: Duration = Duration::from_secs(1);
/// The last lines of the log that explain a failure.
const LAST_LINES: usize = 8;

/// What is run.
pub struct Trial<'a> {
    pub draft: &'a RehearsalDraft,
    pub arguments: &'a RehearseArguments,
    pub out: &'a Path,
    pub stand_in: &'a StandIn,
    /// The robots, one for each simulator, with the measures of their zones.
    pub robots: Vec<RehearsedRobot>,
}

/// A simulator, and whose robot it is.
#[derive(Clone, Debug)]
pub struct RehearsedRobot {
    /// The simulator.
    pub simulator: String,
    /// The routes of the robot.
    pub routes: Vec<String>,
    /// How near it comes to the zones.
    pub meter: ZoneMeter,
}

/// How a run went.
pub struct PlayedTrial {
    pub end: TrialEnd,
    /// The least room of each robot at each zone.
    pub rooms: Vec<ZoneRoom>,
    /// The component that has skipped the largest share of its ticks, with that share, if it has any.
    pub skipped: Option<(String, f64)>,
    /// Warnings and errors of the log, the newest last.
    pub last_lines: Vec<String>,
}

/// How a run ended.
pub enum TrialEnd {
    /// A signal has ended it.
    Interrupted,
    /// It was given up: the component skipped this share of its ticks.
    Overloaded { component: String, share: f64 },
    /// By itself.
    Over { how: String },
}

/// The positions that are to be printed next.
struct ShownPositions {
    newest: BTreeMap<usize, TruePosition>,
    shown: Instant,
}

/// A true position.
struct TruePosition {
    robot: usize,
    stamp_s: f64,
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
}

impl Trial<'_> {
    /// Plays it to its end. `may_give_up`: whether it ends when components do not keep up.
    ///
    /// # Errors
    /// If it cannot be started, or stdout is closed.
    pub fn play(
        mut self,
        signals: &ReceivedSignals,
        may_give_up: bool,
        format: OutputFormat,
    ) -> Result<PlayedTrial> {
        let log = RunLog::default();
        let run = ChildRun::start(&self.plan_launch(), log.clone(), Arc::new(|| {}))?;
        let (positions, received) = mpsc::channel();
        let mut observed: Option<ObservedRun> = None;
        let mut shown = ShownPositions { newest: BTreeMap::new(), shown: Instant::now() };
        let mut end = None;
        loop {
            thread::sleep(LOOK_EVERY);
            match run.stage() {
                RunStage::Running(record) if observed.is_none() => {
                    let registry = record.registry.to_string();
                    observed = Some(ObservedRun::begin(&registry, &self.robots, &positions)?);
                }
                RunStage::Ended { how, .. } => {
                    end = end.or(Some(TrialEnd::Over { how }));
                    break;
                }
                _ => {}
            }
            let observed = observed.as_mut();
            self.take_positions(&received, &mut shown);
            let begin_s = observed.as_ref().and_then(|observed| observed.find_begin_s());
            if let (Some(begin_s), OutputFormat::Json) = (begin_s, format) {
                self.print_positions(&mut shown, begin_s)?;
            }
            if end.is_none() && signals.has_come() {
                end = Some(TrialEnd::Interrupted);
                wait_and_stop(&run);
            }
            if let Some(observed) = observed
                && end.is_none()
                && let Some((component, share)) = observed.find_overload(&self.stand_in.simulators)
                && may_give_up
            {
                end = Some(TrialEnd::Overloaded { component, share });
                run.stop();
            }
        }
        drop(positions);
        let skipped = observed.as_ref().and_then(|observed| observed.ticks.find_worst());
        self.take_positions(&received, &mut shown);
        let rooms = self.robots.iter().flat_map(|robot| robot.meter.rooms()).collect();
        let end = end.unwrap_or(TrialEnd::Interrupted);
        Ok(PlayedTrial { end, rooms, skipped, last_lines: list_last_lines(&log) })
    }

    fn plan_launch(&self) -> LaunchPlan {
        let mut arguments: Vec<String> =
            ["--headless", "--quiet", "--trust-clock"].map(Into::into).into();
        for set in &self.arguments.overrides {
            arguments.extend(["--set".into(), set.clone()]);
        }
        LaunchPlan {
            program: PathBuf::from(OWN_PROGRAM),
            file: self.draft.file.clone(),
            out: Some(self.out.into()),
            components: self.arguments.kinds.directories.clone(),
            arguments,
            ..LaunchPlan::default()
        }
    }

    fn take_positions(&mut self, received: &Receiver<TruePosition>, shown: &mut ShownPositions) {
        for position in received.try_iter() {
            self.robots[position.robot].meter.take_position(position.x_m, position.y_m);
            shown.newest.insert(position.robot, position);
        }
    }

    /// Prints the newest positions, if it is time.
    fn print_positions(&self, shown: &mut ShownPositions, begin_s: f64) -> Result<()> {
        if shown.shown.elapsed() < SHOW_EVERY {
            return Ok(());
        }
        shown.shown = Instant::now();
        for position in std::mem::take(&mut shown.newest).into_values() {
            let robot = &self.robots[position.robot];
            print_line(json!({ "position": {
                "routes": robot.routes,
                "time_s": position.stamp_s - begin_s,
                "at": [position.x_m, position.y_m],
                "heading_rad": position.yaw_rad,
            }}))?;
        }
        Ok(())
    }
}

/// What is observed of a run.
struct ObservedRun {
    system: ObservedSystem,
    mission: MissionWatch,
    ticks: SkippedTicks,
    asked: Instant,
}

impl ObservedRun {
    fn begin(
        registry: &str,
        robots: &[RehearsedRobot],
        positions: &Sender<TruePosition>,
    ) -> Result<Self> {
        let system = ObservedSystem::at(registry, "rehearsal");
        for (robot, of) in robots.iter().enumerate() {
            let (system, positions) = (system.clone(), positions.clone());
            let data = format!("{}.truth", of.simulator);
            thread::Builder::new()
                .name("truth".into())
                .spawn(move || follow_truth(&system, &data, robot, &positions))
                .context("starting a thread for the true positions")?;
        }
        let mission = MissionWatch::begin(system.directory(), Arc::new(|| {}))?;
        Ok(Self { system, mission, ticks: SkippedTicks::default(), asked: Instant::now() })
    }

    /// System time at the begin of the mission.
    fn find_begin_s(&self) -> Option<f64> {
        let marking = self.mission.look().marking?;
        Some(marking.stamp - marking.now_at_s)
    }

    /// Returns a component that does not keep up, but for the simulators, whose time is the host's.
    fn find_overload(&mut self, simulators: &[String]) -> Option<(String, f64)> {
        if self.asked.elapsed() < ASK_EVERY {
            return None;
        }
        self.asked = Instant::now();
        let statuses = self.system.ask_statuses().ok()?.into_iter().filter_map(|it| it.status.ok());
        let ours = statuses.filter(|status| !simulators.contains(&status.name));
        let ours = ours.map(|status| (status.name, status.exec_calls, status.skipped_ticks));
        self.ticks.add_look(ours.collect())
    }
}

/// The ticks of all components, from look to look.
#[derive(Debug, Default)]
struct SkippedTicks {
    /// By component: calls and skipped ticks at the last look.
    known: BTreeMap<String, (u64, u64)>,
    late_looks: u32,
}

impl SkippedTicks {
    /// Adds the counts of each component; returns the worst one if one has been late for several looks.
    fn add_look(&mut self, counts: Vec<(String, u64, u64)>) -> Option<(String, f64)> {
        let mut worst: Option<(String, f64)> = None;
        for (name, calls, skipped) in counts {
            let before = self.known.insert(name.clone(), (calls, skipped)).unwrap_or_default();
            // A process that was started again counts from 0.
            let calls = calls.saturating_sub(before.0);
            let skipped = skipped.saturating_sub(before.1);
            if calls + skipped < MIN_TICKS {
                continue;
            }
            let share = skipped as f64 / (calls + skipped) as f64;
            if worst.as_ref().is_none_or(|worst| share > worst.1) {
                worst = Some((name, share));
            }
        }
        let late = worst.filter(|(_, share)| *share > MAX_SKIPPED);
        self.late_looks = if late.is_some() { self.late_looks + 1 } else { 0 };
        late.filter(|_| self.late_looks >= MAX_LATE_LOOKS)
    }

    /// The component that has skipped the largest share of all its ticks, if it has skipped any.
    fn find_worst(&self) -> Option<(String, f64)> {
        let shares = self.known.iter().filter(|(_, (_, skipped))| *skipped > 0);
        let shares = shares.map(|(name, (calls, skipped))| {
            (name.clone(), *skipped as f64 / (calls + skipped) as f64)
        });
        shares.max_by(|one, other| one.1.total_cmp(&other.1))
    }
}

/// Sends each true position until the simulator or the receiver ends.
fn follow_truth(
    system: &ObservedSystem,
    data: &str,
    robot: usize,
    positions: &Sender<TruePosition>,
) {
    let Ok(mut tap) = system.tap_within(data, PROVIDER_WITHIN) else { return };
    loop {
        match tap.next(LOOK_EVERY) {
            Ok(None) => {}
            Ok(Some(data)) => {
                let Ok(truth) = codec::decode::<Odometry>(&data.payload) else { return };
                let pose = truth.pose.pose;
                let turned = pose.orientation;
                let position = TruePosition {
                    robot,
                    stamp_s: truth.stamp,
                    x_m: pose.position.x,
                    y_m: pose.position.y,
                    yaw_rad: 2.0 * turned.z.atan2(turned.w),
                };
                if positions.send(position).is_err() {
                    return;
                }
            }
            Err(_) => match system.tap_within(data, PROVIDER_WITHIN) {
                // Its process was restarted.
                Ok(again) => tap = again,
                Err(_) => return,
            },
        }
    }
}

/// The terminal sends Ctrl-C to the run as well; a signal to this process alone ends it here.
fn wait_and_stop(run: &ChildRun) {
    let asked = Instant::now();
    while asked.elapsed() < STOPS_BY_ITSELF_WITHIN && !run.has_ended() {
        thread::sleep(LOOK_EVERY);
    }
    run.stop();
}

fn list_last_lines(log: &RunLog) -> Vec<String> {
    let (_, lines) = log.since(0);
    let grave = lines.iter().filter(|line| line.level == "ERROR" || line.level == "WARN");
    let mut grave: Vec<_> = grave.map(|line| format!("{}: {}", line.name, line.text)).collect();
    grave.drain(..grave.len().saturating_sub(LAST_LINES));
    grave
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(ticks: &mut SkippedTicks, calls: u64, skipped: u64) -> Option<(String, f64)> {
        ticks.add_look(vec![("mapper".into(), calls, skipped), ("chart".into(), 1, 0)])
    }

    #[test]
    fn a_component_is_late_if_it_skips_ticks_at_several_looks() {
        let mut ticks = SkippedTicks::default();
        assert_eq!(look(&mut ticks, 50, 50), None, "the first ticks of a run are late");
        assert_eq!(look(&mut ticks, 100, 51), None);
        assert_eq!(look(&mut ticks, 130, 71), None);
        assert_eq!(look(&mut ticks, 160, 101), Some(("mapper".into(), 0.5)));
        assert_eq!(ticks.find_worst(), Some(("mapper".into(), 101.0 / 261.0)));
        assert_eq!(look(&mut ticks, 5, 0), None, "it was started again");
    }
}
