//! The `armor` program: starts, watches and stops a system, looks into a running one, and holds the
//! daemons and the stock components as subcommands, so that one file is all a robot needs.
//!
//! Start with [`arguments`] (what can be asked), then [`run`] and its `supervisor` (what keeps a
//! system running).

mod arguments;
mod check;
mod daemon;
mod evaluate_cli;
mod exit;
mod explain;
mod fmt;
mod guard;
mod inspect_cli;
mod kinds;
mod new;
mod param;
mod petri_cli;
mod print;
mod run;
#[cfg(test)]
mod scratch;
mod system;

use std::ffi::OsStr;
use std::process::ExitCode;

use anyhow::Result;
use clap::builder::Resettable;
use clap::{CommandFactory, FromArgMatches};

use arguments::{Arguments, Command, Format};
use exit::Ending;

fn main() -> ExitCode {
    let told = without_empty(Arguments::command()).get_matches();
    let Arguments { format, command } =
        Arguments::from_arg_matches(&told).unwrap_or_else(|error| error.exit());
    if format == Format::Dot && !matches!(command, Command::Graph(_)) {
        let text = "only `armor graph` has --format dot";
        Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, text).exit();
    }
    dispatch(command, format).unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        Ending::Failed.into()
    })
}

/// A variable that is set to nothing counts as not set, as everywhere.
fn without_empty(command: clap::Command) -> clap::Command {
    let is_empty = |name: &OsStr| std::env::var_os(name).is_some_and(|value| value.is_empty());
    let command = command.mut_args(|argument| {
        let unset = argument.get_env().is_some_and(is_empty);
        if unset { argument.env(Resettable::Reset) } else { argument }
    });
    command.mut_subcommands(without_empty)
}

fn dispatch(command: Command, format: Format) -> Result<ExitCode> {
    let ending = match command {
        Command::Run(arguments) => run::run(&arguments, format)?,
        Command::Check(arguments) => check::run(&arguments, format)?,
        Command::Explain { code } => explain::run(code.as_deref(), format)?,
        Command::Fmt(arguments) => fmt::run(&arguments, format)?,
        Command::Ps(running) => inspect_cli::ps::run(&running, format)?,
        Command::Describe(arguments) => inspect_cli::describe::run(&arguments, format)?,
        Command::Graph(running) => inspect_cli::graph::run(&running, format)?,
        Command::Echo(arguments) => inspect_cli::echo::run(&arguments)?,
        Command::Hz(arguments) => inspect_cli::hz::run(&arguments, format)?,
        Command::Mission(mission) => inspect_cli::mission::run(mission, format)?,
        Command::Eval(arguments) => evaluate_cli::run(&arguments, format)?,
        Command::Net(arguments) => petri_cli::run(&arguments, format)?,
        Command::Param(arguments) => param::run(&arguments, format)?,
        Command::New(arguments) => new::run(&arguments)?,
        Command::Completions { shell } => {
            let mut program = Arguments::command();
            clap_complete::generate(shell, &mut program, "armor", &mut std::io::stdout());
            Ending::Fine
        }
        Command::Registry(arguments) => daemon::registry(&arguments)?,
        Command::Configd(arguments) => daemon::configd(&arguments)?,
        Command::Component(arguments) => return daemon::component(arguments),
        Command::Guard(arguments) => return guard::run(&arguments),
        Command::Undertaker => return Ok(run::undertaker::run()),
        Command::Executive(arguments) => return daemon::executive(&arguments),
    };
    Ok(ending.into())
}
