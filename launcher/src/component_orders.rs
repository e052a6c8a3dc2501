//! `armor restart`, `armor stop`, `armor watch` and `armor log`: one component of a running system.

pub mod answer;
mod log_level;
mod watch;

use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use armor_inspect::ObservedSystem;
use armor_inspect::run_control::{self, AbsentComponent, AbsentState, RunReply, RunRequest};
use armor_sdk::control::{RunState, Status};
use armor_wire::registry::ComponentEntry;
use clap::Args;
use serde_json::json;

use crate::arguments::{OutputFormat, RunningSystem, parse_duration, parse_name};
use crate::exit::CommandEnding;
use crate::inspect_cli::absence::list_absent;
use crate::inspect_cli::select_system;
use crate::print::{end_printing, print_line, print_notice};
use crate::system;
use crate::verb::Verb;

pub use log_level::LogArguments;
pub use watch::WatchArguments;

/// Time between two looks at whether a component is back.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// How long a component must run until it is reported as running: on a busy host a process whose first call
/// fails needs this long to end.
const RUNS_FOR: Duration = Duration::from_millis(300);
/// How long another call is waited for: a component that is called for its data may get none. A process
/// that panics in its call ends some time after that.
const IS_CALLED_WITHIN: Duration = Duration::from_secs(1);
/// How long the end of a call is waited for; it may be a long one.
const ENDS_WITHIN: Duration = Duration::from_secs(5);

/// Start a component again: one that runs, has failed, has ended, was stopped or was given up.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor restart mapper                 end it in order, start it again, wait until it runs
  armor restart mapper --within 60s    one that needs long to start

The launcher of the system does it, so it works on the host and for the user of `armor run`.")]
pub struct RestartArguments {
    /// The component.
    #[arg(value_parser = parse_name)]
    pub component: String,
    /// Longest time to wait until it runs again.
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "15s")]
    pub within: Duration,
    #[command(flatten)]
    pub running: RunningSystem,
}

/// Stop a component, which stays down until `armor restart`, or the whole system.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor stop camera    end one component of a system without a mission
  armor stop --all     end the system in order, as Ctrl-C does")]
pub struct StopArguments {
    /// The component.
    #[arg(value_parser = parse_name, required_unless_present = "all")]
    pub component: Option<String>,
    /// Stop the whole system.
    #[arg(long, conflicts_with = "component")]
    pub all: bool,
    #[command(flatten)]
    pub running: RunningSystem,
}

impl Verb for RestartArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(restart(&self, format)?.into())
    }
}

impl Verb for StopArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let request = match self.component {
            Some(component) => RunRequest::Stop { component },
            None => RunRequest::StopAll,
        };
        Ok(send_request(&self.running, &request, format)?.into())
    }
}

/// Has a component started again and waits until it runs.
///
/// # Errors
/// If no system is found, its launcher does not answer, or the component is given up, ends or does
/// not run in time.
fn restart(arguments: &RestartArguments, format: OutputFormat) -> Result<CommandEnding> {
    let RestartArguments { component, within, running } = arguments;
    let observed = select_system(running, "restart")?;
    let old = find_entry(&observed, component);
    let before = old.as_ref().map(|entry| entry.instance);
    let starts_before = find_absent(running, component).map_or(0, |absent| absent.starts);
    let request = RunRequest::Restart { component: component.clone() };
    let ending = send_request(running, &request, format)?;
    if ending != CommandEnding::Fine {
        return Ok(ending);
    }
    let deadline = Instant::now() + *within;
    while Instant::now() < deadline {
        let entry = find_entry(&observed, component).filter(|entry| Some(entry.instance) != before);
        if let Some(entry) = entry
            && let Ok(status) = observed.ask_component(component)
            && status.state != RunState::Starting
        {
            // Many a component fails, or its process ends, in its first call.
            thread::sleep(RUNS_FOR);
            let later = ask_after_call(&observed, component);
            let is_same =
                find_entry(&observed, component).is_some_and(|it| it.instance == entry.instance);
            if let Some(status) = later.ok().filter(|_| is_same) {
                if let Some(old) = old.filter(|old| old.kind != entry.kind) {
                    print_notice(format_args!(
                        "warning: {component} was the kind {}, and is the kind {} now: its executable \
                         was replaced",
                        old.kind, entry.kind
                    ));
                }
                return report_state(component, entry.pid, &status, format);
            }
            continue;
        }
        // Before the launcher obeys, it may still have been given up because of its earlier starts.
        let absent = find_absent(running, component).filter(|it| it.starts > starts_before);
        if let Some(absent) = absent
            && matches!(absent.state, AbsentState::GivenUp | AbsentState::Ended)
        {
            bail!("{component} does not run: {}", absent.reason);
        }
        thread::sleep(LOOK_EVERY);
    }
    bail!(
        "{component} does not run after {} s; `armor ps` shows its state, and its log in the folder \
         of the run the reason",
        within.as_secs_f64()
    )
}

/// Returns its state after another call, when it can hardly fail in its first one any more.
fn ask_after_call(
    observed: &ObservedSystem,
    component: &str,
) -> std::result::Result<Status, String> {
    let start = Instant::now();
    let (mut idle_since, mut first_calls) = (start, None);
    loop {
        let status = observed.ask_component(component)?;
        if status.busy {
            idle_since = Instant::now();
        }
        let is_called = status.exec_calls > *first_calls.get_or_insert(status.exec_calls);
        if is_called
            || status.state != RunState::Active
            || idle_since.elapsed() >= IS_CALLED_WITHIN
            || start.elapsed() >= ENDS_WITHIN
        {
            return Ok(status);
        }
        thread::sleep(LOOK_EVERY);
    }
}

/// Prints that the component runs; or why it has failed.
fn report_state(
    component: &str,
    pid: u32,
    status: &Status,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let Status { state, last_error: problem, .. } = status;
    let has_failed = *state == RunState::Failed;
    let ending = end_printing(match format {
        OutputFormat::Json if has_failed => print_line(
            json!({"component": component, "pid": pid, "state": state, "problem": problem}),
        ),
        OutputFormat::Json => {
            print_line(json!({"component": component, "pid": pid, "state": state}))
        }
        _ if has_failed => {
            print_notice(format_args!("error: {component} has failed: {problem}"));
            Ok(())
        }
        _ => print_line(format_args!("{component} runs: process {pid}, {state}")),
    })?;
    Ok(if has_failed { CommandEnding::Failed } else { ending })
}

fn find_absent(running: &RunningSystem, component: &str) -> Option<AbsentComponent> {
    list_absent(running).into_iter().find(|absent| absent.component == component)
}

fn find_entry(observed: &ObservedSystem, component: &str) -> Option<ComponentEntry> {
    let components = observed.list().ok()?.components;
    components.into_iter().find(|entry| entry.name == component)
}

/// Sends a request to the launcher; fails if it is refused.
fn send_request(
    running: &RunningSystem,
    request: &RunRequest,
    format: OutputFormat,
) -> Result<CommandEnding> {
    let RunReply { accepted, text, .. } =
        run_control::request(&system::find_record(running)?, request)?;
    match format {
        OutputFormat::Json => {
            end_printing(print_line(json!({"accepted": accepted, "text": text})))?;
        }
        _ if accepted => {
            end_printing(print_line(&text))?;
        }
        _ => print_notice(format_args!("refused: {text}")),
    }
    Ok(if accepted { CommandEnding::Fine } else { CommandEnding::Failed })
}
