//! Compares Armor's links with blocking TCP of the standard library, in the same run, and prints a
//! table; or injects faults into a system of several hosts and measures how it comes back. The program
//! plays all roles itself: it starts itself again for each process of a
//! measurement.

mod bench;
mod blackboard;
mod figure;
mod figure_seven;
mod freshness;
mod job;
mod large_file;
mod latency_chart;
mod machine;
mod memory_faults;
mod numbered;
mod options;
mod other_means;
mod petri;
mod process;
mod pull;
mod pull_times;
mod reaction;
mod readings;
mod rehearsals;
mod reliability;
mod sdk_roles;
mod stamped;
mod table;
mod tcp_roles;
mod turn_system;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::{Context, Result};

use bench::Bench;
use figure::Contender;
use options::BenchOptions;
use rehearsals::RehearsalOptions;
use reliability::ReliabilityOptions;
use table::ResultTable;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1).peekable();
    let result = if arguments.next_if(|first| first == "role").is_some() {
        play_role(arguments)
    } else if arguments.next_if(|first| first == "part").is_some() {
        reliability::parts::play_part(arguments)
    } else if arguments.next_if(|first| first == reliability::relay::RELAY).is_some() {
        reliability::relay::play_relay(arguments)
    } else {
        options::parse_arguments(arguments).and_then(|options| match options {
            Some(options) if options.fault_job.is_some() => run_fault_job(&options),
            Some(options) if options.memory_job.is_some() => run_memory_job(&options),
            Some(options) if options.blackboard_job.is_some() => run_blackboard_job(&options),
            Some(options) if options.mapper_kills => {
                reliability::measure_mapper_kills(&options.reliability)
            }
            Some(options) if options.rehearsals => rehearse_plans(options),
            Some(options) if options.nets => petri::measure_nets(options.rounds),
            Some(options) => run_jobs(&options),
            None => {
                println!("{}", options::USAGE);
                Ok(())
            }
        })
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// One process of a measurement: `role CORE SIDE ROLE …`.
fn play_role(mut arguments: impl Iterator<Item = OsString>) -> Result<()> {
    let mut next = || arguments.next()?.into_string().ok();
    let core = next().context("no core")?;
    let (side, role) = (next().context("no side")?, next().context("no role")?);
    process::pin_to_core(if core == process::ANY_CORE { None } else { Some(core.parse()?) })?;
    match side.as_str() {
        _ if role == "check" => {
            let (file, window) = (next().context("no file")?, next().context("no window")?);
            large_file::measure_checks(
                file.as_ref(),
                std::time::Duration::try_from_secs_f64(window.parse()?)?,
            )
        }
        _ if role == "configd" => {
            let (registry, file) = (next().context("no registry")?, next().context("no file")?);
            turn_system::serve_file(registry.parse()?, file.as_ref())
        }
        _ if role == "executive" => {
            let (registry, file) = (next().context("no registry")?, next().context("no file")?);
            turn_system::play_mission(registry, file.as_ref(), next().context("no journal")?.into())
        }
        "std" => {
            let arguments: Vec<_> = arguments.filter_map(|it| it.into_string().ok()).collect();
            if other_means::is_role(&role) {
                other_means::play_role(&role, &arguments)
            } else {
                tcp_roles::play_role(&role, &arguments)
            }
        }
        _ => sdk_roles::play_role(&role, arguments),
    }
}

fn rehearse_plans(options: BenchOptions) -> Result<()> {
    let BenchOptions { plans, speed, reliability, .. } = options;
    let ReliabilityOptions { program, worlds, seed, .. } = reliability;
    rehearsals::measure_rehearsals(&RehearsalOptions { program, worlds, plans, seed, speed })
}

fn run_memory_job(options: &BenchOptions) -> Result<()> {
    options.memory_job.map_or(Ok(()), |job| job.run(options))
}

fn run_blackboard_job(options: &BenchOptions) -> Result<()> {
    options.blackboard_job.map_or(Ok(()), |job| blackboard::run_job(job, options))
}

fn run_fault_job(options: &BenchOptions) -> Result<()> {
    options.fault_job.map_or(Ok(()), |job| job.run(&options.reliability))
}

fn run_jobs(options: &BenchOptions) -> Result<()> {
    let mut bench = Bench::new(options)?;
    let mut table = ResultTable::default();
    for round in 0..options.rounds {
        for job in options.jobs() {
            // The second side may find the machine in another state than the first one: they
            // alternate.
            let sides = if round % 2 == 0 {
                [Contender::Std, Contender::Armor]
            } else {
                [Contender::Armor, Contender::Std]
            };
            for side in sides {
                let quiet = machine::wait_until_quiet(options.quiet_wait);
                let load = machine::Load::start();
                match bench.measure(job, side) {
                    Ok(figures) if figures.is_empty() => {}
                    Ok(figures) => {
                        let foreign = load.foreign_percent();
                        let text: Vec<_> = figures.iter().map(ToString::to_string).collect();
                        let noisy = if quiet { "" } else { ", not quiet" };
                        eprintln!(
                            "[{}] {side} {} (foreign load {foreign:.0} %{noisy})",
                            round + 1,
                            text.join(", ")
                        );
                        table.add_figures(round, side, foreign, figures);
                    }
                    Err(error) => eprintln!("[{}] {side} {job:?}: {error:#}", round + 1),
                }
            }
        }
    }
    print!("{}", table.to_markdown(options));
    Ok(())
}
