//! Inspecting a running system: its processes, its data, its mission.

pub mod data;
pub mod describe;
pub mod echo;
pub mod graph;
pub mod hz;
pub mod mission;
pub mod ps;
mod silence;

use std::time::Duration;

use anyhow::{Context, Result};
use armor_inspect::{FollowingTap, ObservedSystem};

use crate::arguments::RunningSystem;
use crate::print::print_notice;
use crate::system;

/// How long a system that has just started may take to provide the data of its daemons.
const LATCHED_WITHIN: Duration = Duration::from_secs(3);
/// How long data that a user has named may take to be provided: a wrong name is to be reported soon.
const NAMED_WITHIN: Duration = Duration::from_millis(1500);

/// Returns the running system that the arguments select.
pub fn select_system(running: &RunningSystem, tool: &str) -> Result<ObservedSystem> {
    Ok(ObservedSystem::at(&system::find_registry(running)?.to_string(), tool))
}

/// Follows the data of one output for as long as the system runs.
///
/// # Errors
/// If no component provides it within three seconds.
pub fn follow_data(observed: ObservedSystem, data: &str) -> Result<FollowingTap> {
    follow_within(observed, data, LATCHED_WITHIN)
}

/// Follows data that a user has named; an error names what was probably meant.
///
/// # Errors
/// If no system is found, or no component provides the data.
pub fn follow_named(running: &RunningSystem, tool: &str, data: &str) -> Result<FollowingTap> {
    follow_within(select_system(running, tool)?, data, NAMED_WITHIN)
        .or_else(|error| Err(silence::explain_missing(error, &select_system(running, tool)?, data)))
}

fn follow_within(observed: ObservedSystem, data: &str, timeout: Duration) -> Result<FollowingTap> {
    let name = data.to_owned();
    let report_end = move |reason: &str| {
        print_notice(format_args!(
            "{name}: the link has ended: {reason}; waiting for the provider"
        ));
    };
    FollowingTap::begin(observed, data, timeout, report_end)
        .with_context(|| format!("{data} cannot be read"))
}
