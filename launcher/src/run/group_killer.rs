//! `armor group-killer`: outlives a killed launcher for a moment, to kill what the guard cannot
//! reach: processes that an executable has started itself, in its process group or out of it.
//!
//! The launcher writes every group to its stdin (`+PID` when it starts, `-PID` when it has ended).
//! When stdin ends it kills the groups that are left, the control group of the run, and every process
//! that carries the mark of the run. The kernel closes the pipe however the launcher ends. Two of them
//! run, each enough by itself, and the launcher replaces one that has ended.

use std::collections::BTreeSet;
use std::ffi::{CStr, OsStr};
use std::io::{BufRead, Write};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};

use anyhow::{Context, Result};
use clap::Args;
use rustix::process::{Pid, Signal, kill_process_group};

use super::control_group::{self, ControlGroup};
use super::process::{OWN_PROGRAM, ProcessGroup, own_path};
use super::survivors::kill_survivors;
use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::verb::Verb;

/// The name of the process, in place of that of the program; the kernel keeps 15 bytes.
const PROCESS_NAME: &CStr = c"group-killer";
/// Shortest mark: a shorter one could be that of another run.
const MIN_MARK_LEN: usize = 16;

/// Kill the process groups listed on stdin when stdin ends.
#[derive(Args, Debug)]
pub struct GroupKillerArguments {
    /// The mark of the run, in the variables of its processes.
    #[arg(long)]
    pub mark: Option<String>,
    /// The folder of the control group of the run.
    #[arg(long, value_name = "DIR")]
    pub control_group: Option<PathBuf>,
}

impl Verb for GroupKillerArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        // `killall -9 armor` finds processes by this name. It would end the launcher together with
        // both group killers, and leave no process that could end the rest.
        let _ = rustix::thread::set_name(PROCESS_NAME);
        for pid in read_remaining_groups(std::io::stdin().lock()) {
            if let Some(pid) = Pid::from_raw(pid) {
                let _ = kill_process_group(pid, Signal::KILL);
            }
        }
        if let Some(group) = &self.control_group {
            control_group::kill_and_remove(group);
        }
        if let Some(mark) = self.mark.filter(|mark| mark.len() >= MIN_MARK_LEN) {
            kill_survivors(&mark);
        }
        Ok(CommandEnding::Fine.into())
    }
}

/// Returns the groups that were added and not removed when the lines end.
fn read_remaining_groups(lines: impl BufRead) -> BTreeSet<i32> {
    let mut groups = BTreeSet::new();
    for line in lines.lines().map_while(std::io::Result::ok) {
        let (sign, pid) = line.split_at(line.len().min(1));
        match (sign, pid.parse()) {
            // Killing group 0 would kill our own group, and group 1 every process.
            ("+", Ok(pid)) if pid > 1 => groups.insert(pid),
            ("-", Ok(pid)) => groups.remove(&pid),
            _ => false,
        };
    }
    groups
}

/// The launcher's ends of the pipes to its group killers.
#[derive(Debug)]
pub struct GroupKillers {
    mark: String,
    control_group: Option<PathBuf>,
    groups: BTreeSet<u32>,
    processes: [Child; 2],
}

impl GroupKillers {
    /// Starts the processes for a run with this mark, and this control group if it has one.
    ///
    /// # Errors
    /// If no process can be started.
    pub fn start(mark: &str, control_group: Option<&ControlGroup>) -> Result<Self> {
        let control_group = control_group.map(|group| group.path().to_owned());
        let start = || start_one(mark, control_group.as_deref());
        let processes = [start()?, start()?];
        Ok(Self { mark: mark.into(), control_group, groups: BTreeSet::new(), processes })
    }

    /// Adds a group that has started.
    pub fn add_group(&mut self, group: ProcessGroup) {
        self.groups.insert(group.pid());
        self.write_line('+', group);
    }

    /// Removes a group that has ended.
    pub fn remove_group(&mut self, group: ProcessGroup) {
        self.groups.remove(&group.pid());
        self.write_line('-', group);
    }

    /// Replaces those that have ended, and returns their number.
    pub fn replace_ended(&mut self) -> usize {
        let mut replaced = 0;
        for process in &mut self.processes {
            if matches!(process.try_wait(), Ok(None)) {
                continue;
            }
            // If none can be started now, the next call tries it again.
            let Ok(mut new) = start_one(&self.mark, self.control_group.as_deref()) else {
                continue;
            };
            if let Some(stdin) = &mut new.stdin {
                let lines: String = self.groups.iter().map(|pid| format!("+{pid}\n")).collect();
                let _ = stdin.write_all(lines.as_bytes());
            }
            *process = new;
            replaced += 1;
        }
        replaced
    }

    /// Ends the processes; no group is left to kill.
    pub fn dismiss(mut self) {
        self.processes.iter_mut().for_each(|process| drop(process.stdin.take()));
        for process in &mut self.processes {
            let _ = process.wait();
        }
    }

    fn write_line(&mut self, sign: char, group: ProcessGroup) {
        for stdin in self.processes.iter_mut().filter_map(|process| process.stdin.as_mut()) {
            // One that has ended is replaced, and gets all groups.
            let _ = writeln!(stdin, "{sign}{}", group.pid());
        }
    }
}

/// Starts one in a group of its own, so that Ctrl-C at the terminal does not reach it.
fn start_one(mark: &str, control_group: Option<&Path>) -> Result<Child> {
    let control_group = control_group.map(|path| [OsStr::new("--control-group"), path.as_os_str()]);
    Command::new(OWN_PROGRAM)
        .arg0(own_path())
        .args(["group-killer", "--mark", mark])
        .args(control_group.into_iter().flatten())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .process_group(0)
        .spawn()
        .context("a process cannot be started")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_remaining_groups_are_killed_and_never_all_processes() {
        let left = read_remaining_groups("+12\n+13\n-12\n+0\n+1\n+-1\nx\n\n+14".as_bytes());
        assert_eq!(left, BTreeSet::from([13, 14]));
    }
}
