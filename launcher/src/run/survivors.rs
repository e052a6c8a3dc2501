//! Processes that a component has started and that have left its process group (`setsid`), found by
//! the variable that every process of a run inherits.

use std::fs;
use std::time::Duration;

use rustix::process::{Pid, Signal, getpid, kill_process};

/// The variable that names the run and the process in it: `MARK/NAME/`.
pub const VARIABLE: &str = "ARMOR_PROCESS";
/// Most searches: a process that starts others while it is being killed is found again.
const MAX_SEARCHES: u32 = 20;
/// Rest between two searches, in which a killed process ends.
const REST: Duration = Duration::from_millis(10);

/// Kills every process whose variable begins with `mark`, and returns their number.
pub fn kill_survivors(mark: &str) -> usize {
    let mut killed = Vec::new();
    let mut has_found = true;
    for _ in 0..MAX_SEARCHES {
        let found = find_survivors(mark);
        // Twice in a row: the variables of a process that begins a program at this moment cannot be
        // read.
        if found.is_empty() && !has_found {
            break;
        }
        has_found = !found.is_empty();
        for pid in found {
            // It may have ended in this moment.
            let _ = kill_process(pid, Signal::KILL);
            if !killed.contains(&pid) {
                killed.push(pid);
            }
        }
        std::thread::sleep(REST);
    }
    killed.len()
}

/// Returns the mark of a process, if it has one and belongs to this user.
pub fn read_mark(pid: u32) -> Option<String> {
    let variables = fs::read(format!("/proc/{pid}/environ")).ok()?;
    let prefix = format!("{VARIABLE}=");
    let mut variables = variables.split(|byte| *byte == 0);
    let mark = variables.find_map(|variable| variable.strip_prefix(prefix.as_bytes()))?;
    String::from_utf8(mark.to_vec()).ok()
}

/// Only processes of this user can be read, and a process that has ended has no variables.
fn find_survivors(mark: &str) -> Vec<Pid> {
    let wanted = format!("{VARIABLE}={mark}");
    let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let is_marked = |pid: &i32| {
        let variables = fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
        variables.split(|byte| *byte == 0).any(|it| it.starts_with(wanted.as_bytes()))
    };
    pids.filter(is_marked).filter_map(Pid::from_raw).filter(|pid| *pid != getpid()).collect()
}

#[cfg(test)]
mod tests {
    use std::process::Command;
    use std::time::Instant;

    use super::*;

    #[test]
    fn only_processes_with_the_mark_are_killed() {
        let mark = format!("test-{:016x}/", armor_socket::random_id());
        let mut others = ["laser", "slam"].map(|name| {
            let mut command = Command::new("sleep");
            command.arg("600").env(VARIABLE, format!("{mark}{name}/"));
            command.spawn().expect("sleep runs")
        });
        // The variables of a process that begins a program at this moment cannot be read.
        let end = Instant::now() + Duration::from_secs(30);
        for (other, name) in others.iter().zip(["laser", "slam"]) {
            while read_mark(other.id()) != Some(format!("{mark}{name}/")) {
                assert!(Instant::now() < end, "{:?}", read_mark(other.id()));
                std::thread::sleep(REST);
            }
        }
        assert_eq!(kill_survivors(&format!("{mark}laser/")), 1);
        assert!(!others[0].wait().expect("it is ours").success());
        assert_eq!(others[1].try_wait().expect("it is ours"), None);
        assert_eq!(kill_survivors(&mark), 1);
        assert!(!others[1].wait().expect("it is ours").success());
        assert_eq!(kill_survivors(&mark), 0);
    }
}
