//! Looking at a running system: who is there, what flows, how the mission stands.

pub mod describe;
pub mod echo;
pub mod graph;
pub mod hz;
pub mod mission;
pub mod ps;

use std::io::{self, Write};

use anyhow::{Context, Result};
use armor_inspect::{FollowingTap, ObservedSystem};

use crate::arguments::Running;
use crate::exit::Ending;
use crate::system;

/// The system that is meant.
pub fn find(running: &Running, tool: &str) -> Result<ObservedSystem> {
    Ok(ObservedSystem::at(&system::registry(running)?.to_string(), tool))
}

/// The data of one output for as long as the system runs.
pub fn follow(observed: ObservedSystem, data: &str) -> Result<FollowingTap> {
    let name = data.to_owned();
    let told = move |reason: &str| {
        eprintln!("{name}: the link has ended: {reason}; waiting for its provider");
    };
    FollowingTap::begin(observed, data, told).with_context(|| format!("{data} cannot be read"))
}

/// What prints; whoever stops reading has seen enough.
pub fn printed(result: Result<()>) -> Result<Ending> {
    match result {
        Ok(()) => Ok(Ending::Fine),
        Err(error) => match error.downcast_ref::<io::Error>() {
            Some(io) if io.kind() == io::ErrorKind::BrokenPipe => Ok(Ending::Fine),
            _ => Err(error),
        },
    }
}

/// One line on stdout, at once.
pub fn say(line: impl std::fmt::Display) -> Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}")?;
    out.flush()?;
    Ok(())
}
