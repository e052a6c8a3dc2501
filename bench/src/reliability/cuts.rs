//! Cuts: what one host sends to the others, or they to it, or both, is dropped for a time. Both ends
//! must notice, the base must come to rest, and all links must come back.

use std::fmt;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};

use super::dice::FaultDice;
use super::interrupt::{rest, wait_until};
use super::log_times::find_moments;
use super::network::HOSTS;
use super::options::ReliabilityOptions;
use super::report::{FaultReport, TimeGoal};
use super::system::{PATIENCE, SystemUnderTest};
use crate::readings::monotonic_ns;

/// Shortest cut, in seconds.
const SHORTEST_S: f64 = 1.0;
/// A cut that lasts longer must be noticed.
const NOTICED_WITHIN_S: f64 = 2.0;
/// The base's timeout, the period of its commands, that of its own steps, and the time that it brakes.
const REST_WITHIN_S: f64 = 0.5 + 0.05 + 0.02 + 0.02;
/// How long everything runs before the next cut, at least: links that lasted 2 s count as good.
const HEALTHY_S: (f64, f64) = (2.5, 5.0);

/// What is dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CutKind {
    Both,
    /// What the host should receive.
    Towards,
    /// What the host sends.
    From,
}

impl fmt::Display for CutKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Both => "both ways",
            Self::Towards => "towards it",
            Self::From => "from it",
        })
    }
}

/// Cuts, and measures.
///
/// # Errors
/// If the system does not come back.
pub fn run_cuts(system: &mut SystemUnderTest, options: &ReliabilityOptions) -> Result<FaultReport> {
    let mut report = FaultReport::default();
    let mut dice = FaultDice::new(options.seed);
    for cut in 1..=options.count {
        rest(Duration::from_secs_f64(dice.draw_between(HEALTHY_S.0, HEALTHY_S.1)))?;
        let host = 1 + dice.draw_below(system.options.hosts - 1);
        let kind = [CutKind::Both, CutKind::Towards, CutKind::From][dice.draw_below(3)];
        let length_s = dice.draw_between(SHORTEST_S, options.longest.as_secs_f64());
        let what = || format!("cut {cut}, seed {}: {kind} of {}", options.seed, HOSTS[host]);
        eprintln!("{cut}/{} {kind} of {} for {length_s:.2} s", options.count, HOSTS[host]);
        measure_cut(system, host, kind, length_s, &mut report).with_context(what)?;
    }
    system.diary.read_on()?;
    report.add_account(system.diary.account);
    Ok(report)
}

fn measure_cut(
    system: &mut SystemUnderTest,
    host: usize,
    kind: CutKind,
    length_s: f64,
    report: &mut FaultReport,
) -> Result<()> {
    let cut = Instants::now();
    for other in (0..system.options.hosts).filter(|other| *other != host) {
        if kind != CutKind::From {
            system.network.cut(other, host)?;
        }
        if kind != CutKind::Towards {
            system.network.cut(host, other)?;
        }
    }
    rest(Duration::from_secs_f64(length_s))?;
    let heal = Instants::now();
    system.network.heal_all()?;
    let back_ns = system.wait_for_links(heal.monotonic_ns)?;
    let back_s = (back_ns - heal.monotonic_ns) as f64 / 1e9;
    report.add_time("healing to all links back", back_s, Some(TimeGoal::Max(1.0)));
    let connected = format!("{} is connected again", HOSTS[host]);
    let lost = format!("{} is cut off", HOSTS[host]);
    let noticed = find_moments(&system.read_logs(0), &lost, cut.wall_s);
    if let Some(first) = noticed.first() {
        let goal = Some(TimeGoal::Max(NOTICED_WITHIN_S));
        report.add_time(&format!("the launcher, {kind}: cut to noticed"), first - cut.wall_s, goal);
        let again = wait_until(PATIENCE, "the launcher to be connected again", || {
            Ok(find_moments(&system.read_logs(0), &connected, heal.wall_s).first().copied())
        })?;
        let again_s = again - heal.wall_s;
        report.add_time("healing to the launcher connected", again_s, Some(TimeGoal::Max(1.0)));
        eprintln!(
            "    noticed after {:.3} s, connected {again_s:.3} s after healing",
            first - cut.wall_s
        );
    } else if length_s > NOTICED_WITHIN_S {
        report.add_count("cuts that the launcher did not notice", 1, Some(0));
    }
    let lost = format!("{} is cut off", HOSTS[0]);
    let noticed = find_moments(&system.read_logs(host), &lost, cut.wall_s);
    if let Some(first) = noticed.first() {
        let seconds = first - cut.wall_s;
        let goal = Some(TimeGoal::Max(NOTICED_WITHIN_S));
        report.add_time(&format!("the agent, {kind}: cut to noticed"), seconds, goal);
    } else if length_s > NOTICED_WITHIN_S {
        report.add_count("cuts that the agent did not notice", 1, Some(0));
    }
    eprintln!("    links back {back_s:.3} s after healing");
    // With `From`, the commands still arrive until the sender has noticed.
    if host == 1 && kind != CutKind::From && length_s > REST_WITHIN_S {
        let rested = find_motion(system, false, cut.monotonic_ns);
        let seconds = rested.map_or(length_s, |at| (at - cut.monotonic_ns) as f64 / 1e9);
        report.add_time("cut to the base at rest", seconds, Some(TimeGoal::Max(REST_WITHIN_S)));
    }
    let moves = wait_until(PATIENCE, "the base to move again", || {
        system.diary.read_on()?;
        Ok(match system.diary.find_life("witness").and_then(|it| it.motions.last()) {
            Some((at_ns, true)) => Some(*at_ns),
            _ => None,
        })
    })?;
    if moves > heal.monotonic_ns {
        let seconds = (moves - heal.monotonic_ns) as f64 / 1e9;
        report.add_time("healing to the base in motion", seconds, None);
    }
    Ok(())
}

/// The first time that the base began to move or came to rest after a moment.
fn find_motion(system: &SystemUnderTest, moves: bool, from_ns: u64) -> Option<u64> {
    let life = system.diary.find_life("witness")?;
    let is_it = |(at_ns, own): &&(u64, bool)| *own == moves && *at_ns >= from_ns;
    life.motions.iter().find(is_it).map(|(at_ns, _)| *at_ns)
}

/// A moment on the clock of the diaries and on that of the logs.
struct Instants {
    monotonic_ns: u64,
    wall_s: f64,
}

impl Instants {
    fn now() -> Self {
        let wall = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { monotonic_ns: monotonic_ns(), wall_s: wall.as_secs_f64() }
    }
}
