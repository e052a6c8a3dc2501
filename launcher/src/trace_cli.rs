//! `armor trace`: the path of messages through the components of a running system, printed or sent to
//! a collector of OpenTelemetry.

mod collector;
mod line;
mod otlp;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use armor_inspect::{CallTaps, ObservedSystem, TraceAssembly, TraceStep};
use armor_robotfile::advise_similar;
use clap::Args;

use crate::arguments::{OutputFormat, RunningSystem, parse_data_name, parse_duration};
use crate::exit::CommandEnding;
use crate::inspect_cli::select_system;
use crate::print::{end_printing, end_when_stdout_closes, print_line, print_notice};
use crate::system;
use crate::verb::Verb;
use collector::{Collector, CollectorAddress};

/// Time between two looks at what has arrived.
const LOOK: Duration = Duration::from_millis(100);
/// Time after which a call that has begun is in its trace.
const SETTLED_AFTER: Duration = Duration::from_secs(1);
/// Time between two requests to the collector.
const SEND_EVERY: Duration = Duration::from_secs(1);
/// How long a system without its registry is waited for before it counts as ended.
const LOST_FOR: Duration = Duration::from_secs(3);
/// How long nothing may come before the reason is printed.
const NOTICE_AFTER: Duration = Duration::from_secs(3);

/// Follow messages through the components of a running system: one trace from the first message to
/// the last call that it caused.
///
/// Each step is a call of a component's code: which message it was for, how long that was on its way
/// and waited for the component, how long the call took, and what it published. With --otlp the traces
/// are sent as OpenTelemetry, to Jaeger for example. A component that publishes in its next tick
/// continues the trace of what it has received last.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor trace                                            every call that handles a message
  armor trace simulator.scan --for 5s                    what follows from each scan
  armor trace simulator.scan --otlp http://127.0.0.1:4318   to a collector, such as Jaeger")]
pub struct TraceArguments {
    /// Only traces that begin with these data, COMPONENT.OUTPUT. Default: all.
    #[arg(value_parser = parse_data_name)]
    data: Vec<String>,
    /// Send the traces to the collector at this address, by OTLP over HTTP (JSON).
    #[arg(long, value_name = "http://HOST:PORT", value_parser = CollectorAddress::parse)]
    otlp: Option<CollectorAddress>,
    /// End after this time.
    #[arg(long = "for", value_name = "TIME", value_parser = parse_duration)]
    duration: Option<Duration>,
    #[command(flatten)]
    running: RunningSystem,
}

impl Verb for TraceArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(trace_messages(&self, format)?.into())
    }
}

/// Follows the calls until the time is over or the system has ended.
///
/// # Errors
/// If no system is found, data that are named do not exist, or no collector answers at the beginning.
fn trace_messages(arguments: &TraceArguments, format: OutputFormat) -> Result<CommandEnding> {
    end_when_stdout_closes();
    let observed = select_system(&arguments.running, "trace")?;
    check_names(&observed, &arguments.data)?;
    let output = match &arguments.otlp {
        Some(address) => {
            TraceOutput::Collector(Collector::connect(address, &name_system(&arguments.running))?)
        }
        None => TraceOutput::Printed(format),
    };
    let mut following = Following {
        taps: CallTaps::begin(observed.directory())?,
        assembly: TraceAssembly::new(arguments.data.clone()),
        observed,
        output,
        begun: Instant::now(),
        steps: 0,
        missed: 0,
    };
    let ended = end_printing(following.follow(arguments.duration))?;
    following.report_end(format)?;
    Ok(match following.output {
        TraceOutput::Collector(collector) if collector.has_lost_all() => CommandEnding::Failed,
        _ => ended,
    })
}

/// Refuses data that no component publishes.
fn check_names(observed: &ObservedSystem, names: &[String]) -> Result<()> {
    if names.is_empty() {
        return Ok(());
    }
    let listing = observed.list()?;
    let known: Vec<_> = listing.data.iter().map(|entry| entry.data.as_str()).collect();
    for name in names {
        if !known.contains(&name.as_str()) {
            let advice = advise_similar(name, known.iter().copied());
            bail!("no component publishes {name}{advice}; `armor data list` lists all");
        }
    }
    Ok(())
}

/// The name of the system, under which a collector shows its traces.
fn name_system(running: &RunningSystem) -> String {
    let recorded = || system::find_record(running).ok().map(|record| record.system);
    running.system.clone().or_else(recorded).unwrap_or_else(|| "armor".into())
}

/// Where the steps go.
enum TraceOutput {
    Printed(OutputFormat),
    Collector(Collector),
}

struct Following {
    observed: ObservedSystem,
    taps: CallTaps,
    assembly: TraceAssembly,
    output: TraceOutput,
    begun: Instant,
    steps: u64,
    missed: u64,
}

impl Following {
    fn follow(&mut self, duration: Option<Duration>) -> Result<()> {
        let (mut sent, mut heard) = (Instant::now(), Instant::now());
        let mut lines = line::LinePrinter::default();
        let mut has_noticed = false;
        loop {
            if let Some(report) = self.taps.next(LOOK) {
                self.assembly.add_report(report);
            }
            // What began before the end is reported a little later.
            let is_over =
                duration.is_some_and(|limit| self.begun.elapsed() >= limit + SETTLED_AFTER);
            if !self.taps.has_lost_system() {
                heard = Instant::now();
            }
            let has_ended = heard.elapsed() >= LOST_FOR;
            let now_s = match has_ended {
                // Nothing more can come.
                true => f64::INFINITY,
                false => self.observed.directory().clock().registry_time_s(),
            };
            let steps = self.assembly.settle(now_s);
            self.missed += self.assembly.take_missed();
            self.steps += steps.len() as u64;
            self.report_refused();
            if self.steps == 0 && !has_noticed && self.begun.elapsed() >= NOTICE_AFTER {
                has_noticed = true;
                self.explain_silence();
            }
            match &mut self.output {
                TraceOutput::Printed(format) => {
                    steps.iter().try_for_each(|step| lines.print(step, *format))?;
                }
                TraceOutput::Collector(collector) => {
                    collector.add(steps);
                    if sent.elapsed() >= SEND_EVERY || is_over || has_ended {
                        sent = Instant::now();
                        collector.send();
                    }
                }
            }
            if has_ended {
                print_notice("the system has ended");
            }
            if is_over || has_ended {
                return Ok(());
            }
        }
    }

    fn report_refused(&self) {
        for (component, reason) in self.taps.take_refused() {
            tracing::debug!("{component} serves no calls: {reason}");
        }
    }

    fn explain_silence(&self) {
        print_notice(match self.taps.linked().as_slice() {
            [] => "no component reports its calls: those that are played from a recording do not, nor \
                   do those built with an older Armor"
                .to_owned(),
            linked => format!("nothing yet from {}", linked.join(", ")),
        });
    }

    /// Prints what is missing, and what the collector has got.
    fn report_end(&self, format: OutputFormat) -> Result<()> {
        if self.missed > 0 {
            print_notice(format!("{} calls are missing: there were too many", self.missed));
        }
        let TraceOutput::Collector(collector) = &self.output else { return Ok(()) };
        match format {
            OutputFormat::Json => print_line(collector.summary()),
            _ => print_line(collector),
        }
    }
}

/// The text of an id in hexadecimal, as OpenTelemetry writes it.
fn hex_trace(step: &TraceStep) -> String {
    format!("{:032x}", step.place.trace)
}
