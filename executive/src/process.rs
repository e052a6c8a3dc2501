//! A process of this host: whether it still lives, for certain, and its end.

use rustix::process::{Pid, Signal, kill_process};

/// One process start, distinguished from any later one with the same number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ProcessStart {
    pid: i32,
    started: u64,
}

impl ProcessStart {
    /// The process that has this number now, if there is one.
    pub(crate) fn find(pid: u32) -> Option<Self> {
        let pid = i32::try_from(pid).ok()?;
        Some(Self { pid, started: start_of(pid)? })
    }

    /// Whether it has not ended. One that only waits to be reaped has.
    pub(crate) fn lives(self) -> bool {
        start_of(self.pid) == Some(self.started)
    }

    /// Ends it, whether it wants or not.
    pub(crate) fn kill(self) {
        if self.lives()
            && let Some(pid) = Pid::from_raw(self.pid)
            && let Err(error) = kill_process(pid, Signal::KILL)
        {
            tracing::warn!(pid = self.pid, "cannot be killed: {error}");
        }
    }
}

/// When a process started, in clock ticks since the start of the machine, if it has not ended.
fn start_of(pid: i32) -> Option<u64> {
    alive_since(&std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?)
}

/// The same from the text of its `stat`: proc(5), fields 3, 20 and 22.
fn alive_since(stat: &str) -> Option<u64> {
    // The name before may hold anything, spaces and brackets too.
    let mut fields = stat[stat.rfind(')')? + 1..].split_ascii_whitespace();
    let state = fields.next()?;
    let threads: u64 = fields.nth(16)?.parse().ok()?;
    // The first thread may have ended while others still use the hardware.
    if matches!(state, "Z" | "X" | "x") && threads <= 1 {
        return None;
    }
    fields.nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_lives_as_long_as_any_of_its_threads() {
        let stat = |state: &str, threads: u64| {
            let stat =
                format!("7 (a) b) {state} 1 7 7 0 -1 4 0 0 0 0 0 0 0 0 20 0 {threads} 0 4711 0");
            alive_since(&stat)
        };
        assert_eq!(stat("S", 1), Some(4711));
        assert_eq!(stat("Z", 1), None);
        assert_eq!(stat("Z", 2), Some(4711), "its first thread has ended, another has not");
    }

    #[test]
    fn a_killed_process_no_longer_lives_even_before_it_is_reaped() {
        let mut child = std::process::Command::new("sleep").arg("100").spawn().unwrap();
        let process = ProcessStart::find(child.id()).unwrap();
        assert!(process.lives());
        process.kill();
        let deadline = std::time::Instant::now() + std::time::Duration::from_secs(10);
        while process.lives() {
            assert!(std::time::Instant::now() < deadline, "it lives on");
            std::thread::yield_now();
        }
        child.wait().unwrap();
        assert!(!process.lives());
        assert_eq!(ProcessStart::find(u32::MAX), None);
    }
}
