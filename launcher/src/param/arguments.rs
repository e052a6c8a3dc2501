//! The arguments of `armor param`.

use std::path::PathBuf;

use armor_wire::name::{is_name, split_data};
use clap::{Args, Subcommand};

use crate::arguments::{KindFolders, RunningSystem};

/// Show, set and compare the parameters of a running system, or of a file.
#[derive(Debug, Subcommand)]
pub enum ParamCommand {
    /// List all parameters: value, origin, range, and whether it is live.
    List(ListArguments),
    /// Print the value of one parameter as it is written in the file, or its default.
    Get(GetArguments),
    /// Write the value of one parameter into the file, if the file stays valid with it.
    Set(SetArguments),
    /// Print the changes between two versions of the file, or between two files.
    Diff(DiffArguments),
}

#[derive(Args, Debug)]
pub struct ListArguments {
    /// Only the parameters of this component.
    pub component: Option<String>,
    #[command(flatten)]
    pub source: ParameterSource,
}

#[derive(Args, Debug)]
pub struct GetArguments {
    /// The parameter.
    #[arg(value_name = "COMPONENT.PARAMETER", value_parser = parse_parameter_name)]
    pub name: (String, String),
    #[command(flatten)]
    pub source: ParameterSource,
}

#[derive(Args, Debug)]
pub struct SetArguments {
    /// The parameter.
    #[arg(value_name = "COMPONENT.PARAMETER", value_parser = parse_parameter_name)]
    pub name: (String, String),
    /// Its new value, as it is written in the file, such as 0.5m/s.
    #[arg(allow_hyphen_values = true, required_unless_present = "default")]
    pub value: Option<String>,
    /// Remove the value from the file, so that the default applies.
    #[arg(long, conflicts_with = "value")]
    pub default: bool,
    #[command(flatten)]
    pub source: ParameterSource,
}

#[derive(Args, Debug)]
pub struct DiffArguments {
    /// The earlier version. Default: the one before TO.
    #[arg(value_parser = parse_version)]
    pub from: Option<u64>,
    /// The later version. Default: the active one.
    #[arg(value_parser = parse_version)]
    pub to: Option<u64>,
    /// Compare files instead of versions: give it twice, the old file, then the new one.
    #[arg(long = "file", value_name = "FILE", conflicts_with_all = ["from", "to", "system", "registry"])]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub kinds: KindFolders,
    #[command(flatten)]
    pub running: RunningSystem,
}

/// Selects the parameters: those of a running system, or of a file.
#[derive(Args, Debug)]
pub struct ParameterSource {
    /// The parameters of this file, without a running system.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["system", "registry"])]
    pub file: Option<PathBuf>,
    #[command(flatten)]
    pub kinds: KindFolders,
    #[command(flatten)]
    pub running: RunningSystem,
}

fn parse_parameter_name(text: &str) -> Result<(String, String), String> {
    match split_data(text) {
        Some((component, parameter)) => Ok((component.into(), parameter.into())),
        None if is_name(text) => Err(format!(
            "write COMPONENT.PARAMETER; `armor param list {text}` shows the parameters of {text}"
        )),
        None => Err("write COMPONENT.PARAMETER; `armor param list` shows them".into()),
    }
}

/// Reads the number of a version; a path is meant for two files.
fn parse_version(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| match text.contains(['.', '/']) {
        true => "a version is a number; to compare two files, write --file OLD --file NEW".into(),
        false => {
            "a version is a number, such as 2; `armor param diff` shows the last change".into()
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_or_a_file_in_the_wrong_place_is_answered_with_what_to_write() {
        let refused = parse_parameter_name("patrol").unwrap_err();
        assert!(refused.contains("`armor param list patrol`"), "{refused}");
        assert!(parse_version("a/old.xml").unwrap_err().contains("--file OLD --file NEW"));
        assert!(parse_version("one").unwrap_err().contains("such as 2"));
        assert_eq!(parse_version("3"), Ok(3));
    }
}
