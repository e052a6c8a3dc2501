//! Shared memory under faults: what a subscriber that stands still, is killed or is slow costs the
//! publisher and the other subscribers; and kills of either end at any moment.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rustix::process::{Pid, Signal, kill_process};

use crate::bench::{Bench, FIRST_CORE};
use crate::job::MIB;
use crate::machine::{Load, describe_machine};
use crate::options::BenchOptions;
use crate::process::{RoleLine, RoleProcess};
use crate::reliability::dice::FaultDice;
use crate::reliability::report::{FaultReport, TimeGoal};

const PATIENCE: Duration = Duration::from_secs(20);
/// Time for what was measured before to be over.
const SETTLE: Duration = Duration::from_secs(1);
/// The rate of the faults' publisher, and its subscribers.
const RATE_HZ: u32 = 1000;
const READERS: usize = 8;
/// What the slow subscriber takes for a message, and the one that is stopped while it has one.
const SLOW: &str = "20ms";
const HOLDING: &str = "1ms";
/// Slots for a link that keeps 8: in its ring, in the inbox, in the code and on the way; of one with
/// `latest` 1, 1, 1 and 1. Two more are the publisher's own.
const MOST_SLOTS: u64 = 6 * (8 + 8 + 2) + 2 * 4 + 2;
/// Slots of an output whose subscribers hold nothing: spare ones, and those of the messages that are
/// just on their way.
const SLOTS_AT_REST: u64 = 12;
/// Messages while processes are killed: as many as fit, so that a kill meets every step.
const KILLS_RATE_HZ: u32 = 2000;
const KILLS_LEN: usize = 256 << 10;

/// What is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryJob {
    /// One subscriber is stopped, one killed, one slow.
    Faults,
    /// Publisher and subscribers are killed.
    Kills,
}

impl MemoryJob {
    /// The job of this name for `--only`.
    pub fn from_part(part: &str) -> Option<Self> {
        match part {
            "memory-faults" => Some(Self::Faults),
            "memory-kills" => Some(Self::Kills),
            _ => None,
        }
    }

    /// Does it and prints the table.
    ///
    /// # Errors
    /// If a process does not come back, or a goal is missed.
    pub fn run(self, options: &BenchOptions) -> Result<()> {
        let bench = Bench::new(options)?;
        let load = Load::start();
        let before = list_files();
        let mut report = match self {
            Self::Faults => measure_faults(&bench, options)?,
            Self::Kills => measure_kills(&bench, options)?,
        };
        let left: Vec<_> = list_files().difference(&before).cloned().collect();
        report.add_count("files left in /dev/shm and /tmp", left.len() as u64, Some(0));
        print!("{}", report.to_markdown());
        println!(
            "\nLoad of everything else {:.0} %. {}.",
            load.foreign_percent(),
            describe_machine()
        );
        if report.meets_goals() { Ok(()) } else { bail!("not every goal is met ({left:?})") }
    }
}

fn start_publisher(bench: &Bench, len: usize, rate_hz: u32) -> Result<RoleProcess> {
    let settings = ["--set".into(), format!("len={len}"), "--rate".into(), format!("{rate_hz}Hz")];
    bench.start_component(FIRST_CORE, "numbered-publisher", "numbered", &settings)
}

fn start_reader(bench: &Bench, name: &str, how: &str, hold: &str) -> Result<RoleProcess> {
    let mut settings = bench.link_arguments("data", "numbered.data", how).to_vec();
    settings.extend(["--set".into(), format!("hold={hold}")]);
    bench.start_component(bench.other_core(), "numbered-reader", name, &settings)
}

fn measure_faults(bench: &Bench, options: &BenchOptions) -> Result<FaultReport> {
    let mut report = FaultReport::default();
    let publisher = start_publisher(bench, MIB, RATE_HZ)?;
    let mut readers = Vec::new();
    for index in 0..READERS {
        let (how, hold) = match index {
            0 => (",keep=latest", HOLDING),
            1 => (",keep=latest", "0s"),
            _ => (",keep=8", "0s"),
        };
        readers.push(start_reader(bench, &format!("reader{index}"), how, hold)?);
    }
    for reader in &readers {
        reader.wait_for_line("linked", PATIENCE)?;
    }
    std::thread::sleep(SETTLE);
    let window = options.window.max(Duration::from_secs(5));
    let idle = measure_ticks(&publisher, window)?;
    let before: Vec<_> = readers[3..].iter().map(read_counts).collect::<Result<_>>()?;
    // The first is stopped with a message in its code, the second is killed, the third becomes slow.
    kill_process(pid_of(&readers[0])?, Signal::STOP)?;
    drop(readers.remove(1));
    let slow = start_reader(bench, "slow", ",keep=latest", SLOW)?;
    slow.wait_for_line("linked", PATIENCE)?;
    let disturbed = measure_ticks(&publisher, window)?;
    let slots = count_slots(&publisher)?;
    for (reader, before) in readers[2..].iter().zip(&before) {
        let after = read_counts(reader)?;
        let count = |name: &str| (after[name] - before[name]) as u64;
        report.add_count("received by the other subscribers", count("received"), None);
        report.add_count("lost by the other subscribers", count("lost"), Some(0));
        report.add_count("messages not whole", count("torn"), Some(0));
        report.add_count("messages not new", count("stale"), Some(0));
    }
    report.add_count("slots", slots, Some(MOST_SLOTS));
    for (name, ticks) in [("all well", &idle), ("with the faults", &disturbed)] {
        report.add_value(&format!("ticks, {name}: p99.9"), ticks.interval_ms, "ms", None);
        report.add_value(&format!("`send_data`, {name}: p99.9"), ticks.send_ms, "ms", None);
    }
    let later = (disturbed.interval_ms - idle.interval_ms).max(0.0);
    report.add_value("ticks later than without faults, p99.9", later, "ms", Some(0.2));
    // They held slots until now.
    drop(slow);
    kill_process(pid_of(&readers[0])?, Signal::CONT)?;
    std::thread::sleep(SETTLE);
    report.add_count("slots 1 s after they went", count_slots(&publisher)?, Some(SLOTS_AT_REST));
    Ok(report)
}

struct TickFigures {
    interval_ms: f64,
    send_ms: f64,
}

/// Collects the ticks of some time.
fn measure_ticks(publisher: &RoleProcess, window: Duration) -> Result<TickFigures> {
    while publisher.next_line("tick").is_some() {}
    let (mut intervals, mut sends) = (Vec::new(), Vec::new());
    let end = Instant::now() + window;
    while Instant::now() < end {
        let tick = publisher.wait_for_line("tick", PATIENCE)?;
        intervals.push(tick["interval_us"] / 1e3);
        sends.push(tick["send_us"] / 1e3);
    }
    let p999 = |mut samples: Vec<f64>| {
        samples.sort_by(f64::total_cmp);
        samples[((samples.len() - 1) as f64 * 0.999).round() as usize]
    };
    Ok(TickFigures { interval_ms: p999(intervals), send_ms: p999(sends) })
}

/// What a reader has counted so far, at most a quarter of a second old.
fn read_counts(reader: &RoleProcess) -> Result<RoleLine> {
    while reader.next_line("seen").is_some() {}
    reader.wait_for_line("seen", PATIENCE)
}

fn measure_kills(bench: &Bench, options: &BenchOptions) -> Result<FaultReport> {
    let (mut report, mut dice) = (FaultReport::default(), FaultDice::new(options.reliability.seed));
    let mut publisher = start_publisher(bench, KILLS_LEN, KILLS_RATE_HZ)?;
    let start = |name: &str| start_reader(bench, name, ",keep=all,patience=5s", "0s");
    let mut readers = vec![start("first")?, start("second")?];
    for reader in &readers {
        reader.wait_for_line("linked", PATIENCE)?;
    }
    for kill in 0..options.reliability.kills {
        // From within one step to several messages.
        std::thread::sleep(Duration::from_secs_f64(dice.draw_between(1e-5, 2e-2)));
        let victim = dice.draw_below(3);
        let mut torn_before = 0.0;
        if victim == 2 {
            drop(publisher);
            publisher = start_publisher(bench, KILLS_LEN, KILLS_RATE_HZ)?;
        } else {
            if let Some(seen) = last_counts(&readers[victim]) {
                torn_before = seen["torn"] + seen["stale"];
            }
            // The old process must be gone before the new one takes its name.
            drop(readers.remove(victim));
            readers.insert(victim, start(["first", "second"][victim])?);
        }
        for (index, reader) in readers.iter().enumerate() {
            if victim != 2 && victim != index {
                continue;
            }
            let linked = reader.wait_for_line("linked", PATIENCE);
            let linked = linked.with_context(|| format!("kill {kill}, reader {index}"))?;
            let started = if victim == 2 { publisher.started_ns } else { reader.started_ns };
            let back_s = (linked["at_ns"] - started as f64) / 1e9;
            report.add_time("from start to data", back_s, Some(TimeGoal::P99(1.0)));
        }
        for reader in &readers {
            let seen = last_counts(reader);
            let bad = seen.map_or(0.0, |seen| seen["torn"] + seen["stale"]);
            report.add_count("messages not whole or not new", (bad + torn_before) as u64, Some(0));
        }
        report.add_count("kills", 1, None);
    }
    std::thread::sleep(SETTLE);
    let slots = count_slots(&publisher)?;
    report.add_count("slots in the end", slots, Some(2 * (8 + 8 + 2) + 2));
    for reader in &readers {
        let kept = count_mappings(pid_of(reader)?)?;
        report.add_count("slots mapped by the subscribers in the end", kept, Some(2 * 40));
        let seen = read_counts(reader)?;
        report.add_count("received by the last two subscribers", seen["received"] as u64, None);
    }
    Ok(report)
}

/// The newest line of what a reader has counted, if it has printed one.
fn last_counts(reader: &RoleProcess) -> Option<RoleLine> {
    std::iter::from_fn(|| reader.next_line("seen")).last()
}

fn pid_of(process: &RoleProcess) -> Result<Pid> {
    Pid::from_raw(process.pid() as i32).context("no process")
}

/// The slots that a publisher has: files in memory that it holds open. Each link has one more, its
/// page, of a few KiB.
fn count_slots(publisher: &RoleProcess) -> Result<u64> {
    let mut slots = 0;
    for entry in std::fs::read_dir(format!("/proc/{}/fd", publisher.pid()))? {
        let path = entry?.path();
        let name = std::fs::read_link(&path).unwrap_or_default();
        slots += u64::from(name.to_string_lossy().contains("armor-slot"));
    }
    Ok(slots)
}

/// Slots that a process has mapped.
fn count_mappings(pid: Pid) -> Result<u64> {
    let maps = std::fs::read_to_string(format!("/proc/{}/maps", pid.as_raw_nonzero()))?;
    Ok(maps.lines().filter(|line| line.contains("armor-slot")).count() as u64)
}

/// Names in the folders where other programs leave shared memory.
fn list_files() -> BTreeSet<OsString> {
    let folders = ["/dev/shm", "/tmp"].into_iter().filter_map(|dir| std::fs::read_dir(dir).ok());
    let names = folders.flatten().filter_map(|entry| Some(entry.ok()?.file_name()));
    // Programs that run meanwhile have files of their own; ours would bear this name.
    names.filter(|name| name.to_string_lossy().contains("armor")).collect()
}
