//! Temporary files: their names, and the removal of those whose process was killed.

use std::fs::{self, File};
use std::path::Path;

use rustix::io::Errno;
use rustix::process::{Pid, test_kill_process};

const PREFIX: &str = ".armor-";
const SUFFIX: &str = ".new";

/// Returns what the name of a temporary file of this process begins and ends with. Between the two
/// stand random letters. The name does not contain that of the file to be replaced, which may be as
/// long as a name can be.
pub(crate) fn temporary_name() -> (String, &'static str) {
    (format!("{PREFIX}{}-", std::process::id()), SUFFIX)
}

/// Removes the temporary files that killed processes have left in `folder`. What cannot be read or
/// removed stays: the save at hand does not need it.
pub(crate) fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let Some(writer) = entry.file_name().to_str().and_then(parse_writer) else { continue };
        if !is_running(writer) && is_unlocked(&entry.path()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Returns the process that a temporary file belongs to; `None` for any other file.
fn parse_writer(name: &str) -> Option<Pid> {
    let (pid, _) = name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?.split_once('-')?;
    Pid::from_raw(pid.parse().ok().filter(|pid| *pid > 0)?)
}

/// Returns whether a process of that number exists on this host. It may be another one that has
/// been given the number since: then its number protects the leftover until it ends.
fn is_running(writer: Pid) -> bool {
    test_kill_process(writer) != Err(Errno::SRCH)
}

/// Returns whether no process holds the lock of a temporary file. The number alone does not prove
/// that the writer has ended: in a folder that containers or hosts share, it may run where this
/// process cannot see it.
fn is_unlocked(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_temporary_files_have_a_writer() {
        let (prefix, suffix) = temporary_name();
        let own = format!("{prefix}a1B2c3{suffix}");
        assert_eq!(parse_writer(&own), Pid::from_raw(std::process::id().cast_signed()));
        assert_eq!(parse_writer(".armor-71-x.new"), Pid::from_raw(71));
        for other in [".armor-x.new", ".armor-0-x.new", ".armor--5-x.new", ".armor-7-x", "a.xml"] {
            assert_eq!(parse_writer(other), None, "{other}");
        }
    }
}
