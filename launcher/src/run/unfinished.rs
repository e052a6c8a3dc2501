//! What an earlier run left in the folder: an unfinished mission is continued with `--resume` and
//! kept in a folder of its own otherwise; a finished one is removed.

use std::fs::{self, DirBuilder};
use std::io::ErrorKind;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use armor_executive::journal::{self, JournalDamage, JournalError, Story};
use armor_plan::Plan;
use armor_robotfile::Configuration;

use super::arguments::RunArguments;
use super::own_run;
use super::supervisor::LogLevel;

/// The executive's journal, in the folder of a run.
pub const JOURNAL: &str = "executive.journal";
/// The state file of the journal, next to it.
const JOURNAL_STATE: &str = "executive.journal.state";
/// The folder of the versions that configd keeps, next to the journal.
pub const VERSIONS: &str = "configd";
/// The folder of the log files, next to the journal.
pub const LOGS: &str = "logs";
/// Most unfinished missions that are kept in one folder.
const MAX_KEPT: u32 = 10_000;

/// Prepares the folder for a run, and returns a message about what was in it.
///
/// # Errors
/// If there is nothing to resume, or the folder cannot be written.
pub fn prepare_folder(
    configuration: &Configuration,
    arguments: &RunArguments,
    out: &Path,
) -> Result<Option<(LogLevel, String)>> {
    let path = out.join(JOURNAL);
    let past = match journal::read(&path) {
        Err(JournalError::Io { error, .. }) if error.kind() == ErrorKind::NotFound => None,
        other => Some(other),
    };
    if arguments.resume {
        let past = past.with_context(|| format!("nothing to resume: no {}", path.display()))?;
        return match past {
            Err(JournalError::Damaged(damage)) => {
                resume_in_safety(configuration, arguments, &damage).map(Some)
            }
            past => continue_mission(configuration, arguments, &path, &past?).map(Some),
        };
    }
    let message = match past {
        Some(Ok(story)) if !story.is_unfinished() => None,
        None => None,
        // A journal that cannot be read is kept, too.
        Some(_) => Some(keep_unfinished(arguments, out)?),
    };
    for old in [JOURNAL, JOURNAL_STATE, VERSIONS] {
        remove_path(&out.join(old))?;
    }
    if configuration.mission.is_some() {
        journal::rest(&path)?;
    }
    Ok(message)
}

/// Removes what is left of an earlier mission in the folder.
///
/// # Errors
/// If it cannot be removed.
pub fn forget_mission(out: &Path) -> Result<()> {
    [JOURNAL, JOURNAL_STATE, VERSIONS].iter().try_for_each(|old| remove_path(&out.join(old)))
}

fn continue_mission(
    configuration: &Configuration,
    arguments: &RunArguments,
    path: &Path,
    story: &Story,
) -> Result<(LogLevel, String)> {
    let at = path.display();
    if !story.is_unfinished() {
        let how = if story.records.is_empty() { "has not begun" } else { "is over" };
        bail!("nothing to resume: the mission of {at} {how}; run without --resume to begin");
    }
    check_mission(configuration, arguments, path)?;
    let plan = journal::plan_of(story).map_err(|why| anyhow!("{at} cannot be resumed: {why}"))?;
    check_components(configuration, arguments, path, &plan)?;
    // No component has run since: the time in between does not count.
    journal::rest(path)?;
    let last = story.records.last().map_or(0.0, |record| record.at.as_secs_f64());
    let mission = plan.mission();
    Ok((LogLevel::Info, format!("continues mission {mission}, {last:.1} s after its start")))
}

/// Lets a mission with a damaged journal go to its safe place: the executive does so when it opens
/// the journal.
fn resume_in_safety(
    configuration: &Configuration,
    arguments: &RunArguments,
    damage: &JournalDamage,
) -> Result<(LogLevel, String)> {
    check_mission(configuration, arguments, &damage.path)?;
    let plan = match journal::plan_of(&damage.story) {
        Ok(plan) => Some(plan),
        // The executive, too, plays the file then.
        Err(_) => Plan::of(configuration).ok().flatten().map(Arc::new),
    };
    let plan = plan.with_context(|| format!("{damage}"))?;
    check_components(configuration, arguments, &damage.path, &plan)?;
    let mission = plan.mission();
    if plan.safe().is_none() {
        bail!(
            "{damage}; mission {mission} has no safe place to go to: run without --resume to begin \
             it again"
        );
    }
    Ok((LogLevel::Warn, format!("{damage}; mission {mission} goes to its safe place")))
}

fn check_mission(
    configuration: &Configuration,
    arguments: &RunArguments,
    journal: &Path,
) -> Result<()> {
    let (file, at) = (arguments.file.display(), journal.display());
    let mission = configuration.mission.as_ref();
    mission.with_context(|| format!("{file} has no mission, and {at} is the journal of one"))?;
    Ok(())
}

/// Checks that the file has the components that a journal needs.
fn check_components(
    configuration: &Configuration,
    arguments: &RunArguments,
    journal: &Path,
    plan: &Plan,
) -> Result<()> {
    let (file, at) = (arguments.file.display(), journal.display());
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
    Ok(())
}

fn keep_unfinished(arguments: &RunArguments, out: &Path) -> Result<(LogLevel, String)> {
    let kept = make_kept_folder(out)?;
    for old in [JOURNAL, JOURNAL_STATE, VERSIONS, LOGS, own_run::FILE, own_run::STATES] {
        match fs::rename(out.join(old), kept.join(old)) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                let problem = || format!("{} cannot be kept in {}", old, kept.display());
                return Err(error).with_context(problem);
            }
            _ => {}
        }
    }
    let text = format!(
        "an unfinished mission was here and is kept; to continue it: armor run {} --out {} \
         --resume",
        arguments.file.display(),
        kept.display()
    );
    Ok((LogLevel::Warn, text))
}

/// A new folder for what is kept.
fn make_kept_folder(out: &Path) -> Result<PathBuf> {
    for number in 1..=MAX_KEPT {
        let path = out.join(format!("unfinished-{number}"));
        match DirBuilder::new().mode(0o700).create(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => {
                return Err(error).with_context(|| format!("{} cannot be made", path.display()));
            }
        }
    }
    bail!("{} keeps {MAX_KEPT} unfinished missions; remove some", out.display())
}

fn remove_path(path: &Path) -> Result<()> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("the old {} cannot be removed", path.display()))
        }
        _ => Ok(()),
    }
}
