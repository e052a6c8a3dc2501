//! Stops: every process of every host stands still for a time, as when the computers are suspended, and
//! continues. The system must come back as it was, without spinning.

use std::time::Duration;

use anyhow::{Context, Result};
use rustix::process::Signal;

use super::dice::FaultDice;
use super::interrupt::{rest, wait_until};
use super::options::ReliabilityOptions;
use super::processes::{read_cpu_s, send_signal};
use super::report::{FaultReport, TimeGoal};
use super::system::{PATIENCE, SystemUnderTest};
use crate::readings::monotonic_ns;

/// Shortest stop, in seconds.
const SHORTEST_S: f64 = 1.0;
/// How long the processor time is measured, before and after.
const WINDOW: Duration = Duration::from_secs(4);
/// The marking of the mission, which nothing changes.
const MARKING: &str = "left-works 1";
/// What the processes may take afterwards: processes that were killed while they stood still start
/// again, but nothing spins, which would take a whole core.
const MOST_TIMES_CPU: f64 = 3.0;

/// Stops everything, and measures.
///
/// # Errors
/// If the system does not come back.
pub fn run_stops(
    system: &mut SystemUnderTest,
    options: &ReliabilityOptions,
) -> Result<FaultReport> {
    let mut report = FaultReport::default();
    let mut dice = FaultDice::new(options.seed);
    let mut most_times = 0.0_f64;
    for stop in 1..=options.count {
        let before = measure_cpu(system)?;
        let length_s = dice.draw_between(SHORTEST_S, options.longest.as_secs_f64());
        let all = system.network.list_processes();
        for pid in &all {
            send_signal(*pid, Signal::STOP)?;
        }
        rest(Duration::from_secs_f64(length_s))?;
        let from_ns = monotonic_ns();
        for pid in &all {
            send_signal(*pid, Signal::CONT)?;
        }
        let what = || format!("stop {stop}, seed {}", options.seed);
        let back_ns = system.wait_for_links(from_ns).with_context(what)?;
        let back_s = back_ns.saturating_sub(from_ns) as f64 / 1e9;
        wait_until(PATIENCE, "the marking", || {
            Ok((system.read_marking()?.as_deref() == Some(MARKING)).then_some(()))
        })
        .with_context(what)?;
        let after = measure_cpu(system)?;
        let left = system.network.list_processes();
        let killed = all.iter().filter(|pid| !left.contains(pid)).count();
        eprintln!(
            "{stop}/{} for {length_s:.1} s: back after {back_s:.3} s, {killed} of {} killed, CPU \
             {before:.2} s, then {after:.2} s",
            options.count,
            all.len()
        );
        report.add_time("end of the stop to all back", back_s, Some(TimeGoal::P99(5.0)));
        report.add_count("stops after which the marking was the same", 1, None);
        report.add_count("processes that were stopped", all.len() as u64, None);
        report.add_count("of these, replaced afterwards", killed as u64, None);
        most_times = most_times.max(after / before);
    }
    system.diary.read_on()?;
    let name = "most processor time afterwards, of that before";
    report.add_value(name, most_times, "×", Some(MOST_TIMES_CPU));
    report.add_account(system.diary.account);
    Ok(report)
}

/// The processor time that the processes of all hosts take in a window, in seconds.
fn measure_cpu(system: &SystemUnderTest) -> Result<f64> {
    let all = system.network.list_processes();
    let before: Vec<_> = all.iter().map(|pid| (*pid, read_cpu_s(*pid))).collect();
    rest(WINDOW)?;
    let taken = before.into_iter().filter_map(|(pid, before)| Some(read_cpu_s(pid)? - before?));
    Ok(taken.sum())
}
