//! A blackboard with Armor's means: one writer, many readers of which one stands still and one is slow.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use rustix::process::{Pid, Signal, kill_process};

use crate::bench::{Bench, FIRST_CORE};
use crate::figure_seven;
use crate::job::BlackboardJob;
use crate::machine::{Load, describe_machine};
use crate::options::BenchOptions;
use crate::process::{RoleLine, RoleProcess};
use crate::pull;
use crate::reliability::report::FaultReport;

const PATIENCE: Duration = Duration::from_secs(20);
const READERS: usize = 16;
const LEN: usize = 100;
/// 1 kHz.
const PERIOD: &str = "1ms";
/// What a message costs the slow reader.
const SLOW: &str = "20ms";

/// Measures and prints the table.
///
/// # Errors
/// If a process does not do its part, or a goal is missed.
pub fn run_job(job: BlackboardJob, options: &BenchOptions) -> Result<()> {
    let bench = Bench::new(options)?;
    let load = Load::start();
    let meets_goals = match job {
        BlackboardJob::FigureSeven => figure_seven::measure(&bench, options).map(|()| true)?,
        BlackboardJob::Readers => print_report(&measure_readers(&bench)?),
        BlackboardJob::Pull => print_report(&pull::measure(&bench)?),
    };
    println!("\nLoad of everything else {:.0} %. {}.", load.foreign_percent(), describe_machine());
    if meets_goals { Ok(()) } else { bail!("not every goal is met") }
}

/// Prints it. Returns whether every goal is met.
fn print_report(report: &FaultReport) -> bool {
    print!("{}", report.to_markdown());
    report.meets_goals()
}

fn measure_readers(bench: &Bench) -> Result<FaultReport> {
    let window = ["--set".to_owned(), format!("window={}s", bench.window.as_secs_f64())];
    let mut settings = window.to_vec();
    settings.extend(["--set".into(), format!("len={LEN}"), "--set".into()]);
    settings.push(format!("period={PERIOD}"));
    let writer = bench.start_component(FIRST_CORE, "stamped-writer", "writer", &settings)?;
    let mut readers = Vec::new();
    for index in 0..READERS {
        let work = if index == 1 { SLOW } else { "0s" };
        let mut settings = window.to_vec();
        settings.extend(["--set".into(), format!("work={work}")]);
        settings.extend(bench.link_arguments("value", "writer.value", ""));
        let name = format!("reader{index}");
        readers.push(bench.start_component(
            bench.other_core(),
            "stamped-reader",
            &name,
            &settings,
        )?);
    }
    for reader in &readers {
        reader.wait_for_line("ages", PATIENCE)?;
    }
    let stopped = Pid::from_raw(readers[0].pid() as i32).context("no process")?;
    kill_process(stopped, Signal::STOP)?;
    // The window that runs began before the reader was stopped; the next one is whole.
    std::thread::sleep(bench.window.mul_f64(2.2));
    let next = |process: &RoleProcess, key: &str| -> Result<RoleLine> {
        let printed = std::iter::from_fn(|| process.next_line(key));
        printed.last().with_context(|| format!("no `{key}`"))
    };
    let writes = next(&writer, "writes")?;
    let mut report = FaultReport::default();
    report.add_count("writes", writes["n"] as u64, None);
    let ms = |line: &RoleLine, key: &str| line[key] / 1e3;
    report.add_value("write later than its tick, p50", ms(&writes, "late_p50_us"), "ms", None);
    report.add_value("write later than its tick, p99", ms(&writes, "late_p99_us"), "ms", Some(0.2));
    report.add_value("write later than its tick, most", ms(&writes, "late_most_us"), "ms", None);
    let slow = next(&readers[1], "ages")?;
    report.add_value("age at the slow reader, p99", ms(&slow, "p99_us"), "ms", Some(2.0));
    let mut worst = (0.0_f64, 0.0_f64);
    for reader in &readers[2..] {
        let ages = next(reader, "ages")?;
        worst.0 = worst.0.max(ms(&ages, "p99_us"));
        worst.1 = worst.1.max(ms(&ages, "replaced_p99_us"));
    }
    report.add_value("age on arrival at the others, worst p99", worst.0, "ms", Some(2.0));
    report.add_value("age when replaced at the others, worst p99", worst.1, "ms", Some(2.0));
    kill_process(stopped, Signal::CONT)?;
    Ok(report)
}
