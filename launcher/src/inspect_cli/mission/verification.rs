//! `armor mission journal verify`: whether a journal is as it was written.

use std::path::Path;

use anyhow::{Result, bail};
use armor_executive::JournalRecord;
use armor_executive::journal::{self, JournalFault, JournalVerification};
use serde_json::json;

use super::journal::{JOURNAL, time};
use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{end_printing, print_line};

/// Prints what a journal holds and its first fault; `path` may be the folder of a run.
///
/// # Errors
/// If it cannot be read, or was written by another version.
pub fn print(path: &Path, format: OutputFormat) -> Result<CommandEnding> {
    let path = if path.is_dir() { path.join(JOURNAL) } else { path.to_owned() };
    refuse_links(&path)?;
    let verification = journal::verify(&path)?;
    let printed = match format {
        OutputFormat::Json => print_line(describe_json(&path, &verification)),
        _ => print_line(describe(&path, &verification).trim_end()),
    };
    let ending = end_printing(printed)?;
    Ok(if verification.fault.is_some() { CommandEnding::Failed } else { ending })
}

/// A run neither reads nor writes its journal through a symbolic link, so one that is a link is not
/// in order, whatever the file that it names holds.
fn refuse_links(path: &Path) -> Result<()> {
    let mut state = path.as_os_str().to_owned();
    state.push(".state");
    for path in [path, Path::new(&state)] {
        if let Ok(target) = std::fs::read_link(path) {
            let (link, target) = (path.display(), target.display());
            bail!(
                "{link} is a symbolic link to {target}, and `armor run` uses no journal through a \
                 link: verify {target} itself, or put the file in place of the link"
            );
        }
    }
    Ok(())
}

/// The number of records in the file, clocks of executives included.
fn count_records(verification: &JournalVerification) -> u64 {
    match verification.first {
        0 => 0,
        first => verification.end.number - first + 1,
    }
}

fn bounds(verification: &JournalVerification) -> Option<(&JournalRecord, &JournalRecord)> {
    verification.story.records.first().zip(verification.story.records.last())
}

fn describe(path: &Path, verification: &JournalVerification) -> String {
    let mut out = format!("journal    {}\n", path.display());
    let (first, last) = (verification.first, verification.end.number);
    let numbers = if first > 0 { format!(", {first} to {last}") } else { String::new() };
    out += &format!("records    {}{numbers}\n", count_records(verification));
    if let Some((first, last)) = bounds(verification) {
        out += &format!("time       {} to {}\n", time(first), time(last));
    }
    let committed = match verification.committed {
        Some(number) => format!("up to record {number}"),
        None => "unknown".to_owned(),
    };
    out += &format!("committed  {committed}\n");
    match &verification.fault {
        None => {
            if verification.torn_len > 0 {
                let bytes = verification.torn_len;
                out += &format!("torn       {bytes} bytes of a record that was never committed\n");
            }
            out += "fault      none\n";
        }
        Some(fault) => {
            out += &format!("fault      {fault}\n");
            out += &format!("help       {}\n", help(fault));
        }
    }
    out
}

fn describe_json(path: &Path, verification: &JournalVerification) -> serde_json::Value {
    let at_s = |record: &JournalRecord| record.at.as_secs_f64();
    let bounds = bounds(verification);
    let fault = verification.fault.as_ref().map(|fault| {
        json!({
            "kind": fault.kind(),
            "record": fault.record(),
            "line": fault.line(),
            "text": fault.to_string(),
            "help": help(fault),
        })
    });
    json!({
        "journal": path.display().to_string(),
        "records": count_records(verification),
        "first": verification.first,
        "last": verification.end.number,
        "first_at_s": bounds.map(|it| at_s(it.0)),
        "last_at_s": bounds.map(|it| at_s(it.1)),
        "committed": verification.committed,
        "torn_bytes": verification.torn_len,
        "fault": fault,
    })
}

fn help(fault: &JournalFault) -> &'static str {
    match fault {
        JournalFault::StateMissing => {
            "copy the state file (the journal's name with .state after it) together with the \
             journal; without it, `armor run FILE --resume` goes to the safe place of the mission"
        }
        _ => {
            "`armor run FILE --resume` goes to the safe place of the mission; without --resume the \
             mission begins again, and this journal is kept"
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;
    use crate::scratch::ScratchFolder;

    #[test]
    fn a_symbolic_link_is_no_journal() {
        let scratch = ScratchFolder::new("linked-journal");
        let (journal, link) = (scratch.path().join("a"), scratch.path().join(JOURNAL));
        std::fs::write(&journal, "").expect("writable");
        assert!(refuse_links(&journal).is_ok() && refuse_links(&link).is_ok());
        symlink(&journal, &link).expect("writable");
        // The folder of a run stands for its journal.
        for path in [&link, &scratch.path().to_owned()] {
            let error = print(path, OutputFormat::Text).expect_err("it is a link").to_string();
            assert!(
                error.contains("is a symbolic link to ") && error.contains("verify "),
                "{error}"
            );
        }
        symlink("elsewhere", scratch.path().join("a.state")).expect("writable");
        let error = refuse_links(&journal).expect_err("its state is a link").to_string();
        assert!(error.contains("a.state is a symbolic link to elsewhere"), "{error}");
    }
}
