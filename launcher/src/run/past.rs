//! What an earlier run left in the folder: an unfinished mission is gone on with if that is asked
//! for, and kept aside otherwise; what is over makes room.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use armor_executive::Ledger;
use armor_executive::journal::{self, JournalError, Story};
use armor_plan::Plan;
use armor_robotfile::Configuration;

use super::supervisor::Level;
use crate::arguments;

/// The executive's journal, in the folder of a run.
pub const JOURNAL: &str = "executive.journal";
/// The versions of the file that configd keeps, beside it.
pub const VERSIONS: &str = "configd";
/// How many unfinished missions are kept beside each other.
const MAX_KEPT: u32 = 10_000;

/// Makes the folder ready for a run. Answers what is to be said about what was in it.
///
/// # Errors
/// If there is nothing to resume, or the folder cannot be written.
pub fn settle(
    configuration: &Configuration,
    arguments: &arguments::Run,
    out: &Path,
) -> Result<Option<(Level, String)>> {
    let path = out.join(JOURNAL);
    let past = match journal::read(&path) {
        Err(JournalError::Io { error, .. }) if error.kind() == ErrorKind::NotFound => None,
        other => Some(other),
    };
    if arguments.resume {
        let story = past.with_context(|| format!("nothing to resume: no {}", path.display()))?;
        return go_on(configuration, arguments, &path, &story?).map(Some);
    }
    let said = match past {
        Some(Ok(story)) if !story.is_unfinished() => None,
        None => None,
        // Not even one that cannot be read is lost.
        Some(_) => Some(keep_aside(arguments, out)?),
    };
    for old in [JOURNAL, VERSIONS] {
        remove(&out.join(old))?;
    }
    if configuration.mission.is_some() {
        journal::rest(&path)?;
    }
    Ok(said)
}

fn go_on(
    configuration: &Configuration,
    arguments: &arguments::Run,
    path: &Path,
    story: &Story,
) -> Result<(Level, String)> {
    let at = path.display();
    if !story.is_unfinished() {
        let how = if story.records.is_empty() { "has not begun" } else { "is over" };
        bail!("nothing to resume: the mission of {at} {how}; run without --resume to begin");
    }
    let file = arguments.file.display();
    let mission = configuration.mission.as_ref();
    mission.with_context(|| format!("{file} has no mission, and {at} is the journal of one"))?;
    let plan = played(story).map_err(|error| anyhow!("{at} cannot be gone on with: {error}"))?;
    let components = &configuration.system.components;
    let stranger = plan
        .components()
        .iter()
        .find(|needed| !components.iter().any(|there| there.name.value == needed.name));
    if let Some(stranger) = stranger {
        bail!(
            "{at} is the journal of mission {}, whose component {} is not in {file}: give the \
             file that was played",
            plan.mission(),
            stranger.name
        );
    }
    // Nothing has run since: the time in between does not count.
    journal::rest(path)?;
    let last = story.records.last().map_or(0.0, |record| record.at.as_secs_f64());
    let mission = plan.mission();
    Ok((Level::Info, format!("goes on with mission {mission}, {last:.1} s after its start")))
}

/// The plan that a journal ends with.
fn played(story: &Story) -> Result<Arc<Plan>> {
    let version = journal::began_with(&story.records);
    let version = version.context("it does not hold the file it was played from")?;
    let plan = version.plan().map_err(|why| anyhow!(why))?;
    Ok(Arc::clone(Ledger::replay(Arc::new(plan), &story.records)?.plan()))
}

fn keep_aside(arguments: &arguments::Run, out: &Path) -> Result<(Level, String)> {
    let kept = room(out)?;
    for old in [JOURNAL, VERSIONS] {
        match fs::rename(out.join(old), kept.join(old)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                let problem = || format!("{} cannot be kept in {}", old, kept.display());
                return Err(error).with_context(problem);
            }
            _ => {}
        }
    }
    let text = format!(
        "an unfinished mission was here and is kept; to go on with it: armor run {} --out {} \
         --resume",
        arguments.file.display(),
        kept.display()
    );
    Ok((Level::Warn, text))
}

/// A new folder for what is kept.
fn room(out: &Path) -> Result<PathBuf> {
    for number in 1..=MAX_KEPT {
        let path = out.join(format!("unfinished-{number}"));
        match fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => {
                return Err(error).with_context(|| format!("{} cannot be made", path.display()));
            }
        }
    }
    bail!("{} keeps {MAX_KEPT} unfinished missions; remove some", out.display())
}

fn remove(path: &Path) -> Result<()> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("the old {} cannot be removed", path.display()))
        }
        _ => Ok(()),
    }
}
