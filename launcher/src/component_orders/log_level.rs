//! `armor log NAME LEVEL`: what a running process logs.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, bail};
use armor_inspect::{CONFIGD, CONFIGURATION};
use armor_sdk::control::Command;
use clap::Args;

use super::answer::{ANSWER_WITHIN, REQUEST, send_command};
use super::watch::check_name;
use crate::arguments::{OutputFormat, RunningSystem, parse_name};
use crate::exit::CommandEnding;
use crate::inspect_cli::absence::list_absent;
use crate::inspect_cli::select_system;
use crate::verb::Verb;

/// Time within which the registry names a process that runs.
const KNOWN_WITHIN: Duration = Duration::from_millis(300);

/// Change what a running component, the executive or configd logs, until its next start.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  armor log mapper debug                       more of one component
  armor log mapper info                        as at its start
  armor log mapper armor_sdk=trace,info        the SDK inside it
  armor log executive debug
  armor log configd debug

ARMOR_LOG=debug armor run FILE sets it for all processes from their start.")]
pub struct LogArguments {
    /// The component, executive or configd.
    #[arg(value_parser = parse_name)]
    pub component: String,
    /// error, warn, info, debug, trace or off; or a filter by modules, such as my_crate=debug,info.
    #[arg(value_name = "LEVEL")]
    pub filter: String,
    #[command(flatten)]
    pub running: RunningSystem,
}

impl Verb for LogArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(set_log_filter(&self, format)?.into())
    }
}

/// Returns the name under which a process takes orders.
///
/// # Errors
/// If it takes none.
fn find_commanded(name: &str) -> Result<&str> {
    match name {
        // The same process: it serves configuration under one name and takes orders under the other.
        CONFIGD => Ok(CONFIGURATION),
        "registry" => bail!(
            "the log level of the registry cannot be changed while it runs; ARMOR_LOG sets it at \
             the start: `ARMOR_LOG=debug armor run FILE`, or `ARMOR_LOG=debug armor registry`"
        ),
        name => Ok(name),
    }
}

/// Sends the filter and prints the answer; fails if it is refused.
///
/// # Errors
/// If no system is found, or the process does not answer.
fn set_log_filter(arguments: &LogArguments, format: OutputFormat) -> Result<CommandEnding> {
    let LogArguments { component, filter, running } = arguments;
    let observed = select_system(running, "log")?;
    let process = find_commanded(component)?;
    // A misspelt name is answered with those that there are; a process that is being started is
    // waited for.
    let entry = match observed.directory().find_process(process, KNOWN_WITHIN) {
        Ok(entry) => entry,
        Err(_) => {
            let absent = list_absent(running);
            if !absent.iter().any(|absent| absent.component == process) {
                check_name(&observed, process)?;
            }
            observed.directory().find_process(process, ANSWER_WITHIN)?
        }
    };
    let command = Command::SetLogFilter { request: REQUEST, filter: filter.clone() };
    send_command(&entry, "armor log", &command)?.print(&format!("{component}: "), format)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configd_takes_orders_as_configuration_and_the_registry_none() {
        assert_eq!(find_commanded("configd").ok(), Some("configuration"));
        assert_eq!(find_commanded("mapper").ok(), Some("mapper"));
        let error = find_commanded("registry").expect_err("no orders").to_string();
        assert!(error.contains("`ARMOR_LOG=debug armor run FILE`"), "{error}");
    }
}
