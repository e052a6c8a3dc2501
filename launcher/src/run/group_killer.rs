//! `armor group-killer`: outlives a killed launcher for a moment, to kill what the guard cannot
//! reach: processes that an executable has started itself, in its process group or out of it.
//!
//! The launcher writes every group to its stdin (`+PID` when it starts, `-PID` when it has ended).
//! When stdin ends it kills the groups that are left, and every process that carries the mark of the
//! run. The kernel closes the pipe however the
//! launcher ends.

use std::collections::BTreeSet;
use std::io::{BufRead, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitCode, Stdio};

use anyhow::{Context, Result};
use clap::Args;
use rustix::process::{Pid, Signal, kill_process_group};

use super::process::{OWN_PROGRAM, ProcessGroup, own_path};
use super::survivors::kill_survivors;
use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::verb::Verb;

/// Shortest mark: a shorter one could be that of another run.
const MIN_MARK_LEN: usize = 16;

/// Kill the process groups listed on stdin when stdin ends.
#[derive(Args, Debug)]
pub struct GroupKillerArguments {
    /// The mark of the run, in the variables of its processes.
    #[arg(long)]
    pub mark: Option<String>,
}

impl Verb for GroupKillerArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        for pid in read_remaining_groups(std::io::stdin().lock()) {
            if let Some(pid) = Pid::from_raw(pid) {
                let _ = kill_process_group(pid, Signal::KILL);
            }
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

/// The launcher's end of the pipe to a group killer.
#[derive(Debug)]
pub struct GroupKiller(Child);

impl GroupKiller {
    /// Starts the process in a group of its own, so that Ctrl-C at the terminal does not reach it.
    ///
    /// # Errors
    /// If no process can be started.
    pub fn start(mark: &str) -> Result<Self> {
        let child = Command::new(OWN_PROGRAM)
            .arg0(own_path())
            .args(["group-killer", "--mark", mark])
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0)
            .spawn()
            .context("a process cannot be started")?;
        Ok(Self(child))
    }

    /// Adds a group that has started.
    pub fn add_group(&mut self, group: ProcessGroup) {
        self.write_line('+', group);
    }

    /// Removes a group that has ended.
    pub fn remove_group(&mut self, group: ProcessGroup) {
        self.write_line('-', group);
    }

    /// Ends the process; no group is left to kill.
    pub fn dismiss(mut self) {
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }

    fn write_line(&mut self, sign: char, group: ProcessGroup) {
        if let Some(stdin) = &mut self.0.stdin {
            // Without the group killer the guard still kills every process that the launcher
            // started.
            let _ = writeln!(stdin, "{sign}{}", group.pid());
        }
    }
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
