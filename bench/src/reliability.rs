//! How reliable a system of several hosts is: kills, cuts, stops, a bad network and a soak, in network
//! namespaces, with the real program and real components.

mod cuts;
mod diary;
pub mod dice;
mod echoes;
mod interrupt;
mod kill_judgement;
mod kills;
mod log_times;
mod mapper_kills;
mod network;
mod options;
pub mod parts;
mod processes;
mod proxy;
pub mod relay;
mod relay_process;
pub mod report;
mod soak;
mod stops;
mod system;
mod victim;

use std::path::PathBuf;

use anyhow::{Result, bail, ensure};

use crate::machine::{Load, describe_machine};
pub use options::ReliabilityOptions;
use system::{SystemOptions, SystemUnderTest};

/// What is done to the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReliabilityJob {
    Kills,
    Cuts,
    Stops,
    Proxy,
    Soak,
}

impl ReliabilityJob {
    /// The job of this name for `--only`.
    pub fn from_part(part: &str) -> Option<Self> {
        match part {
            "hosts-kills" => Some(Self::Kills),
            "hosts-cuts" => Some(Self::Cuts),
            "hosts-stops" => Some(Self::Stops),
            "hosts-proxy" => Some(Self::Proxy),
            "soak" => Some(Self::Soak),
            _ => None,
        }
    }

    /// Sets up the system, does the job, prints the table, and removes everything again.
    ///
    /// # Errors
    /// If it cannot be set up, does not come back after a fault, or misses a goal.
    pub fn run(self, options: &ReliabilityOptions) -> Result<()> {
        let program = find_program(options)?;
        let (pulses, rate_hz) = match self {
            Self::Soak => (16 / options.hosts * options.hosts, 20),
            Self::Kills | Self::Cuts | Self::Stops | Self::Proxy => (2 * options.hosts, 50),
        };
        let relay_seed = (self == Self::Proxy).then_some(options.seed);
        let system = SystemOptions { program, hosts: options.hosts, pulses, rate_hz, relay_seed };
        interrupt::notice_signals()?;
        let mut system = SystemUnderTest::start(system)?;
        let load = Load::start();
        let done = match self {
            Self::Kills => kills::run_kills(&mut system, options),
            Self::Cuts => cuts::run_cuts(&mut system, options),
            Self::Stops => stops::run_stops(&mut system, options),
            Self::Proxy => proxy::run_proxy(&mut system, options),
            Self::Soak => soak::run_soak(&mut system, options),
        };
        let report = match done {
            Ok(report) => report,
            Err(error) => {
                if !interrupt::was_interrupted() {
                    system.keep_files();
                }
                return Err(error);
            }
        };
        let is_met = report.meets_goals();
        if !is_met {
            system.keep_files();
        }
        let components = system.components().len();
        drop(system);
        print!("{}", report.to_markdown());
        println!(
            "\n{} hosts in network namespaces, {components} components, seed {}; load of everything \
             else {:.0} %. {}.",
            options.hosts,
            options.seed,
            load.foreign_percent(),
            describe_machine()
        );
        if is_met { Ok(()) } else { bail!("not every goal is met") }
    }
}

/// Kills the mapper in missions on this host, without namespaces, and prints the table.
///
/// # Errors
/// If a mission cannot be run, or a goal is missed.
pub fn measure_mapper_kills(options: &ReliabilityOptions) -> Result<()> {
    let program = find_program(options)?;
    interrupt::notice_signals()?;
    let load = Load::start();
    let report = mapper_kills::run_mapper_kills(&program, options)?;
    print!("{}", report.to_markdown());
    println!(
        "\nSimulated missions, seed {}; load of everything else {:.0} %. {}.",
        options.seed,
        load.foreign_percent(),
        describe_machine()
    );
    if report.meets_goals() { Ok(()) } else { bail!("not every goal is met") }
}

fn find_program(options: &ReliabilityOptions) -> Result<PathBuf> {
    let own = std::env::current_exe()?;
    let program = options.program.clone().unwrap_or_else(|| own.with_file_name("armor"));
    let program = std::path::absolute(program)?;
    ensure!(program.is_file(), "there is no {}: give --armor PATH", program.display());
    Ok(program)
}
