//! The processes of a measurement: starts them, reads what they print, kills them.

use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use rustix::process::{Signal, set_parent_process_death_signal, setpriority_process};
use rustix::thread::{CpuSet, sched_setaffinity};

use crate::figure::Contender;
use crate::readings::monotonic_ns;

/// A running role. Dropping it kills it.
pub struct RoleProcess {
    child: Child,
    lines: Receiver<String>,
    /// When it was started, on the monotonic clock.
    pub started_ns: u64,
}

/// The values of one line that a role prints: `KEY name=1 other=2.5`.
pub type RoleLine = HashMap<String, f64>;

impl RoleProcess {
    /// Starts this program again in a role on a core.
    pub fn start(core: usize, side: Contender, role: &str, arguments: &[String]) -> Result<Self> {
        Self::start_on(&core.to_string(), side, role, arguments)
    }

    /// The same with the core as text, which may be [`ANY_CORE`].
    pub fn start_on(core: &str, side: Contender, role: &str, arguments: &[String]) -> Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["role", core, &side.to_string(), role]).args(arguments);
        command.env("ARMOR_LOG", "error").stdin(Stdio::null()).stdout(Stdio::piped());
        let started_ns = monotonic_ns();
        let mut child = command.spawn()?;
        let stdout = child.stdout.take().context("no pipe")?;
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Ok(Self { child, lines, started_ns })
    }

    /// Waits for the next line that begins with `key`.
    pub fn wait_for_line(&self, key: &str, limit: Duration) -> Result<RoleLine> {
        let end = Instant::now() + limit;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let line = self.lines.recv_timeout(left).with_context(|| format!("no `{key}`"))?;
            let mut words = line.split_whitespace();
            if words.next() == Some(key) {
                let pairs = words.filter_map(|word| word.split_once('='));
                return Ok(pairs.filter_map(|(k, v)| Some((k.into(), v.parse().ok()?))).collect());
            }
        }
    }

    /// The next line that begins with `key` among those printed so far; those before it are passed
    /// over.
    pub fn next_line(&self, key: &str) -> Option<RoleLine> {
        self.wait_for_line(key, Duration::ZERO).ok()
    }

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Reads a number of `/proc/PID/status`, such as `VmRSS`.
    pub fn read_status(&self, key: &str) -> Result<f64> {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.child.id()))?;
        let line = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
        let number =
            line.and_then(|line| line.split_whitespace().next()).context("no such line")?;
        Ok(number.parse()?)
    }
}

impl Drop for RoleProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// In place of a core: a process with several threads, which may use all of them.
pub const ANY_CORE: &str = "any";

/// Pins this process to a core, if there is one to pin it to, before it has threads, and makes it end
/// with its parent.
pub fn pin_to_core(core: Option<usize>) -> Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    if let Some(core) = core {
        let mut cores = CpuSet::new();
        cores.set(core);
        sched_setaffinity(None, &cores).with_context(|| format!("there is no core {core}"))?;
    }
    // Only root may raise the priority; without it, other programs disturb more.
    let _ = setpriority_process(None, -15);
    Ok(())
}
