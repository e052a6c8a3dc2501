//! The lines of the logs that are in a recording.

use std::collections::{BTreeSet, VecDeque};
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use armor_recording::Recording;
use armor_recording::trail::LOGS;
use armor_robotfile::advise_similar;
use armor_sdk::messages::Log;

use super::entry::LogEntry;
use super::{LogPrinter, LogsArguments};
use crate::arguments::OutputFormat;

/// Prints the lines of a recording.
///
/// # Errors
/// If it cannot be read, or has no lines, or none of a component that is named.
pub fn print_recorded(path: &Path, arguments: &LogsArguments, format: OutputFormat) -> Result<()> {
    let shown = path.display();
    let unreadable = || format!("{shown} cannot be read as a recording");
    let mut recording = Recording::open(path).with_context(unreadable)?;
    let summary = recording.summary();
    let begin_s = summary.begin_s().unwrap_or_default();
    if !summary.outputs.iter().any(|output| output.data == LOGS) {
        bail!("{shown} has no lines of logs: they are recorded on the host of the run");
    }
    let printer = LogPrinter { arguments, format };
    let most = arguments.lines.unwrap_or(usize::MAX);
    let (mut last, mut names) = (VecDeque::new(), BTreeSet::new());
    recording.select(|data| data == LOGS);
    while let Some(message) = recording.next_message()? {
        let log: Log = message.decode_as().map_err(|reason| {
            anyhow!(
                "{shown}: {reason}. `armor bag convert {shown} FILE.csv --data {LOGS}` shows them"
            )
        })?;
        let time_s = log.stamp - begin_s;
        let entry = LogEntry::of_recording(log, time_s);
        if !names.contains(&entry.name) {
            names.insert(entry.name.clone());
        }
        if printer.is_wanted(&entry) {
            last.push_back(entry);
        }
        if last.len() > most {
            last.pop_front();
        } else if most == usize::MAX {
            last.drain(..).try_for_each(|entry| printer.print(&entry))?;
        }
    }
    if let Some(component) = arguments.components.iter().find(|name| !names.contains(*name)) {
        let advice = advise_similar(component, names.iter().map(String::as_str));
        bail!("{shown} has no line of {component}{advice}");
    }
    last.iter().try_for_each(|entry| printer.print(entry))
}
