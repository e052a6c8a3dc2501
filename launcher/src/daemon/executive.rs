//! The executive as a process: which version of the file it begins with, and which it hears of.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use armor_executive::{ExecutiveOptions, MissionOutcome, Newer};
use armor_plan::{FileText, Plan, Version};
use armor_robotfile::{Colours, Findings, Override};

use super::asked_to_end;
use super::configd::default_versions;
use crate::arguments;
use crate::check;
use crate::exit::Ending;

/// How long configd has to keep the version that a mission begins with. It starts at the same time.
const KEPT_WITHIN: Duration = Duration::from_secs(10);
/// How often to look whether it has.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Plays the mission to its end: code 0 at its goal, 3 in its safe place, 4 if it failed, and 130 if
/// it was told to stop, in which case the same journal goes on with it.
///
/// # Errors
/// If the mission or the journal cannot be used.
pub fn run(arguments: &arguments::Executive) -> Result<ExitCode> {
    armor_sdk::log::init();
    let folder = std::env::current_dir().context("the current folder is gone")?;
    let (overrides, malformed) = check::overrides(&arguments.overrides, &folder);
    if let Some(finding) = malformed.first() {
        bail!("{finding}");
    }
    let journal = arguments.journal.clone().unwrap_or_else(default_journal);
    let versions = arguments.versions.clone().or_else(default_versions);
    let newer = versions.map(|versions| kept_in(versions, arguments.file.clone()));
    let options = ExecutiveOptions {
        registry: arguments.registry.to_string(),
        journal,
        is_laid_out: arguments.resume,
        newer,
        cut_at: armor_executive::journal::CUT_AT,
        trust_clock: arguments.trust_clock,
    };
    let stop = asked_to_end()?;
    let first = || match options.newer.as_ref().and_then(|newer| first_kept(newer, stop)) {
        Some(version) => version.plan(),
        None => plan_of(&arguments.file, &overrides),
    };
    let outcome = armor_executive::run(first, &options, stop)?;
    Ok(ExitCode::from(match outcome {
        MissionOutcome::Goal => 0,
        MissionOutcome::Safe => 3,
        MissionOutcome::Failed => 4,
        MissionOutcome::Interrupted => Ending::Interrupted.code(),
    }))
}

/// The versions of `file` that configd keeps.
fn kept_in(folder: PathBuf, file: PathBuf) -> Newer {
    Newer::new(move |known| {
        let kept = armor_configd::newer_than(known, &folder, &file)?;
        let files = kept.files.into_iter().map(|(path, text)| FileText { path, text });
        Some(Version { number: kept.number, files: files.collect() })
    })
}

/// What configd holds at the beginning; none if it keeps nothing.
fn first_kept(newer: &Newer, stop: &AtomicBool) -> Option<Version> {
    let start = Instant::now();
    while !stop.load(Ordering::Relaxed) && start.elapsed() < KEPT_WITHIN {
        if let Some(version) = newer.than(0) {
            return Some(version);
        }
        std::thread::sleep(LOOK_EVERY);
    }
    None
}

/// The plan of the file as it is now.
fn plan_of(file: &Path, overrides: &[Override]) -> Result<Plan, String> {
    let in_words = |findings: &Findings| findings.render(Colours::No).trim_end().to_owned();
    let reading = armor_robotfile::check(armor_robotfile::load(file), overrides, None);
    let Some(configuration) = reading.configuration.as_ref().filter(|_| reading.is_valid()) else {
        return Err(in_words(&reading.findings));
    };
    let plan = Plan::of(configuration).map_err(|findings| in_words(&findings))?;
    plan.ok_or_else(|| format!("{} has no mission to play", file.display()))
}

/// In the folder of the run, or the current one.
fn default_journal() -> PathBuf {
    PathBuf::from(std::env::var_os("ARMOR_OUT").unwrap_or_default()).join("executive.journal")
}
