//! `armor net`: counts, checks and converts Petri nets in files, and those of missions.

pub mod arguments;
mod check;
mod convert;
mod info;
mod mission;
mod net_facts;
mod report;

use std::process::ExitCode;

use anyhow::Result;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::verb::Verb;

impl Verb for arguments::NetCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(run_command(&self, format)?.into())
    }
}

/// Carries out a command.
///
/// # Errors
/// If a file cannot be read or written, or contains no net.
fn run_command(arguments: &arguments::NetCommand, format: OutputFormat) -> Result<CommandEnding> {
    match arguments {
        arguments::NetCommand::Info { file, budget } => info::print_info(file, budget, format),
        arguments::NetCommand::Check(check) => check::print_check(check, format),
        arguments::NetCommand::Convert { from, to } => convert::convert_file(from, to),
    }
}
