//! What can be asked of `armor param`, in the words of its `--help`.

use std::path::PathBuf;

use armor_wire::name::split_data;
use clap::{Args, Subcommand};

use crate::arguments::{Kinds, Running};

/// What to do with parameters.
#[derive(Debug, Subcommand)]
pub enum Param {
    /// List all parameters: value, where it is from, what it may be, whether it is live.
    List(List),
    /// Print the value of one parameter, as it is written in the file, or its default.
    Get(Get),
    /// Write the value of one parameter into the file, if the file stays valid with it.
    Set(Set),
    /// Say what changed between two versions of the file, or between two files.
    Diff(Diff),
}

#[derive(Args, Debug)]
pub struct List {
    /// Only those of this component.
    pub component: Option<String>,
    #[command(flatten)]
    pub at: Where,
}

#[derive(Args, Debug)]
pub struct Get {
    /// The parameter.
    #[arg(value_name = "COMPONENT.PARAMETER", value_parser = name)]
    pub name: (String, String),
    #[command(flatten)]
    pub at: Where,
}

#[derive(Args, Debug)]
pub struct Set {
    /// The parameter.
    #[arg(value_name = "COMPONENT.PARAMETER", value_parser = name)]
    pub name: (String, String),
    /// Its new value, as it is to be written: 0.5m/s.
    #[arg(allow_hyphen_values = true, required_unless_present = "default")]
    pub value: Option<String>,
    /// Take the value out of the file, so that the default holds.
    #[arg(long, conflicts_with = "value")]
    pub default: bool,
    #[command(flatten)]
    pub at: Where,
}

#[derive(Args, Debug)]
pub struct Diff {
    /// The earlier version. Default: the one before TO.
    pub from: Option<u64>,
    /// The later version. Default: the one in force.
    pub to: Option<u64>,
    /// Compare files instead of versions: give it twice, the old file, then the new one.
    #[arg(long = "file", value_name = "FILE", conflicts_with_all = ["from", "to", "system", "registry"])]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub kinds: Kinds,
    #[command(flatten)]
    pub running: Running,
}

/// Whose parameters: those of a running system, or of a file.
#[derive(Args, Debug)]
pub struct Where {
    /// The parameters of this file, without a running system.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["system", "registry"])]
    pub file: Option<PathBuf>,
    #[command(flatten)]
    pub kinds: Kinds,
    #[command(flatten)]
    pub running: Running,
}

fn name(text: &str) -> Result<(String, String), String> {
    match split_data(text) {
        Some((component, parameter)) => Ok((component.into(), parameter.into())),
        None => Err("write COMPONENT.PARAMETER; `armor param list` shows them".into()),
    }
}
