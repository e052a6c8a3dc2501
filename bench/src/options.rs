//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail};
use lexopt::prelude::{Long, ValueExt};

use crate::job::{BenchJob, BlackboardJob};
use crate::memory_faults::MemoryJob;
use crate::reliability::{ReliabilityJob, ReliabilityOptions};

pub const USAGE: &str = "\
usage: armor-bench [--rounds N] [--secs S] [--only PART] [--same-core] [--quiet-wait S]
  --rounds N        number of rounds; medians are printed (default 5)
  --secs S          how long one figure is measured (default 1)
  --only PART       lat, spin, flood, fan, paced, first, idle, check or reaction; may
                    be repeated. Also freshness, which takes 4 minutes a round.
                    Or nets: states and firings of Petri nets, and nothing else.
                    Or, as root, faults in a system of several hosts, and nothing else:
                    hosts-kills, hosts-cuts, hosts-stops, hosts-proxy or soak.
                    Or memory-faults or memory-kills: shared memory under faults.
                    Or blackboard (one writer, 16 readers), pull (what a pull costs) or
                    figure-seven (the latency of 7 means, 2 minutes with --secs 1).
                    Or mapper-kills, in simulated missions on this host, and nothing else.
                    Or rehearsals: drawn plans in five worlds, predicted and driven
  --chart FILE      draw figure-seven there, as SVG
  --armor PATH      the program `armor` for these (default: next to this program)
  --hosts N         2 or 3 hosts (default 2)
  --seed N          the seed of their choices (default 1)
  --kills N         how many processes are killed (default 300)
  --world NAME      kill the mapper, or rehearse, in this world, not in all five; may be repeated
  --plans N         how many plans are rehearsed in each world (default 10)
  --speed TIMES     how many times faster than real time (default 20)
  --count N         how many times a host is cut off, or all are stopped
                    (default 100)
  --longest S       the longest time of that (default 60)
  --minutes M       how long the soak lasts (default 30)
  --interval S      seconds from one fault of the soak to the next (default 10)
  --same-core       both processes on core 0: what the software costs, without the wake-up of a
                    halted core; measures round trips only, unless --only names others
  --quiet-wait S    wait up to S seconds for an idle machine before each figure (default 0)";

/// The part that is not a job: it has no counterpart in another program.
const NETS: &str = "nets";
/// Neither is this one, and it needs no hosts.
const MAPPER_KILLS: &str = "mapper-kills";
/// Nor does this one.
const REHEARSALS: &str = "rehearsals";

/// What is to be measured, and how.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    pub rounds: usize,
    pub window: Duration,
    pub same_core: bool,
    pub quiet_wait: Duration,
    /// Petri nets, and nothing else.
    pub nets: bool,
    /// Faults in a system of several hosts, and nothing else.
    pub fault_job: Option<ReliabilityJob>,
    /// Shared memory under faults, and nothing else.
    pub memory_job: Option<MemoryJob>,
    /// What a blackboard costs, and nothing else.
    pub blackboard_job: Option<BlackboardJob>,
    /// The file for its chart.
    pub chart: Option<PathBuf>,
    /// Kills of the mapper in simulated missions, and nothing else.
    pub mapper_kills: bool,
    /// Rehearsals of drawn plans, and nothing else.
    pub rehearsals: bool,
    pub plans: u64,
    pub speed: f64,
    pub reliability: ReliabilityOptions,
    only: Vec<String>,
}

impl BenchOptions {
    /// The jobs of one round.
    pub fn jobs(&self) -> impl Iterator<Item = BenchJob> {
        let long = BenchJob::all_long().filter(|_| !self.only.is_empty());
        BenchJob::all().chain(long).filter(|job| match self.only.is_empty() {
            true => !self.same_core || job.part() == "lat",
            false => self.only.iter().any(|part| part == job.part()),
        })
    }
}

/// Reads the command line; `None` if help is asked for.
pub fn parse_arguments(arguments: impl Iterator<Item = OsString>) -> Result<Option<BenchOptions>> {
    let mut options = BenchOptions {
        rounds: 5,
        window: Duration::from_secs(1),
        same_core: false,
        quiet_wait: Duration::ZERO,
        nets: false,
        fault_job: None,
        memory_job: None,
        blackboard_job: None,
        chart: None,
        mapper_kills: false,
        rehearsals: false,
        plans: 10,
        speed: 20.0,
        reliability: ReliabilityOptions::default(),
        only: Vec::new(),
    };
    let mut parser = lexopt::Parser::from_args(arguments);
    while let Some(argument) = parser.next()? {
        match argument {
            Long("help") => return Ok(None),
            Long("rounds") => options.rounds = parser.value()?.parse()?,
            Long("secs") => options.window = parser.value()?.parse_with(parse_seconds)?,
            Long("quiet-wait") => options.quiet_wait = parser.value()?.parse_with(parse_seconds)?,
            Long("same-core") => options.same_core = true,
            Long("only") => match parser.value()?.parse::<String>()? {
                part if part == NETS => options.nets = true,
                part if part == MAPPER_KILLS => options.mapper_kills = true,
                part if part == REHEARSALS => options.rehearsals = true,
                part if MemoryJob::from_part(&part).is_some() => {
                    options.memory_job = MemoryJob::from_part(&part);
                }
                part if BlackboardJob::from_part(&part).is_some() => {
                    options.blackboard_job = BlackboardJob::from_part(&part);
                }
                part if ReliabilityJob::from_part(&part).is_some() => {
                    options.fault_job = ReliabilityJob::from_part(&part);
                }
                part => options.only.push(part),
            },
            Long("chart") => options.chart = Some(parser.value()?.into()),
            Long("armor") => options.reliability.program = Some(parser.value()?.into()),
            Long("hosts") => options.reliability.hosts = parser.value()?.parse()?,
            Long("seed") => options.reliability.seed = parser.value()?.parse()?,
            Long("kills") => options.reliability.kills = parser.value()?.parse()?,
            Long("world") => options.reliability.worlds.push(parser.value()?.parse()?),
            Long("plans") => options.plans = parser.value()?.parse()?,
            Long("speed") => options.speed = parser.value()?.parse()?,
            Long("count") => options.reliability.count = parser.value()?.parse()?,
            Long("longest") => {
                options.reliability.longest = parser.value()?.parse_with(parse_seconds)?;
            }
            Long("minutes") => {
                options.reliability.soak = parser.value()?.parse_with(parse_seconds)? * 60;
            }
            Long("interval") => {
                options.reliability.interval = parser.value()?.parse_with(parse_seconds)?;
            }
            // `cargo bench` adds it.
            Long("bench") => {}
            other => return Err(other.unexpected().into()),
        }
    }
    let has_part =
        |part: &String| BenchJob::all().chain(BenchJob::all_long()).any(|job| job.part() == part);
    if let Some(unknown) = options.only.iter().find(|part| !has_part(part)) {
        bail!("there is nothing called `{unknown}` to measure\n{USAGE}");
    }
    Ok(Some(options))
}

fn parse_seconds(text: &str) -> Result<Duration> {
    Ok(Duration::try_from_secs_f64(text.parse()?)?)
}
