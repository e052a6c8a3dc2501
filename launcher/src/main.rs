//! The `armor` program: starts, watches and stops a system, inspects a running one, and contains
//! the daemons and the stock components as subcommands, so that one file is all a robot needs.
//!
//! Start with [`command_line`] (the list of commands), then [`run`] and its `supervisor` (what
//! keeps a system running).

// `println!` panics when a pipe is closed; [`print`] ends the command quietly.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod check;
mod command_line;
mod command_texts;
mod component_cli;
mod component_orders;
mod connect_cli;
mod daemon;
mod date;
mod doctor;
mod evaluate_cli;
mod exit;
mod exit_codes;
mod explain;
mod findings_error;
mod fmt;
mod guard;
mod help_layout;
mod host_agent;
mod inspect_cli;
mod keys_cli;
mod kinds;
mod logs_cli;
mod map_cli;
mod map_picture;
mod message_cli;
mod new;
mod param;
mod petri_cli;
mod playback_cli;
mod plot_cli;
mod print;
mod recording_cli;
mod retry_advice;
mod run;
#[cfg(test)]
mod scratch;
mod system;
mod terminal_session;
mod top;
mod trace_cli;
mod usage_error;
mod verb;
mod web_cli;

use std::ffi::OsStr;
use std::process::ExitCode;

use clap::FromArgMatches;
use clap::builder::Resettable;

use arguments::OutputFormat;
use command_line::{ArmorCommand, CommandLine, build_command};
use exit::CommandEnding;
use print::{StdoutClosed, help_width, print_notice};
use retry_advice::advise_retry;
use usage_error::exit_with;

fn main() -> ExitCode {
    // Started from `/proc/self/exe`, it would be listed as `exe`.
    let _ = rustix::thread::set_name(c"armor");
    let parser = ignore_empty_variables(build_command()).term_width(help_width());
    let parsed =
        parser.try_get_matches().and_then(|matches| CommandLine::from_arg_matches(&matches));
    let CommandLine { format, command } =
        parsed.unwrap_or_else(|error| exit_with(error, &build_command()));
    if format == OutputFormat::Dot && !matches!(command, ArmorCommand::Graph(_)) {
        let text = "only `armor graph` has --format dot";
        build_command().error(clap::error::ErrorKind::ArgumentConflict, text).exit();
    }
    if matches!(
        command,
        ArmorCommand::Run(_)
            | ArmorCommand::Host(_)
            | ArmorCommand::Play(_)
            | ArmorCommand::Gate(_)
            | ArmorCommand::Connect(_)
    ) {
        run::glibc::restart_with_settings();
    }
    command.run_command(format).unwrap_or_else(|error| {
        if error.is::<StdoutClosed>() {
            return CommandEnding::Fine.into();
        }
        print_notice(format_args!("error: {}", describe_error(&error)));
        CommandEnding::Failed.into()
    })
}

/// Returns an error with its causes, without those that the text before contains already, and with
/// a remedy if it may pass by itself.
fn describe_error(error: &anyhow::Error) -> String {
    let text = error.chain().map(ToString::to_string).fold(String::new(), |text, cause| {
        if text.is_empty() {
            cause
        } else if text.contains(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    });
    match advise_retry(error) {
        Some(advice) => format!("{text}; {advice}"),
        None => text,
    }
}

/// Treats a variable that is set to the empty string as not set, as most programs do.
fn ignore_empty_variables(command: clap::Command) -> clap::Command {
    let is_empty = |name: &OsStr| std::env::var_os(name).is_some_and(|value| value.is_empty());
    let command = command.mut_args(|argument| {
        let is_unset = argument.get_env().is_some_and(is_empty);
        if is_unset { argument.env(Resettable::Reset) } else { argument }
    });
    command.mut_subcommands(ignore_empty_variables)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_printed_once() {
        let error = anyhow::anyhow!("no space").context("cannot write a.log: no space");
        let error = error.context("the log");
        assert_eq!(describe_error(&error), "the log: cannot write a.log: no space");
    }
}
