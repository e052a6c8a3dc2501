//! The processes of a host as the kernel lists them: those of one parent, when they started, what they
//! need.

use std::fs;

use anyhow::{Context, Result};
use rustix::process::{Pid, Signal, kill_process};
use rustix::time::{ClockId, clock_gettime};

use crate::readings::monotonic_ns;

/// The kernel counts the start of a process in these ticks per second (`USER_HZ`).
const TICKS_HZ: u64 = 100;

/// The processes that `parent` has started, with their command lines.
pub fn list_children(parent: u32) -> Vec<(u32, Vec<String>)> {
    let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
    let pids = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    let own = pids.filter(|pid| read_stat(*pid).is_some_and(|it| it[1] == parent.to_string()));
    own.map(|pid| (pid, read_command(pid))).collect()
}

fn read_command(pid: u32) -> Vec<String> {
    let text = fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    text.split('\0').map(str::to_owned).collect()
}

/// The fields after the name: state, parent, …
fn read_stat(pid: u32) -> Option<Vec<String>> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let fields: Vec<_> = text.rsplit_once(')')?.1.split_whitespace().map(str::to_owned).collect();
    (fields[0] != "Z").then_some(fields)
}

/// When a process was started, on the monotonic clock; up to 10 ms early.
pub fn find_start(pid: u32) -> Option<u64> {
    let ticks: u64 = read_stat(pid)?.get(19)?.parse().ok()?;
    let boot = clock_gettime(ClockId::Boottime);
    let boot_ns = boot.tv_sec as u64 * 1_000_000_000 + boot.tv_nsec as u64;
    // The kernel counts from the boot, with the time in which the machine was suspended.
    let suspended_ns = boot_ns.saturating_sub(monotonic_ns());
    Some((ticks * (1_000_000_000 / TICKS_HZ)).saturating_sub(suspended_ns))
}

/// The processor time that a process has taken, in seconds.
pub fn read_cpu_s(pid: u32) -> Option<f64> {
    let fields = read_stat(pid)?;
    let ticks: u64 = fields[11].parse::<u64>().ok()? + fields[12].parse::<u64>().ok()?;
    Some(ticks as f64 / TICKS_HZ as f64)
}

/// Sends a signal. A process that has ended meanwhile does not matter.
///
/// # Errors
/// If the number is not that of a process.
pub fn send_signal(pid: u32, signal: Signal) -> Result<()> {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw).context("not a process")?;
    let _ = kill_process(pid, signal);
    Ok(())
}

/// The memory that only this process has, in KiB, and its open files.
pub fn read_needs(pid: u32) -> Option<(f64, f64)> {
    let text = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let own = text.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
    let memory_kib = own.split_whitespace().next()?.parse().ok()?;
    let open = fs::read_dir(format!("/proc/{pid}/fd")).ok()?.count();
    Some((memory_kib, open as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_of_a_process_is_found_on_the_monotonic_clock() {
        let before = monotonic_ns();
        let mut child = std::process::Command::new("sleep").arg("60").spawn().expect("it starts");
        let after = monotonic_ns();
        let start = find_start(child.id()).expect("it runs");
        assert!(start + 20_000_000 >= before && start <= after, "{before} {start} {after}");
        // The kernel lets `spawn` return a little before the new command line can be read.
        let deadline = std::time::Instant::now() + std::time::Duration::from_secs(30);
        let is_listed = || {
            let own = list_children(std::process::id());
            own.iter()
                .any(|(pid, words)| *pid == child.id() && words.get(1).is_some_and(|it| it == "60"))
        };
        while !is_listed() {
            assert!(std::time::Instant::now() < deadline, "{:?}", read_command(child.id()));
            std::thread::yield_now();
        }
        send_signal(child.id(), Signal::KILL).expect("a process");
        child.wait().expect("it ends");
        assert_eq!(find_start(child.id()), None);
    }
}
