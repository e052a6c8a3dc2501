//! `armor component KIND`: a stock component as a process of its own.

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::{Result, bail};
use clap::{Args, Command};

use crate::arguments::OutputFormat;
use crate::exit_codes::describe_codes;
use crate::kinds::stock::STOCK;
use crate::print::{end_printing, print_text};
use crate::verb::Verb;
use armor_robotfile::advise_similar;

/// Run one stock component alone.
#[derive(Args, Debug)]
#[command(disable_help_flag = true)]
pub struct ComponentArguments {
    /// The kind, as `armor describe` lists it.
    #[arg(allow_hyphen_values = true)]
    pub kind: String,
    /// Arguments of the component: --name NAME, --registry ADDRESS:PORT, --describe, --help.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<OsString>,
}

impl Verb for ComponentArguments {
    fn run_verb(self, _: OutputFormat) -> Result<ExitCode> {
        let Self { kind, arguments } = self;
        // The flags after a kind are the component's, so clap looks for none in this command.
        if ["--help", "-h"].contains(&kind.as_str()) {
            let command = Command::new("component").bin_name("armor component");
            let mut command = Self::augment_args(command).after_help(describe_codes("component"));
            let help = command.render_long_help();
            return Ok(end_printing(print_text(help))?.into());
        }
        let Some(stock) = STOCK.iter().find(|stock| stock.kind == kind) else {
            let known: Vec<_> = STOCK.iter().map(|stock| stock.kind).collect();
            let advice = advise_similar(&kind, known.iter().copied());
            bail!("no stock component is called {kind}{advice} (there are: {})", known.join(", "));
        };
        Ok((stock.run)(arguments))
    }
}
