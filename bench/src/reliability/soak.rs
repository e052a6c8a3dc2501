//! The soak: a fault at a fixed interval for a long time, while the needs of the processes that are
//! spared are watched.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use rustix::process::Signal;

use super::dice::FaultDice;
use super::interrupt::{rest, wait_until};
use super::options::ReliabilityOptions;
use super::processes::{read_needs, send_signal};
use super::report::FaultReport;
use super::system::{PATIENCE, SystemUnderTest};
use super::victim::FaultVictim;
use crate::readings::monotonic_ns;

/// From one look at the needs to the next.
const LOOK: Duration = Duration::from_secs(2);
/// Components that no fault hits, so that they live as long as the soak.
const SPARED: [&str; 2] = ["robot-1", "arm-1"];
/// How long a component is stopped (it is killed as hanging), and a host cut off.
const STOPPED: Duration = Duration::from_secs(3);
/// The goal for the growth of memory.
const MOST_MB_PER_H: f64 = 1.0;

/// Needs over time: seconds, memory in KiB, descriptors.
type NeedSamples = Vec<(f64, f64, f64)>;

/// Soaks, and measures.
///
/// # Errors
/// If the system does not come back.
pub fn run_soak(system: &mut SystemUnderTest, options: &ReliabilityOptions) -> Result<FaultReport> {
    let mut dice = FaultDice::new(options.seed);
    let mut report = FaultReport::default();
    let start = Instant::now();
    let victims = FaultVictim::list_all(system);
    let mut needs: BTreeMap<(String, u32), NeedSamples> = BTreeMap::new();
    let mut faults = 0;
    while start.elapsed() < options.soak {
        let next = start.elapsed() + options.interval;
        // Daemons only in the first third: then their last lives are watched for the other two.
        let has_daemons = start.elapsed() < options.soak / 3;
        let what = inflict_fault(system, &victims, has_daemons, &mut dice)?;
        faults += 1;
        let from_ns = monotonic_ns();
        let context = || format!("fault {faults}, seed {}: {what}", options.seed);
        let back_ns = system.wait_for_links(from_ns).with_context(context)?;
        let back_s = (back_ns - from_ns) as f64 / 1e9;
        report.add_time("fault over to all links back", back_s, None);
        eprintln!("{:.0} s: {what}, back after {back_s:.3} s", start.elapsed().as_secs_f64());
        while start.elapsed() < next {
            rest(LOOK.min(next.saturating_sub(start.elapsed())))?;
            system.diary.read_on()?;
            sample_needs(system, &victims, start.elapsed().as_secs_f64(), &mut needs);
        }
    }
    system.diary.read_on()?;
    report.add_count("faults", faults, None);
    report.add_account(system.diary.account);
    let from_s = options.soak.as_secs_f64() / 3.0;
    let mut growths: BTreeMap<&str, NeedGrowth> = BTreeMap::new();
    for ((name, _), samples) in &needs {
        let Some(growth) = NeedGrowth::of(samples, from_s) else { continue };
        eprintln!(
            "{name}: {:.2} MB/h, {} descriptors; KiB over time {:?}",
            growth.mb_per_h,
            growth.descriptors,
            thin_out(samples)
        );
        let kind = victims.iter().find(|it| it.name() == *name).map_or("", FaultVictim::kind);
        let all = growths.entry(kind).or_default();
        all.processes += 1;
        all.mb_per_h = all.mb_per_h.max(growth.mb_per_h);
        all.descriptors = all.descriptors.max(growth.descriptors);
    }
    for (kind, growth) in growths {
        growth.report(kind, &mut report);
    }
    Ok(report)
}

/// Does something to the system, and undoes it. Returns its name.
fn inflict_fault(
    system: &mut SystemUnderTest,
    victims: &[FaultVictim],
    has_daemons: bool,
    dice: &mut FaultDice,
) -> Result<String> {
    let is_allowed = |victim: &&FaultVictim| match victim {
        FaultVictim::Component { name, .. } => !SPARED.contains(&name.as_str()),
        FaultVictim::Daemon(_) => has_daemons,
        FaultVictim::Agent { .. } | FaultVictim::Launcher => false,
    };
    let allowed: Vec<_> = victims.iter().filter(is_allowed).cloned().collect();
    if dice.draw_below(4) == 0 {
        let host = 1 + dice.draw_below(system.options.hosts - 1);
        system.network.cut(0, host)?;
        system.network.cut(host, 0)?;
        rest(STOPPED)?;
        system.network.heal_all()?;
        return Ok("cut for 3 s".into());
    }
    let victim = dice.choose(&allowed).context("nothing to kill")?.clone();
    let pid = wait_until(PATIENCE, "the process to kill", || Ok(victim.find_process(system)))?;
    if matches!(victim, FaultVictim::Component { .. }) && dice.draw_below(3) == 0 {
        send_signal(pid, Signal::STOP)?;
        rest(STOPPED)?;
        send_signal(pid, Signal::CONT)?;
        return Ok(format!("{} stopped for 3 s", victim.name()));
    }
    send_signal(pid, Signal::KILL)?;
    let next = || Ok(victim.find_process(system).filter(|new| *new != pid));
    wait_until(PATIENCE, "its next process", next)?;
    Ok(format!("{} killed", victim.name()))
}

fn sample_needs(
    system: &SystemUnderTest,
    victims: &[FaultVictim],
    at_s: f64,
    needs: &mut BTreeMap<(String, u32), NeedSamples>,
) {
    for victim in victims {
        let Some(pid) = victim.find_process(system) else { continue };
        let Some((memory_kib, open)) = read_needs(pid) else { continue };
        needs.entry((victim.name(), pid)).or_default().push((at_s, memory_kib, open));
    }
}

/// How much the needs of one process have grown, or the most of several.
#[derive(Clone, Copy, Debug, Default)]
struct NeedGrowth {
    processes: usize,
    mb_per_h: f64,
    descriptors: f64,
}

impl NeedGrowth {
    /// That of a process, if it lived through the time that counts.
    fn of(samples: &NeedSamples, from_s: f64) -> Option<Self> {
        let later: Vec<_> = samples.iter().filter(|(at_s, ..)| *at_s >= from_s).copied().collect();
        let (first_s, last_s) = (later.first()?.0, later.last()?.0);
        if first_s > from_s + 30.0 || last_s < 2.9 * from_s {
            return None;
        }
        let memory: Vec<_> = later.iter().map(|(at_s, kib, _)| (*at_s, *kib)).collect();
        let quarter = (later.len() / 4).max(1);
        let (early, late) = (&later[..quarter], &later[later.len() - quarter..]);
        Some(Self {
            processes: 1,
            mb_per_h: find_slope(&memory) * 1024.0 * 3600.0 / 1e6,
            descriptors: find_median(late) - find_median(early),
        })
    }

    fn report(self, kind: &str, report: &mut FaultReport) {
        let of = if self.processes > 1 {
            format!("{kind}, {} processes", self.processes)
        } else {
            kind.into()
        };
        report.add_value(&format!("{of}: memory"), self.mb_per_h, "MB/h", Some(MOST_MB_PER_H));
        report.add_value(&format!("{of}: descriptors"), self.descriptors, "more", Some(0.0));
    }
}

/// The memory at a few moments, from the first to the last.
fn thin_out(samples: &NeedSamples) -> Vec<f64> {
    let step = (samples.len() / 12).max(1);
    samples.iter().step_by(step).map(|(_, memory_kib, _)| *memory_kib).collect()
}

/// The slope of the line through the points with the least squares.
fn find_slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (mean_x, mean_y) = (
        points.iter().map(|(x, _)| x).sum::<f64>() / count,
        points.iter().map(|(_, y)| y).sum::<f64>() / count,
    );
    let cross: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let square: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    if square > 0.0 { cross / square } else { 0.0 }
}

fn find_median(samples: &[(f64, f64, f64)]) -> f64 {
    let mut open: Vec<_> = samples.iter().map(|(.., open)| *open).collect();
    open.sort_by(f64::total_cmp);
    open[open.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_reported_of_what_lived_long_enough() {
        let samples = |kib_per_s: f64, from: u32| -> NeedSamples {
            (from..300).map(|s| (s.into(), 500.0 + kib_per_s * f64::from(s), 9.0)).collect()
        };
        assert!(NeedGrowth::of(&samples(9.0, 200), 100.0).is_none());
        let mut report = FaultReport::default();
        NeedGrowth::of(&samples(0.0, 0), 100.0).expect("it lived").report("flat", &mut report);
        assert!(report.meets_goals());
        NeedGrowth::of(&samples(1.0, 0), 100.0).expect("it lived").report("grows", &mut report);
        let text = report.to_markdown();
        let row = "| grows: memory | | | | 3.69 MB/h | ≤ 1 MB/h | **no** |";
        assert!(text.contains(row), "{text}");
    }
}
