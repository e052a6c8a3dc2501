//! `armor completions SHELL`: the completion script of a shell.

use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;

use crate::arguments::OutputFormat;
use crate::command_line::CommandLine;
use crate::print::{end_printing, print_text};
use crate::verb::Verb;

/// Print a completion script for a shell.
#[derive(Args, Debug)]
pub struct CompletionsArguments {
    /// The shell.
    pub shell: Shell,
}

impl Verb for CompletionsArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        // Internal commands are completed no more than they are listed.
        let whole = CommandLine::command();
        let listed = whole.get_subcommands().filter(|it| !it.is_hide_set()).cloned();
        let mut program =
            Command::new("armor").args(whole.get_arguments().cloned()).subcommands(listed);
        // Into memory first: the generator panics when stdout is closed.
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut program, "armor", &mut script);
        Ok(end_printing(print_text(String::from_utf8_lossy(&script)))?.into())
    }
}
