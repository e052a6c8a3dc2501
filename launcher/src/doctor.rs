//! `armor doctor`: whether this host can run a system, and what to do where it cannot.
//!
//! `host.rs` and `network.rs` collect the facts, `diagnosis.rs` judges them without touching the
//! host. `hosts.rs` dials the other hosts of a file.

mod diagnosis;
mod host;
mod hosts;
mod network;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;

use crate::arguments::{KindFolders, OutputFormat};
use crate::check;
use crate::exit::CommandEnding;
use crate::keys_cli::KeysDirectory;
use crate::print::{end_printing, print_line, terminal_width, wants_colours, wrap_text};
use crate::verb::Verb;

use diagnosis::{Diagnosis, HostCondition, diagnose};
use host::HostFacts;
use hosts::examine_hosts;

/// Columns of the condition and of the subject.
const INDENT: usize = 9 + 14;
/// Fewest columns for the text next to them.
const NARROWEST: usize = 24;

/// Check whether this host can run a system, and say what to do where it cannot.
#[derive(Args, Debug)]
#[command(after_help = "Ends with 1 if something would stop a system; warnings and notes do not.

Examples:
  armor doctor
  armor doctor rover.xml --keys keys                           and the other hosts of the file
  armor doctor --out /data/runs                                where a run is to write
  armor doctor --format json | jq -r 'select(.condition != \"ok\") | .remedy'")]
pub struct DoctorArguments {
    /// The file of a system: the other hosts that it names are dialled.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    keys: KeysDirectory,
    #[command(flatten)]
    components: KindFolders,
    /// Folder for what a run produces, which need not exist yet.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
}

impl Verb for DoctorArguments {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        let facts = HostFacts::collect(&self.out, &self.components.directories)?;
        let mut diagnoses = diagnose(&facts);
        if let Some(file) = &self.file {
            let checked = check::load_file(file, &[], &self.components)?;
            checked.print_problems(format);
            let Some(configuration) = checked.accepted() else {
                bail!("{} is not valid: armor check {0}", file.display());
            };
            let hosts = &configuration.system.hosts;
            if !hosts.is_empty() {
                diagnoses.extend(examine_hosts(hosts, &self.keys.path()?)?);
            }
        }
        Ok(print_diagnoses(&diagnoses, format)?.into())
    }
}

/// Prints one entry per diagnosis.
///
/// # Errors
/// If stdout cannot be written.
fn print_diagnoses(diagnoses: &[Diagnosis], format: OutputFormat) -> Result<CommandEnding> {
    let printed = if format == OutputFormat::Json {
        end_printing(diagnoses.iter().map(describe_as_json).try_for_each(print_line))
    } else {
        let coloured = wants_colours(&std::io::stdout());
        let width = terminal_width();
        end_printing(
            diagnoses
                .iter()
                .try_for_each(|one| print_line(format_diagnosis(one, width, coloured).trim_end())),
        )
    }?;
    let is_ill = diagnoses.iter().any(|one| one.condition == HostCondition::Fault);
    Ok(if is_ill { CommandEnding::Failed } else { printed })
}

fn describe_as_json(diagnosis: &Diagnosis) -> serde_json::Value {
    let Diagnosis { subject, condition, found, remedy } = diagnosis;
    json!({
        "subject": subject, "condition": condition.as_str(), "found": found, "remedy": remedy
    })
}

fn format_diagnosis(diagnosis: &Diagnosis, width: Option<usize>, coloured: bool) -> String {
    let room = width.map_or(usize::MAX, |width| width.saturating_sub(INDENT).max(NARROWEST));
    let mut texts = wrap_text(&diagnosis.found, room);
    if !diagnosis.remedy.is_empty() {
        let remedy = wrap_text(&diagnosis.remedy, room.saturating_sub(2));
        texts.extend(remedy.iter().enumerate().map(|(line, text)| {
            let mark = if line == 0 { "→ " } else { "  " };
            format!("{mark}{text}")
        }));
    }
    let condition = diagnosis.condition.as_str();
    let padded = format!("{condition:<9}");
    let first = match (coloured, diagnosis.condition) {
        (true, HostCondition::Fault) => format!("\x1b[31m{padded}\x1b[0m"),
        (true, HostCondition::Warning) => format!("\x1b[33m{padded}\x1b[0m"),
        _ => padded,
    };
    let mut out = format!("{first}{:<14}", diagnosis.subject);
    for (line, text) in texts.iter().enumerate() {
        if line > 0 {
            out += &" ".repeat(INDENT);
        }
        out += text;
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_fits_the_terminal_and_its_remedy_is_below() {
        let diagnosis = Diagnosis {
            subject: "ports",
            condition: HostCondition::Warning,
            found: "a b ".repeat(20).trim_end().to_owned(),
            remedy: "stop a system that is not needed any more, then try again".to_owned(),
        };
        let text = format_diagnosis(&diagnosis, Some(60), false);
        assert!(text.starts_with("warning  ports         a b a b"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 60), "{text}");
        assert_eq!(text.matches('→').count(), 1, "{text}");
        assert_eq!(format_diagnosis(&diagnosis, None, false).lines().count(), 2);
    }
}
