//! `armor mission`: the marking that the executive publishes, orders to the executive, and the
//! journal of a mission.

pub mod arguments;
mod expand;
pub(super) mod file;
mod firing;
mod journal;
mod orders;
mod rehearse;
mod replay;
mod times;
mod times_preview;
mod verification;
mod words;

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Error, Result, anyhow, bail};
use armor_marking::Marking;
use armor_sdk::control::{Order, TokenMove};
use armor_sdk::directory::DirectoryError;
use armor_sdk::tap::TapError;
use armor_wire::WireType;
use armor_wire::clock::Clock;
use armor_wire::codec;
use armor_wire::schema::{Schema, to_json};

use crate::arguments::{OutputFormat, RunningSystem};
use crate::exit::CommandEnding;
use crate::print::{end_printing, end_when_stdout_closes, print_line, print_wrapped};
use crate::verb::Verb;
use arguments::{JournalAction, MissionCommand};
use armor_inspect::{FollowingTap, ObservedSystem};
use words::format_marking;

/// What the executive publishes, latched, at every change.
pub(super) const MARKING: &str = "executive.marking";
/// The process that plays the mission.
const EXECUTIVE: &str = "executive";
/// How long a latched value may take to come.
const FIRST_WITHIN: Duration = Duration::from_secs(3);
/// Longest wait for a change before the link is checked; changes arrive without delay.
const LOOK_EVERY: Duration = Duration::from_secs(3600);

impl Verb for MissionCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(run_command(self, format)?.into())
    }
}

/// Carries out a command.
///
/// # Errors
/// If no mission runs, the executive does not answer, or the journal cannot be read.
fn run_command(mission: MissionCommand, format: OutputFormat) -> Result<CommandEnding> {
    let (by, order) = match mission {
        MissionCommand::Show { follow, running } => return show(&running, follow, format),
        MissionCommand::Journal { action: Some(JournalAction::Verify { path }), .. } => {
            return verification::print(&path, format);
        }
        MissionCommand::Journal { action: None, path, journal, running } => {
            return journal::print(path.or(journal).as_deref(), &running, format);
        }
        MissionCommand::Expand { file } => return expand::print_expanded(&file),
        MissionCommand::Times { file, begin, chances, seed } => {
            return times::print_times(&file, begin, chances.then_some(seed), format);
        }
        MissionCommand::Rehearse(arguments) => return rehearse::rehearse(&arguments, format),
        MissionCommand::Replay(arguments) => return replay::run(&arguments, format),
        MissionCommand::Operate(by) => return orders::operate(&by, format),
        MissionCommand::Fire { transition, by } => (by, Order::Fire { transition }),
        MissionCommand::Pause(by) => (by, Order::Pause),
        MissionCommand::Resume(by) => (by, Order::Resume),
        MissionCommand::Safe(by) => (by, Order::Safe),
        MissionCommand::Move { from, to, tokens, by } => {
            (by, Order::Move { moves: vec![TokenMove { from, to, tokens }] })
        }
        MissionCommand::Confirm { transition, by } => (by, Order::Confirm { transition }),
        MissionCommand::Decline { transition, by } => (by, Order::Decline { transition }),
    };
    orders::give(&by, &order, format)
}

/// Prints the marking, and again at every change if it is followed: programs get every publication.
///
/// # Errors
/// If no mission runs.
fn show(running: &RunningSystem, follow: bool, format: OutputFormat) -> Result<CommandEnding> {
    end_when_stdout_closes();
    let observed = super::select_system(running, "mission")?;
    let following = super::follow_data(running, "mission", MARKING);
    let following = following.map_err(|error| why_nothing(error, running))?;
    end_printing(follow_marking(&observed, following, follow, format))
}

/// Distinguishes a system without a mission from an executive that does not answer.
fn why_nothing(error: Error, running: &RunningSystem) -> Error {
    let what = match error.downcast_ref::<TapError>() {
        Some(TapError::Directory(DirectoryError::Refused(_))) => {
            if let Some(restarting) = super::describe_restarting(running, EXECUTIVE) {
                return anyhow!(restarting);
            }
            "no mission runs in this system"
        }
        Some(TapError::Directory(DirectoryError::OtherUser { .. })) => return error,
        Some(TapError::Directory(_)) => "it is unknown whether a mission runs",
        _ => "a mission runs, but its executive does not answer",
    };
    error.context(what)
}

fn follow_marking(
    observed: &ObservedSystem,
    mut following: FollowingTap,
    follow: bool,
    format: OutputFormat,
) -> Result<()> {
    let mut shown = MarkingPrinter { observed, format, last: None };
    let Some(first) = following.next(FIRST_WITHIN)? else {
        bail!("the executive has not sent its marking within {} s", FIRST_WITHIN.as_secs());
    };
    shown.show(following.schema(), &first.payload)?;
    if !follow {
        return Ok(());
    }
    loop {
        if let Some(next) = following.next(LOOK_EVERY)? {
            shown.show(following.schema(), &next.payload)?;
        }
    }
}

struct MarkingPrinter<'a> {
    observed: &'a ObservedSystem,
    format: OutputFormat,
    /// What was printed last, without what changes all the time.
    last: Option<Marking>,
}

impl MarkingPrinter<'_> {
    fn show(&mut self, schema: &Schema, payload: &[u8]) -> Result<()> {
        if self.format == OutputFormat::Json {
            let value = to_json(schema, payload);
            return print_line(
                value.with_context(|| format!("{MARKING} does not fit its own schema"))?,
            );
        }
        if schema.hash() != Marking::schema().hash() {
            bail!("this executive has another version; use --format json to print its marking");
        }
        let marking: Marking = codec::decode(payload)?;
        match self.last.replace(without_readings(&marking)) {
            Some(last) if self.last.as_ref() == Some(&last) => return Ok(()),
            Some(_) => print_line("")?,
            None => {}
        }
        // It was sent when it changed, and its clocks have run since.
        let now_s = match marking.clock.as_str() {
            "" => Some(self.observed.timestamp()),
            clock => time_of(self.observed, clock),
        };
        // The executive itself has not received the time yet: none of it has passed.
        let stamp_s = Some(marking.stamp).filter(|stamp_s| *stamp_s > 0.0);
        let age_s = now_s.zip(stamp_s).map_or(0.0, |(now_s, stamp_s)| (now_s - stamp_s).max(0.0));
        let file = file::problem(self.observed, marking.version);
        print_wrapped(format_marking(&marking, age_s, file.as_deref()).trim_end())
    }
}

/// Returns a marking without the times of its publication and the values of data: a difference in
/// these alone is no change of the mission. Variables that transitions set change with a firing.
fn without_readings(marking: &Marking) -> Marking {
    let mut marking = marking.clone();
    (marking.stamp, marking.now_at_s) = (0.0, 0.0);
    marking.variables.clear();
    marking.guards.iter_mut().for_each(|guard| guard.because.clear());
    marking.dates.iter_mut().for_each(|date| date.next_at_s = None);
    marking.holder.iter_mut().for_each(|holder| holder.runs_out_at_s = None);
    marking
}

/// Returns the time of the data that mission time follows, if any arrives.
fn time_of(observed: &ObservedSystem, clock: &str) -> Option<f64> {
    let newest = observed.tap(clock).ok()?.next(FIRST_WITHIN).ok()??;
    codec::decode(&newest.payload).ok().map(|clock: Clock| clock.clock)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readings_of_sensors_and_clocks_are_no_change_of_the_mission() {
        let mut before = words::tests::marking();
        before.variables = vec![words::tests::variable("battery", "0.4")];
        let mut after = before.clone();
        (after.stamp, after.now_at_s) = (before.stamp + 1.0, before.now_at_s + 1.0);
        after.variables = vec![words::tests::variable("battery", "0.5")];
        assert_eq!(without_readings(&before), without_readings(&after));
        after.fired += 1;
        assert_ne!(without_readings(&before), without_readings(&after));
    }
}
