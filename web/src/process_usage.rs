//! Processor time and memory of the processes on this host, as the kernel counts them.

use std::fs;

/// Ticks of processor time per second: the kernel shows this number to programs on every
/// architecture, whatever it counts in itself (time(7), `USER_HZ`).
const TICKS_PER_S: f64 = 100.0;

/// What a process has used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProcessUsage {
    /// Processor time, in seconds.
    pub(crate) cpu_s: f64,
    /// Memory in use, in bytes.
    pub(crate) memory_len: u64,
    /// Threads.
    pub(crate) threads: u64,
}

/// Returns what the process has used; `None` if it has ended.
pub(crate) fn read_usage(pid: u32) -> Option<ProcessUsage> {
    let read = |name: &str| fs::read_to_string(format!("/proc/{pid}/{name}")).ok();
    parse_usage(&read("stat")?, &read("status")?)
}

/// Reads proc_pid_stat(5), where the name in parentheses may contain anything, and
/// proc_pid_status(5).
fn parse_usage(stat: &str, status: &str) -> Option<ProcessUsage> {
    let (_, rest) = stat.rsplit_once(')')?;
    let fields: Vec<u64> = rest.split_whitespace().map(|it| it.parse().unwrap_or(0)).collect();
    // Counted from the state, which is field 3.
    let field = |number: usize| fields.get(number - 3).copied();
    let ticks = field(14)? + field(15)?;
    let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let resident_kb: u64 = resident.trim().trim_end_matches(" kB").parse().ok()?;
    Some(ProcessUsage {
        cpu_s: ticks as f64 / TICKS_PER_S,
        memory_len: resident_kb * 1024,
        threads: field(20)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_parentheses_moves_no_field() {
        let stat = "7 (a) b (c)) S 1 7 7 0 -1 4194560 1 0 0 0 250 50 0 0 20 0 3 0 9 1000 25 1 1";
        let status = "Name:\ta) b (c)\nVmRSS:\t     100 kB\nThreads:\t3\n";
        let usage = parse_usage(stat, status).unwrap();
        assert_eq!((usage.cpu_s, usage.threads), (3.0, 3));
        assert_eq!(usage.memory_len, 102_400);
        assert_eq!(parse_usage("7 (a S 1", status), None);
    }

    #[test]
    fn this_process_uses_memory() {
        let usage = read_usage(std::process::id()).unwrap();
        assert!(usage.memory_len > 100_000 && usage.threads >= 1, "{usage:?}");
    }
}
