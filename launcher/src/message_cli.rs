//! `armor message`: the messages that components can use: listed, described, and written as source
//! text of a language.

pub mod known_messages;
mod listing;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use armor_definitions::{Language, export_messages, select_messages, standard_messages};
use armor_wire::schema::Schema;
use clap::{Args, Subcommand, ValueEnum};

use crate::arguments::{KindFolders, OutputFormat};
use crate::print::{end_printing, print_notice, print_text};
use crate::verb::Verb;
use known_messages::KnownMessages;

/// Show the messages that components can use, and write them in a language.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  armor message list
  armor message show LaserScan
  armor message export Reading --lang cpp --output reading.hpp")]
pub enum MessageCommand {
    /// List the standard messages and those of all kinds of components.
    #[command(after_help = "Examples:
  armor message list                      the standard ones, and those of components/
  armor message list --file robot.xml     those that this system can use
  armor message list --format json | jq -r 'select(.standard | not) | .name'")]
    List {
        #[command(flatten)]
        source: MessageSource,
    },
    /// Show a message: its fields with types, units and documentation, and the ports that have it.
    #[command(after_help = "Examples:
  armor message show LaserScan
  armor message show Reading --components build")]
    Show {
        /// The message.
        name: String,
        #[command(flatten)]
        source: MessageSource,
    },
    /// Write the definition of messages in a language. Standard messages within them are imported.
    #[command(after_help = "Examples:
  armor message export Reading --lang python > reading.py
  armor message export Reading Level --lang cpp --output reading.hpp
  armor message export LaserScan --lang json")]
    Export {
        /// The messages.
        #[arg(required = true, value_name = "NAME")]
        names: Vec<String>,
        /// The language.
        #[arg(long, value_enum, value_name = "LANGUAGE")]
        lang: ExportLanguage,
        /// The file to write; otherwise stdout. An existing file is replaced.
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
        #[command(flatten)]
        source: MessageSource,
    },
}

/// Where the kinds are whose messages are known besides the standard ones.
#[derive(Args, Clone, Debug, Default)]
pub struct MessageSource {
    /// A system or mission: `components/` next to it is searched, and not that of this folder.
    #[arg(long, value_name = "FILE")]
    pub file: Option<PathBuf>,
    #[command(flatten)]
    pub kinds: KindFolders,
}

/// A language for definitions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportLanguage {
    /// Structs that derive `Message`.
    Rust,
    /// Classes of the package `armor`.
    Python,
    /// A header with structs and their tables.
    C,
    /// A header with structs and their macros.
    Cpp,
    /// One document with all fields, also of the standard messages within them.
    Json,
}

impl From<ExportLanguage> for Language {
    fn from(language: ExportLanguage) -> Self {
        match language {
            ExportLanguage::Rust => Self::Rust,
            ExportLanguage::Python => Self::Python,
            ExportLanguage::C => Self::C,
            ExportLanguage::Cpp => Self::Cpp,
            ExportLanguage::Json => Self::Json,
        }
    }
}

impl Verb for MessageCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let ending = match self {
            Self::List { source } => {
                let known = KnownMessages::gather(&source)?;
                end_printing(listing::list_messages(&known, format))
            }
            Self::Show { name, source } => {
                let known = KnownMessages::gather(&source)?;
                let found = known.find(&name)?;
                end_printing(listing::show_messages(&found, format))
            }
            Self::Export { names, lang, output, source } => {
                let known = KnownMessages::gather(&source)?;
                let schemas: Vec<Schema> = names
                    .iter()
                    .map(|name| known.find_one(name).map(|it| it.definition.schema.clone()))
                    .collect::<Result<_>>()?;
                let selection = select_messages(&schemas, &standard_messages())?;
                let text = export_messages(&selection, lang.into())?;
                return write_export(&text, output.as_deref());
            }
        };
        Ok(ending?.into())
    }
}

fn write_export(text: &str, output: Option<&Path>) -> Result<ExitCode> {
    let Some(path) = output else { return Ok(end_printing(print_text(text))?.into()) };
    std::fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))?;
    print_notice(format_args!("{} is written", path.display()));
    Ok(ExitCode::SUCCESS)
}
