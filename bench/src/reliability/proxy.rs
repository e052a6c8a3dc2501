//! A bad network between two hosts: delays, narrow and lossy connections, black holes, resets, changed
//! bytes and frames that end in the middle, by a relay through which all connections go.

use std::fmt;
use std::time::Duration;

use anyhow::{Context, Result};

use super::dice::FaultDice;
use super::interrupt::{rest, wait_until};
use super::options::ReliabilityOptions;
use super::relay::NetworkQuality;
use super::report::{FaultReport, TimeGoal};
use super::system::{PATIENCE, SystemUnderTest};
use crate::readings::monotonic_ns;

/// Shortest time of a fault that lasts, in seconds.
const SHORTEST_S: f64 = 1.0;
/// How long everything runs before the next fault.
const HEALTHY_S: (f64, f64) = (2.5, 5.0);
/// The marking of the mission, which nothing changes.
const MARKING: &str = "left-works 1";
/// A link that carries data within this time after a fault counts as back in time.
const BACK_WITHIN_S: f64 = 1.0;
/// Faults of one connection that follow each other in a round.
const HITS: usize = 5;
/// Time between two of them.
const BETWEEN_HITS: Duration = Duration::from_millis(200);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ProxyFault {
    BadNetwork,
    BlackHole,
    BlackHoleTowards,
    BlackHoleFrom,
    Reset,
    Corrupt,
    Truncate,
}

impl ProxyFault {
    const ALL: [Self; 7] = [
        Self::BadNetwork,
        Self::BlackHole,
        Self::BlackHoleTowards,
        Self::BlackHoleFrom,
        Self::Reset,
        Self::Corrupt,
        Self::Truncate,
    ];
}

impl fmt::Display for ProxyFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BadNetwork => "delay, jitter, bandwidth and loss",
            Self::BlackHole => "black hole",
            Self::BlackHoleTowards => "black hole towards the servers",
            Self::BlackHoleFrom => "black hole towards the clients",
            Self::Reset => "all connections reset",
            Self::Corrupt => "changed bits",
            Self::Truncate => "frames that end in the middle",
        })
    }
}

/// Injects faults one after the other, and measures.
///
/// # Errors
/// If the system does not come back.
pub fn run_proxy(
    system: &mut SystemUnderTest,
    options: &ReliabilityOptions,
) -> Result<FaultReport> {
    let mut report = FaultReport::default();
    let mut dice = FaultDice::new(options.seed);
    for round in 1..=options.count {
        rest(Duration::from_secs_f64(dice.draw_between(HEALTHY_S.0, HEALTHY_S.1)))?;
        // Each kind as often as the others.
        let fault = ProxyFault::ALL[(round - 1) % ProxyFault::ALL.len()];
        eprintln!("{round}/{} {fault}", options.count);
        let what = || format!("round {round}, seed {}: {fault}", options.seed);
        let from_ns = inject(system, fault, options, &mut dice, &mut report).with_context(what)?;
        let back_ns = system.wait_for_links(from_ns).with_context(what)?;
        let back_s = back_ns.saturating_sub(from_ns) as f64 / 1e9;
        eprintln!("    all links back {back_s:.3} s after it");
        let goal = Some(TimeGoal::Max(BACK_WITHIN_S));
        report.add_time(&format!("{fault}: its end to all links back"), back_s, goal);
        wait_until(PATIENCE, "the marking", || {
            Ok((system.read_marking()?.as_deref() == Some(MARKING)).then_some(()))
        })
        .with_context(what)?;
    }
    report.add_count("rounds after which the marking was the same", options.count as u64, None);
    system.diary.read_on()?;
    report.add_account(system.diary.account);
    Ok(report)
}

/// Injects a fault; returns when it was over.
fn inject(
    system: &mut SystemUnderTest,
    fault: ProxyFault,
    options: &ReliabilityOptions,
    dice: &mut FaultDice,
    report: &mut FaultReport,
) -> Result<u64> {
    let length_s = dice.draw_between(SHORTEST_S, options.longest.as_secs_f64().max(SHORTEST_S));
    let quality = match fault {
        ProxyFault::BadNetwork => NetworkQuality {
            delay: Duration::from_secs_f64(dice.draw_between(0.001, 0.04)),
            jitter: Duration::from_secs_f64(dice.draw_between(0.001, 0.03)),
            bytes_per_s: dice.draw_between(50e3, 5e6) as u32,
            loss: dice.draw_between(0.001, 0.05),
            ..NetworkQuality::GOOD
        },
        ProxyFault::BlackHole | ProxyFault::BlackHoleTowards | ProxyFault::BlackHoleFrom => {
            NetworkQuality {
                holds_to_server: fault != ProxyFault::BlackHoleFrom,
                holds_to_client: fault != ProxyFault::BlackHoleTowards,
                ..NetworkQuality::GOOD
            }
        }
        ProxyFault::Reset => {
            let from_ns = monotonic_ns();
            let count = system.relay_mut()?.reset_all()?;
            report.add_count("connections that were reset", count, None);
            return Ok(from_ns);
        }
        ProxyFault::Corrupt | ProxyFault::Truncate => {
            let mut from_ns = monotonic_ns();
            for _ in 0..HITS {
                from_ns = monotonic_ns();
                system.relay_mut()?.spoil_next(fault == ProxyFault::Truncate)?;
                rest(BETWEEN_HITS)?;
            }
            report.add_count("pieces that were spoiled", HITS as u64, None);
            return Ok(from_ns);
        }
    };
    eprintln!("    for {length_s:.2} s: {quality:?}");
    system.relay_mut()?.set_quality(quality)?;
    rest(Duration::from_secs_f64(length_s))?;
    let from_ns = monotonic_ns();
    system.relay_mut()?.set_quality(NetworkQuality::GOOD)?;
    Ok(from_ns)
}
