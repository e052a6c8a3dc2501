//! Inspecting a running system: its processes, its data, its mission.

pub mod describe;
pub mod echo;
pub mod graph;
pub mod hz;
pub mod mission;
pub mod ps;

use anyhow::{Context, Result};
use armor_inspect::{FollowingTap, ObservedSystem};

use crate::arguments::RunningSystem;
use crate::system;

/// Returns the running system that the arguments select.
pub fn select_system(running: &RunningSystem, tool: &str) -> Result<ObservedSystem> {
    Ok(ObservedSystem::at(&system::find_registry(running)?.to_string(), tool))
}

/// Follows the data of one output for as long as the system runs.
pub fn follow_data(observed: ObservedSystem, data: &str) -> Result<FollowingTap> {
    let name = data.to_owned();
    let report_end = move |reason: &str| {
        eprintln!("{name}: the link has ended: {reason}; waiting for the provider");
    };
    FollowingTap::begin(observed, data, report_end)
        .with_context(|| format!("{data} cannot be read"))
}
