//! `armor doctor`: whether this host can run a system, and what to do where it cannot.
//!
//! `host.rs` and `network.rs` collect the facts, `diagnosis.rs` judges them without touching the
//! host. `hosts.rs` dials other hosts, which examine themselves in the same way (`examination.rs`).

mod diagnosis;
mod examination;
mod host;
mod hosts;
mod network;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_robotfile::advise_similar;
use armor_robotfile::model::Host;
use armor_wire::gate::{ANNOUNCED, GATE_PORT};
use clap::Args;
use serde_json::json;

use crate::arguments::{KindFolders, OutputFormat};
use crate::check;
use crate::exit::CommandEnding;
use crate::keys_cli::KeysDirectory;
use crate::print::{end_printing, print_line, terminal_width, wants_colours, wrap_text};
use crate::verb::Verb;

use diagnosis::{Diagnosis, HostCondition, diagnose};
pub use examination::examine_own_host;
use host::HostFacts;
use hosts::{ExaminedHost, examine_hosts};

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
  armor doctor rover.xml arm --keys keys                       and one of them
  armor doctor arm=10.0.0.2 --keys keys                        and a host that is in no file
  armor doctor --out /data/runs                                where a run is to write
  armor doctor --format json | jq -r 'select(.condition != \"ok\") | .remedy'")]
pub struct DoctorArguments {
    /// The file of a system, whose other hosts are dialled and examine themselves; the names of hosts,
    /// for these only. Without a file a host is NAME, which is also its address, or NAME=ADDRESS:PORT.
    #[arg(value_name = "FILE|HOST")]
    subjects: Vec<String>,
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
        let (file, names) = split_subjects(&self.subjects)?;
        let hosts = match file {
            Some(file) => {
                let checked = check::load_file(file, &[], &self.components)?;
                checked.print_problems(format);
                let Some(configuration) = checked.accepted() else {
                    bail!("{} is not valid: armor check {0}", file.display());
                };
                choose_hosts(&configuration.system.hosts, &names)?
            }
            None => names.iter().map(|name| name_host(name)).collect(),
        };
        if !hosts.is_empty() {
            diagnoses.extend(examine_hosts(&hosts, &self.keys.path()?)?);
        }
        Ok(print_diagnoses(&diagnoses, format)?.into())
    }
}

/// Returns the file and the hosts of the command line: a file is an existing one, or ends with `.xml`.
fn split_subjects(subjects: &[String]) -> Result<(Option<&Path>, Vec<&str>)> {
    let is_file = |text: &&String| text.ends_with(".xml") || Path::new(text).is_file();
    let (files, hosts): (Vec<_>, Vec<_>) = subjects.iter().partition(is_file);
    match files[..] {
        [] | [_] => {
            let file = files.first().map(|file| Path::new(file.as_str()));
            Ok((file, hosts.into_iter().map(String::as_str).collect()))
        }
        [first, second, ..] => {
            bail!("two files, {first} and {second}: examine one after the other")
        }
    }
}

/// Returns the hosts of the file, or those that are named.
fn choose_hosts(hosts: &[Host], names: &[&str]) -> Result<Vec<ExaminedHost>> {
    for name in names {
        if !hosts.iter().any(|host| host.name.value == **name) {
            let known = hosts.iter().map(|host| host.name.value.as_str());
            let advice = advise_similar(name, known.clone());
            let known = known.collect::<Vec<_>>().join(", ");
            bail!("the file names no other host called {name}{advice} (its hosts: {known})");
        }
    }
    let is_chosen = |host: &&Host| names.is_empty() || names.contains(&host.name.value.as_str());
    let describe = |host: &Host| ExaminedHost {
        name: host.name.value.clone(),
        addresses: host.addresses.value.clone(),
    };
    Ok(hosts.iter().filter(is_chosen).map(describe).collect())
}

/// Returns the host of `NAME` or `NAME=ADDRESS:PORT`.
fn name_host(text: &str) -> ExaminedHost {
    let (name, address) = text.split_once('=').unwrap_or((text, text));
    let has_port = address.rsplit_once(':').is_some_and(|(host, port)| {
        port.parse::<u16>().is_ok() && (!host.contains(':') || host.ends_with(']'))
    });
    let address = match has_port || address == ANNOUNCED {
        true => address.to_owned(),
        false if address.contains(':') && !address.starts_with('[') => {
            format!("[{address}]:{GATE_PORT}")
        }
        false => format!("{address}:{GATE_PORT}"),
    };
    ExaminedHost { name: name.to_owned(), addresses: vec![address] }
}

/// Prints one entry per diagnosis; of what other hosts find of themselves as text only what is not in
/// order.
///
/// # Errors
/// If stdout cannot be written.
fn print_diagnoses(diagnoses: &[Diagnosis], format: OutputFormat) -> Result<CommandEnding> {
    let printed = if format == OutputFormat::Json {
        end_printing(diagnoses.iter().map(describe_as_json).try_for_each(print_line))
    } else {
        let coloured = wants_colours(&std::io::stdout());
        let width = terminal_width();
        let is_shown =
            |one: &&Diagnosis| one.host.is_none() || one.condition != HostCondition::Good;
        end_printing(
            diagnoses
                .iter()
                .filter(is_shown)
                .try_for_each(|one| print_line(format_diagnosis(one, width, coloured).trim_end())),
        )
    }?;
    let is_ill = diagnoses.iter().any(|one| one.condition == HostCondition::Fault);
    Ok(if is_ill { CommandEnding::Failed } else { printed })
}

fn describe_as_json(diagnosis: &Diagnosis) -> serde_json::Value {
    let Diagnosis { host, subject, condition, found, remedy } = diagnosis;
    json!({
        "host": host, "subject": subject, "condition": condition.as_str(), "found": found, "remedy": remedy
    })
}

fn format_diagnosis(diagnosis: &Diagnosis, width: Option<usize>, coloured: bool) -> String {
    let room = width.map_or(usize::MAX, |width| width.saturating_sub(INDENT).max(NARROWEST));
    let place = diagnosis.host.as_ref().map(|host| format!("on {host}: ")).unwrap_or_default();
    let mut texts = wrap_text(&format!("{place}{}", diagnosis.found), room);
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
        let diagnosis = Diagnosis::new(
            "ports",
            HostCondition::Warning,
            "a b ".repeat(20).trim_end(),
            "stop a system that is not needed any more, then try again",
        );
        let text = format_diagnosis(&diagnosis, Some(60), false);
        assert!(text.starts_with("warning  ports         a b a b"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 60), "{text}");
        assert_eq!(text.matches('→').count(), 1, "{text}");
        assert_eq!(format_diagnosis(&diagnosis, None, false).lines().count(), 2);
        let there = Diagnosis { host: Some("arm".into()), ..diagnosis };
        assert!(format_diagnosis(&there, None, false).contains("on arm: a b"));
    }

    #[test]
    fn a_host_is_named_with_and_without_an_address() {
        for (text, name, address) in [
            ("arm", "arm", "arm:7410"),
            ("arm=10.0.0.2", "arm", "10.0.0.2:7410"),
            ("arm=arm.local:7500", "arm", "arm.local:7500"),
            ("arm=fd00::2", "arm", "[fd00::2]:7410"),
            ("arm=[fd00::2]:7500", "arm", "[fd00::2]:7500"),
            ("arm=[fd00::2]", "arm", "[fd00::2]:7410"),
            ("arm=mdns", "arm", "mdns"),
        ] {
            let expected = ExaminedHost { name: name.into(), addresses: vec![address.into()] };
            assert_eq!(name_host(text), expected, "{text}");
        }
        let subjects = ["arm".to_owned(), "rover.xml".to_owned()];
        let (file, hosts) = split_subjects(&subjects).expect("one file");
        assert_eq!((file, hosts), (Some(Path::new("rover.xml")), vec!["arm"]));
        assert!(split_subjects(&["a.xml".to_owned(), "b.xml".to_owned()]).is_err());
    }
}
