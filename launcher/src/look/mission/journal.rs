//! `armor mission journal`: what was decided, and when.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use armor_executive::Record;
use armor_executive::journal;
use serde_json::json;

use super::super::{printed, say};
use crate::arguments::{Format, Running};
use crate::exit::Ending;
use crate::system;

/// Prints a journal; without `path` that of the running system.
///
/// # Errors
/// If there is none, or it is not one.
pub fn print(path: Option<&Path>, running: &Running, format: Format) -> Result<Ending> {
    let path = match path {
        Some(path) => path.to_owned(),
        None => of_the_running(running)?,
    };
    let story = journal::read(&path)?;
    if story.records.is_empty() {
        bail!("{} holds no record", path.display());
    }
    let print = || story.records.iter().try_for_each(|record| line(record, format));
    printed(print())
}

/// The journal that `armor run` lets the executive keep.
fn of_the_running(running: &Running) -> Result<PathBuf> {
    let record =
        system::record(running).context("give --journal FILE, or name a running system")?;
    let journal = record.out.join(JOURNAL);
    if !journal.exists() {
        bail!("no mission runs in {}: there is no {}", record.system, journal.display());
    }
    Ok(journal)
}

/// Its name in the folder of a run.
const JOURNAL: &str = "executive.journal";

/// One record.
pub fn line(record: &Record, format: Format) -> Result<()> {
    match format {
        Format::Json => say(json!({ "at_s": record.at.as_secs_f64(), "record": record })),
        _ => say(format!("{}  {}", time(record), record.entry)),
    }
}

/// Mission time, as on a watch.
pub fn time(record: &Record) -> String {
    let (s, ms) = (record.at.as_secs(), record.at.subsec_millis());
    format!("{}:{:02}:{:02}.{ms:03}", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use armor_executive::Entry;
    use std::time::Duration;

    #[test]
    fn mission_time_reads_like_a_watch() {
        let at = Duration::from_millis(3_723_004);
        assert_eq!(time(&Record { at, entry: Entry::Put { firing: 1 } }), "1:02:03.004");
    }
}
