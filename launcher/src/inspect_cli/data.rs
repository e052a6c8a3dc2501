//! `armor data`: the data of a running system: listed, described, found, and published by hand.

mod find;
mod info;
mod list;
mod message_types;
mod publish;

use std::process::ExitCode;

use anyhow::Result;
use clap::Subcommand;

use super::named_part::NamedPart;
use crate::arguments::{OutputFormat, RunningSystem, parse_data_name};
use crate::verb::Verb;
use publish::PublishArguments;

/// Show the data of a running system, and publish some by hand.
#[derive(Debug, Subcommand)]
#[command(after_help = "Examples:
  armor data list
  armor data list simulator                                              those of one component
  armor data list --format json | jq -r 'select(.links == []) | .data'   outputs without a link
  armor data info simulator.odometry                                     one of them
  armor data find Twist                                                  all ports of a type
  armor data pub driver.velocity Twist linear.x=0.3                      one message")]
pub enum DataCommand {
    /// List all outputs: type, rate, number of messages, and the components and tools linked to
    /// them.
    List {
        /// Only the outputs of this component, or this output.
        name: Option<String>,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Describe an output: its type with the fields and units, its provider, its subscribers with
    /// their rates and losses, and the age of its last value.
    #[command(after_help = "Examples:
  armor data info simulator.odometry")]
    Info {
        /// Unique name of the data, COMPONENT.OUTPUT.
        #[arg(value_parser = parse_data_name)]
        data: String,
        #[command(flatten)]
        running: RunningSystem,
    },
    /// Find outputs and inputs by their type, or by a part of their name or of a field's name.
    #[command(after_help = "Examples:
  armor data find Twist    what is published and read as a Twist
  armor data find yaw      all ports with a field of that name")]
    Find {
        /// A type, or a part of the name of a type, port or field; upper and lower case are the same.
        word: String,
        #[command(flatten)]
        running: RunningSystem,
    },
    Pub(PublishArguments),
}

impl Verb for DataCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let ending = match self {
            Self::List { name, running } => {
                list::list_outputs(&running, NamedPart(name.as_deref()), format)
            }
            Self::Info { data, running } => info::print_info(&running, &data, format),
            Self::Find { word, running } => find::find_ports(&running, &word, format),
            Self::Pub(arguments) => publish::publish_by_hand(&arguments, format),
        };
        Ok(ending?.into())
    }
}
