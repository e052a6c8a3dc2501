//! What is known of a run on this host from its record, its log and its launcher, without the
//! component of the screen.

use std::path::Path;

use armor_inspect::run_control::{AbsentState, ComponentHistory, RunRequest, request};
use armor_inspect::systems::{RunRecord, list_running, record_directory};

/// What is known of a run on this host without its component.
#[derive(Clone)]
pub(super) struct WatchedRun {
    pub(super) system: String,
    pub(super) component: String,
    /// The launcher's process; 0 if it is on another host.
    pub(super) launcher: u32,
    pub(super) log: String,
    /// Length of the log at the beginning of the connection: what is before is of the past.
    pub(super) log_begin: u64,
}

impl WatchedRun {
    /// Returns the record of the run. Its launcher holds a lock on it as long as it runs.
    pub(super) fn find_record(&self) -> Option<RunRecord> {
        let records = record_directory().and_then(|directory| list_running(&directory)).ok()?;
        records.into_iter().find(|record| record.pid == self.launcher)
    }

    /// Returns whether the launcher has not been seen to end: records that cannot be read prove
    /// nothing.
    pub(super) fn is_running(&self) -> bool {
        let records = record_directory().and_then(|directory| list_running(&directory));
        records.map_or(true, |records| records.iter().any(|record| record.pid == self.launcher))
    }

    pub(super) fn read_log(&self) -> String {
        let log = std::fs::read(&self.log).unwrap_or_default();
        // A shorter one is new: logs are renamed when they are long.
        let begin = usize::try_from(self.log_begin).unwrap_or(usize::MAX);
        String::from_utf8_lossy(log.get(begin..).unwrap_or(&log)).into_owned()
    }

    /// Returns the processes of the run: each has a log.
    pub(super) fn list_processes(&self) -> Vec<String> {
        let folder = Path::new(&self.log).parent().map(std::fs::read_dir);
        let files = folder.into_iter().flatten().flatten().filter_map(Result::ok);
        let names = files.filter_map(|file| {
            let name = file.file_name().into_string().ok()?;
            Some(name.strip_suffix(".log")?.to_owned())
        });
        names.filter(|name| name != "launcher").collect()
    }

    /// Returns what an operator has to do so that the component returns.
    pub(super) fn find_hint(&self) -> Option<String> {
        let history = find_history(&self.find_record()?, &self.component)?;
        let component = &self.component;
        match history.state? {
            AbsentState::Starting => None,
            state => {
                Some(format!("{component} is {state}; `armor restart {component}` starts it again"))
            }
        }
    }
}

/// Returns what the launcher knows of the ends and starts of a component.
pub(super) fn find_history(record: &RunRecord, component: &str) -> Option<ComponentHistory> {
    request(record, &RunRequest::History { component: component.into() }).ok()?.history
}

/// Returns whether a process has ended as it should not, by the launcher's words.
pub(super) fn is_crash(last_end: &str) -> bool {
    let is_final = last_end.contains("it is not started again") && !last_end.contains("code 0");
    is_final || ["it starts again", "it is given up"].iter().any(|text| last_end.contains(text))
}

/// Returns the length of a file, 0 of one that cannot be read.
pub(super) fn file_len(path: &str) -> u64 {
    std::fs::metadata(path).map_or(0, |file| file.len())
}
