//! `armor mission rehearse FILE`: plays a mission with its real components in the simulator, faster than real
//! time, and compares the times of its steps with those that were predicted.
//!
//! `draft` writes the copy of the file that is played, `stand_in` decides what the simulator replaces,
//! `robots` finds the simulator of each route, `trial` plays it once until `signals` has one, `outcome`
//! reads the journal and judges, `report` prints.

mod draft;
mod outcome;
mod report;
mod robots;
mod signals;
mod stand_in;
mod trial;
mod zone_rooms;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use armor_ground::with_drive_lengths;
use armor_robotfile::timing::Timetable;

use crate::arguments::OutputFormat;
use crate::check;
use crate::exit::CommandEnding;
use crate::inspect_cli::mission::arguments::RehearseArguments;
use crate::print::{end_printing, print_notice};
use draft::RehearsalDraft;
use outcome::RehearsalOutcome;
use report::RehearsalReport;
use robots::list_robots;
use signals::ReceivedSignals;
use stand_in::choose_simulators;
use trial::{Trial, TrialEnd};

/// The speed below which it is not rehearsed again more slowly: real time.
const SLOWEST: f64 = 1.0;

/// Rehearses a mission and prints how it went; fails if it does not end at its goal, or something is outside
/// of its bounds.
///
/// # Errors
/// If the file has errors or no route, or no simulator can stand in for the robot, or the run does not start.
pub fn rehearse(arguments: &RehearseArguments, format: OutputFormat) -> Result<CommandEnding> {
    let file = &arguments.file;
    let checked = check::load_file(file, &arguments.overrides, &arguments.kinds)?;
    checked.print_problems(format);
    let Some(configuration) = checked.accepted() else {
        return Ok(CommandEnding::Failed);
    };
    let mission = configuration.mission.as_ref();
    let mission = mission.filter(|mission| !mission.routes.is_empty()).with_context(|| {
        format!("{} has no <route>: only drawn missions are rehearsed", file.display())
    })?;
    let manifests = checked.catalogue.manifests();
    let stand_in = choose_simulators(configuration, &manifests, arguments)?;
    let system = &configuration.system;
    let table = with_drive_lengths(mission, |lengths| {
        Timetable::of_mission(mission, system, lengths, None)
    });
    let folder = tempfile::tempdir().context("no folder for the rehearsal")?;
    let out = match &arguments.out {
        Some(out) => std::path::absolute(out)?,
        None => folder.path().join("out"),
    };
    let signals = ReceivedSignals::register()?;
    let mut speed = arguments.speed;
    loop {
        let started = Instant::now();
        let draft =
            RehearsalDraft::write(&checked, &stand_in, speed, &folder.path().join("files"))?;
        check_draft(&draft.file, arguments, format)?;
        let robots = list_robots(configuration, mission, &stand_in);
        let trial = Trial { draft: &draft, arguments, out: &out, stand_in: &stand_in, robots };
        let may_give_up = speed > SLOWEST;
        let played = trial.play(&signals, may_give_up, format)?;
        match played.end {
            TrialEnd::Interrupted => return Ok(CommandEnding::Interrupted),
            TrialEnd::Overloaded { component, share } => {
                let slower = (speed / 2.0).max(SLOWEST);
                print_notice(format_args!(
                    "at {speed} times real time {component} skips {:.0} % of its ticks on this host: \
                     rehearsing again at {slower}",
                    share * 100.0
                ));
                speed = slower;
                continue;
            }
            TrialEnd::Over { how } => {
                let outcome = RehearsalOutcome::read(&out, mission, &table)
                    .with_context(|| describe_failure(&how, &played.last_lines))?;
                let report = RehearsalReport {
                    file,
                    outcome: &outcome,
                    rooms: &played.rooms,
                    duration: checked.mission_duration(),
                    speed,
                    took: started.elapsed(),
                    skipped: played.skipped.as_ref(),
                };
                return end_printing(report.print(format)).map(|ending| match ending {
                    CommandEnding::Fine if !report.is_as_predicted() => CommandEnding::Failed,
                    ending => ending,
                });
            }
        }
    }
}

/// The copy may be wrong where the simulator replaces components: its findings are then those of the
/// replacement.
fn check_draft(file: &Path, arguments: &RehearseArguments, format: OutputFormat) -> Result<()> {
    if arguments.replace.is_empty() {
        return Ok(());
    }
    let checked = check::load_file(file, &arguments.overrides, &arguments.kinds)?;
    if checked.accepted().is_none() {
        checked.print_problems(format);
        bail!(
            "with the simulator in place of {}, the file has the errors above: give the simulator's \
             parameters with --set, or rehearse a copy of the file that has the simulator",
            arguments.replace.join(", ")
        );
    }
    Ok(())
}

fn describe_failure(how: &str, lines: &[String]) -> String {
    let lines: String = lines.iter().map(|line| format!("\n  {line}")).collect();
    format!("the rehearsal did not play the mission: {how}{lines}")
}
