//! How long a mission takes to react: from a component's report to the activation of the next one,
//! and to the last call of the one that stops; with the journal on the disk, and in memory.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use armor_registry::BackgroundRegistry;

use crate::jobs::{Bench, FIRST_CORE, Goal, Reading, Side, reading};
use crate::process::Process;
use crate::turns;

/// Firings that are measured, half of them on `done`, half on an event.
const FIRINGS: usize = 400;
/// The first ones, which also open connections.
const WARM_UP: usize = 20;
/// About as long as what the journal gets of a firing in one go.
const RECORD_LEN: usize = 400;
/// About as long as the journal is left alone between two firings.
const REST: Duration = Duration::from_millis(15);
/// How long one turn may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// A folder in memory, if the system has one.
const MEMORY: &str = "/dev/shm";

impl Bench {
    /// Takes turns, with the journal on the disk or where nothing is ever waited for.
    pub fn reaction(&self, side: Side, on_disk: bool) -> Result<Vec<Reading>> {
        let folder = if on_disk { disk()? } else { PathBuf::from(MEMORY) };
        if side == Side::Std || !folder.is_dir() {
            return Ok(Vec::new());
        }
        let scratch = folder.join(format!("armor-bench-{}", std::process::id()));
        std::fs::create_dir_all(&scratch)?;
        let firings = self.turns(&scratch);
        std::fs::remove_dir_all(&scratch)?;
        let firings = firings?;
        let journal = if on_disk { "" } else { ", journal in memory" };
        let mut readings = Vec::new();
        let mut say = |what: &str, values: Vec<f64>| {
            for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
                let value = quantile(values.clone(), share);
                readings.push(reading(format!("{what}, {name}"), "ms", value, Goal::None));
            }
        };
        for (report, by_event) in [("done", false), ("an event", true)] {
            let those = firings.iter().filter(|firing| firing.by_event == by_event);
            let times = those.map(|firing| firing.to_start_ms).collect();
            say(&format!("{report} to activation{journal}"), times);
        }
        let stops = firings.iter().map(|firing| firing.to_stop_ms).collect();
        say(&format!("report to stop{journal}"), stops);
        if on_disk {
            say("one write to the disk", syncs_ms(&folder)?);
        }
        Ok(readings)
    }

    /// Two components that take turns, with an executive and a configd of their own.
    fn turns(&self, scratch: &Path) -> Result<Vec<Firing>> {
        let registry = BackgroundRegistry::start(armor_registry::RegistryOptions {
            listen: ([127, 0, 0, 1], 0).into(),
            ..Default::default()
        })?;
        let address = registry.address().to_string();
        let file = scratch.join("turns.xml").display().to_string();
        std::fs::write(&file, turns::file())?;
        let daemon = |role: &str, rest: &[String]| {
            let mut arguments = vec![address.clone(), file.clone()];
            arguments.extend_from_slice(rest);
            Process::start(FIRST_CORE, Side::Armor, role, &arguments)
        };
        let component = |name: &str| {
            let arguments = ["--name", name, "--registry", &address].map(String::from);
            Process::start(self.other_core(), Side::Armor, "turn", &arguments)
        };
        let _configd = daemon("configd", &[])?;
        let (one, two) = (component("one")?, component("two")?);
        let journal = scratch.join("journal").display().to_string();
        let _executive = daemon("executive", &[journal])?;
        firings(&one, &two)
    }
}

/// A folder on a disk: where this program is.
fn disk() -> Result<PathBuf> {
    let program = std::env::current_exe()?;
    Ok(program.parent().context("a program is in a folder")?.to_owned())
}

/// What one firing took, in milliseconds.
#[derive(Clone, Copy, Debug)]
struct Firing {
    /// Until the next component was told that it is active.
    to_start_ms: f64,
    /// Until the one that reported had its last call.
    to_stop_ms: f64,
    /// It reported an event, not that it is done.
    by_event: bool,
}

/// Listens to both components until enough firings are seen.
fn firings(one: &Process, two: &Process) -> Result<Vec<Firing>> {
    let turn = |who: &Process| who.said("turn", PATIENCE);
    let mut firings = Vec::new();
    let mut before = turn(one)?;
    for (index, who) in [two, one].into_iter().cycle().enumerate().take(WARM_UP + FIRINGS) {
        let after = turn(who)?;
        let ms = |at: f64| (at - before["reported"]) / 1e6;
        let firing = Firing {
            to_start_ms: ms(after["started"]),
            to_stop_ms: ms(before["stopped"]),
            by_event: before["event"] == 1.0,
        };
        ensure!(
            0.0 < firing.to_stop_ms && firing.to_stop_ms < firing.to_start_ms,
            "started before the other had stopped: {firing:?}"
        );
        if index >= WARM_UP {
            firings.push(firing);
        }
        before = after;
    }
    Ok(firings)
}

/// How long it takes until a record is on the disk of `folder`, in milliseconds, again and again
/// after a rest as long as the journal's.
fn syncs_ms(folder: &Path) -> Result<Vec<f64>> {
    let path = folder.join(format!("armor-bench-{}.sync", std::process::id()));
    let mut file = File::create(&path)?;
    let mut times_ms = Vec::new();
    for _ in 0..FIRINGS / 4 {
        std::thread::sleep(REST);
        let start = Instant::now();
        file.write_all(&[b'x'; RECORD_LEN])?;
        file.sync_data()?;
        times_ms.push(start.elapsed().as_secs_f64() * 1e3);
    }
    std::fs::remove_file(&path)?;
    Ok(times_ms)
}

/// The one below which a share of `values` lies.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (values.len().saturating_sub(1) as f64 * share) as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_values_lies_below() {
        assert_eq!(quantile(vec![3.0, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(quantile((0..=100).map(f64::from).collect(), 0.99), 99.0);
        assert!(quantile(Vec::new(), 0.5).is_nan());
    }
}
