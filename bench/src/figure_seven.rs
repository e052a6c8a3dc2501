//! Figure 7 of Little-MEC: the latency of a message of 50 to 1,000 B by every means, with two cores and
//! with one.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};

use crate::bench::{Bench, FIRST_CORE};
use crate::figure::Contender;
use crate::latency_chart::{ChartPanel, LatencyCurve, draw_chart};
use crate::options::BenchOptions;
use crate::other_means::remove_queues;
use crate::process::{ANY_CORE, RoleLine, RoleProcess};

const PATIENCE: Duration = Duration::from_secs(20);
/// Little-MEC's payloads.
const LENS: [usize; 5] = [50, 250, 500, 750, 1000];
/// Fast for a robot, and far below what any of the means can do: a latency, not a queue.
const RATE_HZ: f64 = 500.0;

/// A means of passing a message.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Means {
    DirectCall,
    PriorityLock,
    Queues,
    Link,
    Pull,
    Spin,
    Shm,
}

const MEANS: [(Means, &str); 7] = [
    (Means::DirectCall, "direct call"),
    (Means::PriorityLock, "lock with writer priority"),
    (Means::Queues, "POSIX queues, broker"),
    (Means::Link, "link"),
    (Means::Pull, "pull, asked for by a message"),
    (Means::Spin, "link, wake=\"spin\""),
    (Means::Shm, "link, transport=\"shm\""),
];

/// Measures all of them, prints the table and draws the chart.
///
/// # Errors
/// If a process does not print its figures, or the chart cannot be written.
pub fn measure(bench: &Bench, options: &BenchOptions) -> Result<()> {
    let mut panels = Vec::new();
    for (title, other_core) in [("two cores", FIRST_CORE + 1), ("one core", FIRST_CORE)] {
        let mut curves = Vec::new();
        for (means, name) in MEANS {
            let mut p50_us = Vec::new();
            let mut p99_us = Vec::new();
            for len in LENS {
                let (p50, p99) = measure_means(bench, means, len, other_core)
                    .with_context(|| format!("{name}, {len} B, {title}"))?;
                eprintln!("{title}, {name}, {len} B: p50 {p50:.2} µs, p99 {p99:.2} µs");
                p50_us.push(p50);
                p99_us.push(p99);
            }
            curves.push(LatencyCurve { name, p50_us, p99_us });
        }
        panels.push(ChartPanel { title, curves });
    }
    print_table(&panels);
    if let Some(path) = &options.chart {
        write_chart(path, &panels)?;
    }
    Ok(())
}

fn write_chart(path: &Path, panels: &[ChartPanel]) -> Result<()> {
    std::fs::write(path, draw_chart(&LENS, panels))
        .with_context(|| format!("the chart {} cannot be written", path.display()))
}

fn print_table(panels: &[ChartPanel]) {
    println!("| latency, µs: p50 (p99) | {} |", LENS.map(|len| format!("{len} B")).join(" | "));
    println!("| --- |{}", " --- |".repeat(LENS.len()));
    for ChartPanel { title, curves } in panels {
        for LatencyCurve { name, p50_us, p99_us } in curves {
            let cells = p50_us.iter().zip(p99_us).map(|(p50, p99)| format!("{p50:.2} ({p99:.1})"));
            println!("| {name}, {title} | {} |", cells.collect::<Vec<_>>().join(" | "));
        }
    }
}

/// Returns the median and the 99th percentile in µs.
fn measure_means(bench: &Bench, means: Means, len: usize, other_core: usize) -> Result<(f64, f64)> {
    let pace = [len as f64, RATE_HZ, bench.window.as_secs_f64()].map(|number| number.to_string());
    let limit = PATIENCE + bench.window * 3;
    let start = |core: usize, role: &str, more: &[String]| -> Result<RoleProcess> {
        let arguments: Vec<_> = pace.iter().chain(more).cloned().collect();
        RoleProcess::start(core, Contender::Std, role, &arguments)
    };
    let ages = match means {
        Means::DirectCall => start(FIRST_CORE, "direct-call", &[])?.wait_for_line("ages", limit)?,
        Means::PriorityLock => {
            // Both threads are of one process, on the cores that this one may use.
            let cores = if other_core == FIRST_CORE { "0" } else { ANY_CORE };
            let role = RoleProcess::start_on(cores, Contender::Std, "priority-lock", &pace)?;
            role.wait_for_line("ages", limit)?
        }
        Means::Queues => {
            let queues =
                ["in", "out"].map(|end| format!("/armor-bench-{}-{end}", std::process::id()));
            remove_queues(&queues);
            let broker = start(other_core, "queue-broker", &queues)?;
            let reader = start(other_core, "queue-reader", &queues[1..])?;
            let linked = [&broker, &reader].map(|role| role.wait_for_line("linked", limit));
            let writer = start(FIRST_CORE, "queue-writer", &queues[..1]);
            let ages = reader.wait_for_line("ages", limit);
            drop(writer);
            remove_queues(&queues);
            linked.into_iter().collect::<Result<Vec<_>>>()?;
            ages?
        }
        Means::Link | Means::Pull | Means::Spin | Means::Shm => {
            let how = match means {
                Means::Pull => ",keep=pull",
                Means::Spin => ",wake=spin",
                Means::Shm => ",transport=shm",
                _ => "",
            };
            measure_link(bench, means, len, (how, other_core))?
        }
    };
    Ok((ages["p50_us"], ages["p99_us"]))
}

fn measure_link(
    bench: &Bench,
    means: Means,
    len: usize,
    (how, other_core): (&str, usize),
) -> Result<RoleLine> {
    let name = format!("{means:?}-{len}-{other_core}").to_lowercase();
    let (writer, reader) = (format!("writer-{name}"), format!("reader-{name}"));
    let window = ["--set".to_owned(), format!("window={}s", bench.window.as_secs_f64())];
    let mut settings = window.to_vec();
    settings.extend(["--set".into(), format!("len={len}"), "--set".into()]);
    settings.push(format!("period={}s", 1.0 / RATE_HZ));
    let _writer = bench.start_component(FIRST_CORE, "stamped-writer", &writer, &settings)?;
    let mut settings = window.to_vec();
    settings.extend(["--set".into(), "work=0s".into()]);
    settings.extend(bench.link_arguments("value", &format!("{writer}.value"), how));
    if means == Means::Pull {
        settings.extend(bench.link_arguments("trigger", &format!("{writer}.trigger"), ""));
    }
    let reader = bench.start_component(other_core, "stamped-reader", &reader, &settings)?;
    // The first window has the start of the link in it.
    reader.wait_for_line("ages", PATIENCE + bench.window)?;
    reader.wait_for_line("ages", PATIENCE + bench.window)
}
