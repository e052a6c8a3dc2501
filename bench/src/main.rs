//! Measures Armor's links beside blocking TCP of the standard library, in the same run, and prints
//! a table. The program plays all parts itself: it starts itself again for each process of a
//! measurement.

mod check;
mod jobs;
mod machine;
mod options;
mod ours;
mod petri;
mod plain;
mod process;
mod reaction;
mod readings;
mod table;
mod turns;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::{Context, Result};

use jobs::{Bench, Side};
use options::Options;
use table::Table;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1).peekable();
    let result = if arguments.next_if(|first| first == "role").is_some() {
        role(arguments)
    } else {
        options::parse(arguments).and_then(|options| match options {
            Some(options) if options.nets => petri::run(options.rounds),
            Some(options) => run(&options),
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
fn role(mut arguments: impl Iterator<Item = OsString>) -> Result<()> {
    let mut next = || arguments.next()?.into_string().ok();
    let core = next().context("no core")?.parse()?;
    let (side, role) = (next().context("no side")?, next().context("no role")?);
    process::settle(core)?;
    match side.as_str() {
        _ if role == "check" => {
            let (file, window) = (next().context("no file")?, next().context("no window")?);
            check::run(file.as_ref(), std::time::Duration::try_from_secs_f64(window.parse()?)?)
        }
        _ if role == "configd" => {
            let (registry, file) = (next().context("no registry")?, next().context("no file")?);
            turns::serve(registry.parse()?, file.as_ref())
        }
        _ if role == "executive" => {
            let (registry, file) = (next().context("no registry")?, next().context("no file")?);
            turns::play(registry, file.as_ref(), next().context("no journal")?.into())
        }
        "std" => {
            plain::run(&role, &arguments.filter_map(|a| a.into_string().ok()).collect::<Vec<_>>())
        }
        _ => ours::run(&role, arguments),
    }
}

fn run(options: &Options) -> Result<()> {
    let mut bench = Bench::new(options)?;
    let mut table = Table::default();
    for round in 0..options.rounds {
        for job in options.jobs() {
            // Whoever comes first may find the machine in another state than who comes second.
            let sides =
                if round % 2 == 0 { [Side::Std, Side::Armor] } else { [Side::Armor, Side::Std] };
            for side in sides {
                let quiet = machine::wait_until_quiet(options.quiet_wait);
                let load = machine::Load::start();
                match bench.measure(job, side) {
                    Ok(readings) if readings.is_empty() => {}
                    Ok(readings) => {
                        let foreign = load.foreign_percent();
                        let text: Vec<_> = readings.iter().map(ToString::to_string).collect();
                        let noisy = if quiet { "" } else { ", not quiet" };
                        eprintln!(
                            "[{}] {side} {} (foreign load {foreign:.0} %{noisy})",
                            round + 1,
                            text.join(", ")
                        );
                        table.add(round, side, foreign, readings);
                    }
                    Err(error) => eprintln!("[{}] {side} {job:?}: {error:#}", round + 1),
                }
            }
        }
    }
    print!("{}", table.markdown(options));
    Ok(())
}
