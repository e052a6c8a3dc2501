//! Kills: a process of the system at random, again and again; each time the system must come back as
//! it was.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use super::dice::FaultDice;
use super::interrupt::{rest, wait_until};
use super::options::ReliabilityOptions;
use super::report::{FaultReport, TimeGoal};
use super::system::{PATIENCE, SystemUnderTest};
use super::victim::FaultVictim;

/// How long a process runs before it is killed again: a component that dies five times in 60 s is
/// given up, and after 10 s it is restarted without a longer delay.
const HEALTHY: Duration = Duration::from_secs(13);
/// After how many kills the mission is ordered to fire a transition.
const KILLS_PER_ORDER: usize = 5;

/// Kills, and measures.
///
/// # Errors
/// If the system does not come back.
pub fn run_kills(
    system: &mut SystemUnderTest,
    options: &ReliabilityOptions,
) -> Result<FaultReport> {
    let mut report = FaultReport::default();
    let mut dice = FaultDice::new(options.seed);
    let mut marking = ExpectedMarking::default();
    let mut last: HashMap<String, Instant> = HashMap::new();
    let victims = FaultVictim::list_all(system);
    for kill in 1..=options.kills {
        if kill.is_multiple_of(KILLS_PER_ORDER) {
            marking.change(system)?;
        }
        let victim = wait_until(PATIENCE, "a process that may be killed", || {
            let healthy = |victim: &&FaultVictim| {
                last.get(&victim.name()).is_none_or(|at| at.elapsed() > HEALTHY)
            };
            let healthy: Vec<_> = victims.iter().filter(healthy).cloned().collect();
            Ok(dice.choose(&healthy).cloned())
        })?;
        let what = || format!("kill {kill}, seed {}: {}", options.seed, victim.name());
        // Fails if the marking is another one.
        let back = victim.kill(system, marking.text()).with_context(what)?;
        report.add_count("kills after which the marking was the same", 1, None);
        note_death(&victim, system, &mut last);
        eprintln!(
            "{kill}/{} {}: back after {:.3} s, {:.3} s after its start",
            options.kills,
            victim.name(),
            back.since_kill_s,
            back.since_start_s
        );
        let goal = Some(TimeGoal::P99(1.0));
        report.add_time("all: start of the process to all back", back.since_start_s, goal);
        report.add_time("all: kill to all back", back.since_kill_s, None);
        report.add_time(&format!("{}: start to back", victim.kind()), back.since_start_s, None);
        rest(Duration::from_secs_f64(dice.draw_between(0.05, 1.5)))?;
    }
    system.diary.read_on()?;
    report.add_account(system.diary.account);
    Ok(report)
}

/// Those that died with it also need their time.
fn note_death(victim: &FaultVictim, system: &SystemUnderTest, last: &mut HashMap<String, Instant>) {
    let host = match victim {
        FaultVictim::Agent { host } => Some(*host),
        FaultVictim::Launcher => Some(0),
        _ => None,
    };
    let with_it = system.components().into_iter().filter(|(_, own)| Some(*own) == host);
    for name in with_it.map(|(name, _)| name).chain([victim.name()]) {
        last.insert(name, Instant::now());
    }
}

/// The marking that the mission must have.
#[derive(Default)]
struct ExpectedMarking {
    is_right: bool,
}

impl ExpectedMarking {
    fn text(&self) -> &'static str {
        if self.is_right { "right-works 1" } else { "left-works 1" }
    }

    /// Orders the transition to the other place, and waits for it.
    fn change(&mut self, system: &SystemUnderTest) -> Result<()> {
        let transition = if self.is_right { "to-left" } else { "to-right" };
        system.run_tool(&["mission", "fire", transition])?;
        self.is_right = !self.is_right;
        wait_until(PATIENCE, "the transition to fire", || {
            Ok((system.read_marking()?.as_deref() == Some(self.text())).then_some(()))
        })
    }
}
