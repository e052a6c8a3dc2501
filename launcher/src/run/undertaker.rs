//! `armor undertaker`: outlives a killed launcher for a moment, to kill what the guard cannot
//! reach: processes that an executable of somebody else has started in its group.
//!
//! It hears of every group on stdin (`+PID`, `-PID`) and acts when stdin ends, which the kernel sees
//! to whatever happens to the launcher.

use std::collections::BTreeSet;
use std::io::{BufRead, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitCode, Stdio};

use anyhow::{Context, Result};
use rustix::process::{Pid, Signal, kill_process_group};

use super::process::{Group, own_program};

/// The process itself.
pub fn run() -> ExitCode {
    for pid in groups_left(std::io::stdin().lock()) {
        if let Some(pid) = Pid::from_raw(pid) {
            let _ = kill_process_group(pid, Signal::KILL);
        }
    }
    ExitCode::SUCCESS
}

/// The groups named and not taken back when the lines end.
fn groups_left(lines: impl BufRead) -> BTreeSet<i32> {
    let mut groups = BTreeSet::new();
    for line in lines.lines().map_while(std::io::Result::ok) {
        let (sign, pid) = line.split_at(line.len().min(1));
        match (sign, pid.parse()) {
            // 0 and 1 would mean the own group and everybody.
            ("+", Ok(pid)) if pid > 1 => groups.insert(pid),
            ("-", Ok(pid)) => groups.remove(&pid),
            _ => false,
        };
    }
    groups
}

/// The launcher's end of it.
#[derive(Debug)]
pub struct Undertaker(Child);

impl Undertaker {
    /// Starts it, out of reach of the terminal's Ctrl-C.
    ///
    /// # Errors
    /// If no process can be started.
    pub fn start() -> Result<Self> {
        let child = Command::new(own_program())
            .arg("undertaker")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .process_group(0)
            .spawn()
            .context("a process cannot be started")?;
        Ok(Self(child))
    }

    /// Tells it of a group.
    pub fn began(&mut self, group: Group) {
        self.tell('+', group);
    }

    /// Tells it that a group is no more.
    pub fn ended(&mut self, group: Group) {
        self.tell('-', group);
    }

    /// Ends it; nothing is left for it to do.
    pub fn dismiss(mut self) {
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }

    fn tell(&mut self, sign: char, group: Group) {
        if let Some(stdin) = &mut self.0.stdin {
            // Without it the guard still kills every process that the launcher started.
            let _ = writeln!(stdin, "{sign}{}", group.pid());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_groups_that_are_left_are_killed_and_never_everybody() {
        let left = groups_left("+12\n+13\n-12\n+0\n+1\n+-1\nx\n\n+14".as_bytes());
        assert_eq!(left, BTreeSet::from([13, 14]));
    }
}
