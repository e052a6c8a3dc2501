//! What a process of this host uses, from `/proc`.

use std::collections::HashMap;
use std::time::Instant;

use crate::run::process_stat::split_fields;

/// The kernel reports times to programs in hundredths of a second, whatever it counts in (time(7)).
const TICKS_PER_S: f64 = 100.0;

/// What a process uses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProcessUsage {
    /// None at the first look.
    pub cpu_percent: Option<f64>,
    pub memory_bytes: Option<u64>,
    pub threads: Option<u64>,
}

/// The processor time of each process at the last look.
#[derive(Debug, Default)]
pub struct UsageTable {
    looks: HashMap<u32, CpuLook>,
}

#[derive(Clone, Copy, Debug)]
struct CpuLook {
    cpu_s: f64,
    at: Instant,
    percent: Option<f64>,
}

impl UsageTable {
    /// Reads what a process uses now.
    pub fn look(&mut self, pid: u32) -> ProcessUsage {
        let read = |file: &str| std::fs::read_to_string(format!("/proc/{pid}/{file}"));
        let (Ok(stat), Ok(status)) = (read("stat"), read("status")) else {
            self.looks.remove(&pid);
            return ProcessUsage::default();
        };
        let now = Instant::now();
        let cpu_percent = parse_cpu_s(&stat).and_then(|cpu_s| {
            let before = self.looks.get(&pid).copied();
            let percent = before.and_then(|before| {
                let passed_s = now.duration_since(before.at).as_secs_f64();
                // A shorter time than this is a few ticks of the kernel.
                match passed_s >= 0.4 {
                    true => Some((cpu_s - before.cpu_s).max(0.0) / passed_s * 100.0),
                    false => before.percent,
                }
            });
            let is_same =
                before.is_some_and(|before| now.duration_since(before.at).as_secs_f64() < 0.4);
            if !is_same {
                self.looks.insert(pid, CpuLook { cpu_s, at: now, percent });
            }
            percent
        });
        ProcessUsage {
            cpu_percent,
            memory_bytes: parse_field(&status, "VmRSS").map(|kib| kib * 1024),
            threads: parse_field(&status, "Threads"),
        }
    }

    /// Forgets all processes but these.
    pub fn keep(&mut self, is_kept: impl Fn(u32) -> bool) {
        self.looks.retain(|pid, _| is_kept(*pid));
    }
}

/// The processor time in `/proc/PID/stat`, in seconds.
fn parse_cpu_s(stat: &str) -> Option<f64> {
    let fields: Vec<&str> = split_fields(stat)?.collect();
    // utime and stime, fields 14 and 15 of proc(5).
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS_PER_S)
}

/// A number in `/proc/PID/status`.
fn parse_field(status: &str, name: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_proc_are_read() {
        let stat = "4711 (a ) b) S 1 4711 4711 0 -1 4194560 1 0 0 0 150 50 0 0 20 0 5 0 9 1 2";
        assert_eq!(parse_cpu_s(stat), Some(2.0));
        assert_eq!(parse_cpu_s("4711 (a"), None);
        let status = "Name:\tarmor\nVmRSS:\t  12 kB\nThreads:\t5\n";
        assert_eq!(
            (parse_field(status, "VmRSS"), parse_field(status, "Threads")),
            (Some(12), Some(5))
        );
        assert_eq!(parse_field(status, "Vm"), None);
    }

    #[test]
    fn this_process_uses_memory_and_one_that_does_not_exist_nothing() {
        let mut table = UsageTable::default();
        let own = table.look(std::process::id());
        assert!(own.memory_bytes > Some(0) && own.threads > Some(0), "{own:?}");
        assert_eq!(own.cpu_percent, None, "a rate needs two looks");
        // No process has this number: it is above the largest that the kernel gives.
        assert_eq!(table.look(u32::MAX), ProcessUsage::default());
    }
}
