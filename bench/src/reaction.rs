//! The reaction time of a mission: from a component's report to the activation of the next one, and
//! to the last call of the one that stops; with the journal on the disk, and in memory.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use armor_registry::BackgroundRegistry;

use crate::bench::{Bench, FIRST_CORE};
use crate::figure::{Contender, Figure, FigureGoal};
use crate::process::RoleProcess;
use crate::turn_system;

/// Firings that are measured, half of them on `done`, half on an event.
const FIRINGS: usize = 400;
/// The first firings, which also open connections: not counted.
const WARM_UP: usize = 20;
/// About the length of the journal's record of a firing.
const RECORD_LEN: usize = 400;
/// About the time between two records of the journal.
const REST: Duration = Duration::from_millis(15);
/// How long one turn may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// A folder in memory, if the system has one.
const MEMORY: &str = "/dev/shm";

impl Bench {
    /// Measures turns, with the journal on the disk or in memory.
    pub fn measure_reaction(&self, side: Contender, on_disk: bool) -> Result<Vec<Figure>> {
        let folder = if on_disk { disk_folder()? } else { PathBuf::from(MEMORY) };
        if side == Contender::Std || !folder.is_dir() {
            return Ok(Vec::new());
        }
        let scratch = folder.join(format!("armor-bench-{}", std::process::id()));
        std::fs::create_dir_all(&scratch)?;
        let firings = self.take_turns(&scratch);
        std::fs::remove_dir_all(&scratch)?;
        let firings = firings?;
        let journal = if on_disk { "" } else { ", journal in memory" };
        let mut readings = Vec::new();
        let mut add = |what: &str, values: Vec<f64>| {
            for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
                let value = quantile(values.clone(), share);
                readings.push(Figure::new(
                    format!("{what}, {name}"),
                    "ms",
                    value,
                    FigureGoal::None,
                ));
            }
        };
        for (report, by_event) in [("done", false), ("an event", true)] {
            let those = firings.iter().filter(|firing| firing.by_event == by_event);
            let times = those.map(|firing| firing.to_start_ms).collect();
            add(&format!("{report} to activation{journal}"), times);
        }
        let stops = firings.iter().map(|firing| firing.to_stop_ms).collect();
        add(&format!("report to stop{journal}"), stops);
        if on_disk {
            add("one write to the disk", measure_syncs_ms(&folder)?);
        }
        Ok(readings)
    }

    /// Runs two components that take turns, with an executive and a configd of their own.
    fn take_turns(&self, scratch: &Path) -> Result<Vec<MeasuredFiring>> {
        let registry = BackgroundRegistry::start(armor_registry::RegistryOptions {
            listen: ([127, 0, 0, 1], 0).into(),
            ..Default::default()
        })?;
        let address = registry.address().to_string();
        let file = scratch.join("turns.xml").display().to_string();
        std::fs::write(&file, turn_system::write_turn_file())?;
        let daemon = |role: &str, rest: &[String]| {
            let mut arguments = vec![address.clone(), file.clone()];
            arguments.extend_from_slice(rest);
            RoleProcess::start(FIRST_CORE, Contender::Armor, role, &arguments)
        };
        let component = |name: &str| {
            let arguments = ["--name", name, "--registry", &address].map(String::from);
            RoleProcess::start(self.other_core(), Contender::Armor, "turn", &arguments)
        };
        let _configd = daemon("configd", &[])?;
        let (one, two) = (component("one")?, component("two")?);
        let journal = scratch.join("journal").display().to_string();
        let _executive = daemon("executive", &[journal])?;
        measure_firings(&one, &two)
    }
}

/// A folder on a disk: the one of this program.
fn disk_folder() -> Result<PathBuf> {
    let program = std::env::current_exe()?;
    Ok(program.parent().context("a program is in a folder")?.to_owned())
}

/// The durations of one firing, in milliseconds.
#[derive(Clone, Copy, Debug)]
struct MeasuredFiring {
    /// Until the next component was called with `Started`.
    to_start_ms: f64,
    /// Until the one that reported had its last call.
    to_stop_ms: f64,
    /// It reported an event, not that it is done.
    by_event: bool,
}

/// Reads what both components print until enough firings are measured.
fn measure_firings(one: &RoleProcess, two: &RoleProcess) -> Result<Vec<MeasuredFiring>> {
    let read_turn = |component: &RoleProcess| component.wait_for_line("turn", PATIENCE);
    let mut firings = Vec::new();
    let mut before = read_turn(one)?;
    for (index, component) in [two, one].into_iter().cycle().enumerate().take(WARM_UP + FIRINGS) {
        let after = read_turn(component)?;
        let ms = |at: f64| (at - before["reported"]) / 1e6;
        let firing = MeasuredFiring {
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

/// Measures how long it takes until a record is on the disk of `folder`, in milliseconds, each time
/// after a rest as long as the journal's.
fn measure_syncs_ms(folder: &Path) -> Result<Vec<f64>> {
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

/// The value below which a share of `values` lies.
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
