//! Inspecting a running system: its processes, its data, its mission.

pub mod absence;
pub mod bw;
pub mod data;
pub mod delay;
pub mod describe;
pub mod echo;
pub mod graph;
pub mod hz;
mod measurement;
pub mod mission;
mod named_part;
pub mod ps;
mod silence;
mod time_source;
mod unheard_reports;

use std::time::Duration;

use anyhow::{Context, Error, Result, anyhow};
use armor_inspect::run_control::{self, AbsentState, RunRequest};
use armor_inspect::{FollowingTap, ObservedSystem};
use armor_sdk::directory::DirectoryError;
use armor_sdk::tap::TapError;

use crate::arguments::RunningSystem;
use crate::system;
use absence::AbsenceReporter;

/// How long a system that has just started may take to provide the data of its daemons.
const LATCHED_WITHIN: Duration = Duration::from_secs(3);
/// How long data that a user has named may take to be provided: a wrong name is to be reported soon.
const NAMED_WITHIN: Duration = Duration::from_millis(1500);

/// Returns the running system that the arguments select.
pub fn select_system(running: &RunningSystem, tool: &str) -> Result<ObservedSystem> {
    Ok(ObservedSystem::at(&system::find_registry(running)?.to_string(), tool))
}

/// Returns that a daemon of a running system is being started again, and the remedy, if the
/// launcher knows that it belongs to the system.
pub fn describe_restarting(running: &RunningSystem, daemon: &str) -> Option<String> {
    let record = system::find_record(running).ok()?;
    let request = RunRequest::History { component: daemon.into() };
    let history = run_control::request(&record, &request).ok()?.history?;
    let is_returning = matches!(history.state, None | Some(AbsentState::Starting));
    let because = match history.last_end.as_str() {
        "" => String::new(),
        last_end => format!(" ({last_end})"),
    };
    is_returning.then(|| format!("the {daemon} is being started{because}: try again in a moment"))
}

/// Follows the data of one output for as long as the system runs.
///
/// # Errors
/// If no component provides it within three seconds.
pub fn follow_data(running: &RunningSystem, tool: &str, data: &str) -> Result<FollowingTap> {
    follow_within(running, tool, data, LATCHED_WITHIN)
}

/// Follows data that a user has named; waits for a provider that is being started again. An error
/// names what was probably meant.
///
/// # Errors
/// If no system is found, no component provides the data, or its provider has ended for good.
pub fn follow_named(running: &RunningSystem, tool: &str, data: &str) -> Result<FollowingTap> {
    let absence = AbsenceReporter::new(running, data);
    loop {
        let error = match follow_within(running, tool, data, NAMED_WITHIN) {
            Ok(following) => return Ok(following),
            Err(error) => error,
        };
        if !is_missing(&error) || !absence.check_provider().map_err(|why| anyhow!(why))? {
            return Err(silence::explain_missing(error, &select_system(running, tool)?, data));
        }
    }
}

/// Returns whether an error means that no component provides the data, or that its provider cannot
/// be reached.
fn is_missing(error: &Error) -> bool {
    let refused = |error: &TapError| {
        matches!(error, TapError::Directory(DirectoryError::Refused(_)) | TapError::Connect(_))
    };
    error.downcast_ref::<TapError>().is_some_and(refused)
}

fn follow_within(
    running: &RunningSystem,
    tool: &str,
    data: &str,
    timeout: Duration,
) -> Result<FollowingTap> {
    let observed = select_system(running, tool)?;
    let absence = AbsenceReporter::new(running, data);
    FollowingTap::begin(observed, data, timeout, absence)
        .with_context(|| format!("{data} cannot be read"))
}
