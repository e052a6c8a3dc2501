//! The load of other programs during a measurement, and a description of the machine.

use std::fs::read_to_string;
use std::time::{Duration, Instant};

/// Above this share of both cores, the machine is not quiet.
const QUIET_PERCENT: f64 = 6.0;
/// How long the load is watched to decide that.
const LOOK: Duration = Duration::from_millis(250);

/// Ticks of the processor: all, and those in which a program ran.
#[derive(Clone, Copy)]
struct Ticks {
    all: f64,
    busy: f64,
    /// Of this process and of its children that have ended.
    own: f64,
}

impl Ticks {
    fn read_now() -> Self {
        let stat = read_to_string("/proc/stat").unwrap_or_default();
        let numbers: Vec<f64> = stat
            .lines()
            .next()
            .unwrap_or_default()
            .split_whitespace()
            .filter_map(|word| word.parse().ok())
            .take(8)
            .collect();
        let all: f64 = numbers.iter().sum();
        let idle: f64 = numbers.iter().skip(3).take(2).sum();
        let own = read_to_string("/proc/self/stat").unwrap_or_default();
        let own = own.rsplit(')').next().unwrap_or_default();
        // After the name: state is field 0; utime, stime, cutime, cstime are 11 to 14.
        let own =
            own.split_whitespace().skip(11).take(4).filter_map(|w| w.parse::<f64>().ok()).sum();
        Self { all, busy: all - idle, own }
    }
}

/// The load since a moment.
pub struct Load(Ticks);

impl Load {
    pub fn start() -> Self {
        Self(Ticks::read_now())
    }

    /// Share of all cores that other programs have used since the start, in percent. The children
    /// of this process must have ended.
    pub fn foreign_percent(&self) -> f64 {
        let (a, b) = (self.0, Ticks::read_now());
        100.0 * ((b.busy - a.busy) - (b.own - a.own)).max(0.0) / (b.all - a.all).max(1.0)
    }
}

/// Waits until other programs are idle. Returns `false` if they are not within `limit`.
pub fn wait_until_quiet(limit: Duration) -> bool {
    let end = Instant::now() + limit;
    while !limit.is_zero() {
        let load = Load::start();
        std::thread::sleep(LOOK);
        if load.foreign_percent() < QUIET_PERCENT {
            return true;
        }
        if Instant::now() >= end {
            return false;
        }
    }
    true
}

/// Processor, cores, kernel, in one line.
pub fn describe_machine() -> String {
    let cpu = read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or_default();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let system = rustix::system::uname();
    format!(
        "{}, {cores} cores, {} {}",
        model.trim_start_matches([' ', '\t', ':']),
        system.sysname().to_string_lossy(),
        system.release().to_string_lossy()
    )
}
