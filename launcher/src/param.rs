//! `armor param`: the parameters of a running system, or of a file without one: seen, set in the
//! file, and compared from version to version.

pub mod arguments;
mod parameter_store;
mod refusals;
mod wire_records;

use std::collections::BTreeMap;
use std::process::ExitCode;

use anyhow::{Result, bail};
use armor_robotfile::advise_similar;
use armor_sdk::configuration::{Differences, ParameterList, SetOutcome};
use armor_wire::config::{ChangeRecord, ListedParameter};
use serde_json::json;

use crate::arguments::OutputFormat;
use crate::exit::CommandEnding;
use crate::print::{Table, end_printing, print_line, print_notice, print_wrapped, terminal_width};
use crate::verb::Verb;
use arguments::{
    DiffArguments, GetArguments, ListArguments, ParamCommand, ParameterSource, SetArguments,
};
use parameter_store::ParameterStore;
use refusals::{RefusalReader, refusal_of};
use wire_records::{print_findings, print_rejection, record_to_json};

impl Verb for ParamCommand {
    fn run_verb(self, format: OutputFormat) -> Result<ExitCode> {
        Ok(run_command(&self, format)?.into())
    }
}

/// Carries out a command.
///
/// # Errors
/// If no system is found, the file is not valid, or there is no such component, parameter or
/// version.
fn run_command(param: &ParamCommand, format: OutputFormat) -> Result<CommandEnding> {
    let done = match param {
        ParamCommand::List(arguments) => print_parameters(arguments, format),
        ParamCommand::Get(arguments) => print_value(arguments, format),
        ParamCommand::Set(arguments) => return set_value(arguments, format),
        ParamCommand::Diff(arguments) => print_differences(arguments, format),
    };
    end_printing(done)
}

fn print_parameters(arguments: &ListArguments, format: OutputFormat) -> Result<()> {
    let ListArguments { component, source } = arguments;
    let found = ParameterStore::open(source)?.parameters(component.as_deref())?;
    warn_if_refused(&found);
    let problems = match source.file {
        Some(_) => BTreeMap::new(),
        None => RefusalReader::open(&source.running).list_problems(),
    };
    let refusal = |one: &ListedParameter| refusal_of(problems.get(&one.component)?, &one.name);
    if format == OutputFormat::Json {
        return found.parameters.iter().try_for_each(|one| {
            let mut record = record_to_json(one)?;
            if let Some(refusal) = refusal(one) {
                record["refused"] = refusal.into();
            }
            print_line(record)
        });
    }
    let with_places = found.parameters.iter().any(|one| !one.places.is_empty());
    let rows = found.parameters.iter().map(|one| {
        let mut row = format_row(one, with_places);
        if refusal(one).is_some() {
            row[1] += " (refused)";
        }
        row
    });
    let rows: Vec<_> = rows.collect();
    let mut headings = vec!["PARAMETER", "VALUE", "UNIT", "RANGE", "LIVE", "FROM"];
    headings.extend(with_places.then_some("IN PLACES"));
    let table = Table::new(&headings, rows).dispensable(&["LIVE", "UNIT"]);
    print_line(table.format(terminal_width()).trim_end())
}

fn format_row(one: &ListedParameter, with_places: bool) -> Vec<String> {
    let dash = |text: &str| if text.is_empty() { "-".to_owned() } else { text.to_owned() };
    let name = format!("{}.{}", one.component, one.name);
    let live = if one.live { "live" } else { "-" };
    let (value, unit, range) = (quote_value(&one.value), dash(&one.unit), dash(&one.range));
    let mut row = vec![name, value, unit, range, live.into(), one.origin.clone()];
    row.extend(with_places.then(|| dash(&one.places)));
    row
}

fn quote_value(text: &str) -> String {
    if text.is_empty() { "\"\"".into() } else { text.to_owned() }
}

fn warn_if_refused(found: &ParameterList) {
    if found.refused {
        print_notice(format_args!(
            "warning: the file on the disk is not valid; these are the values of version {}, which \
             is in force",
            found.version
        ));
    }
}

fn print_value(arguments: &GetArguments, format: OutputFormat) -> Result<()> {
    let (component, parameter) = &arguments.name;
    let found = ParameterStore::open(&arguments.source)?.parameters(Some(component))?;
    warn_if_refused(&found);
    let Some(one) = found.parameters.iter().find(|one| one.name == *parameter) else {
        bail!(describe_missing(component, parameter, &found));
    };
    if format == OutputFormat::Json {
        print_line(record_to_json(one)?)
    } else {
        print_line(&one.value)
    }
}

fn describe_missing(component: &str, parameter: &str, found: &ParameterList) -> String {
    let names: Vec<_> = found.parameters.iter().map(|one| one.name.as_str()).collect();
    let advice = advise_similar(parameter, names.iter().copied());
    let names = if names.is_empty() { "none".into() } else { names.join(", ") };
    format!("{component} has no parameter called {parameter}{advice} (it has: {names})")
}

fn set_value(arguments: &SetArguments, format: OutputFormat) -> Result<CommandEnding> {
    let (component, parameter) = &arguments.name;
    let ParameterSource { file, .. } = &arguments.source;
    let value = arguments.value.as_deref();
    let reader = file.is_none().then(|| RefusalReader::open(&arguments.source.running));
    let before = reader.as_ref().and_then(|reader| reader.find_refusal(component, parameter));
    let mut store = ParameterStore::open(&arguments.source)?;
    let undo = describe_undo(&mut store, component, parameter);
    match store.set(component, parameter, value)? {
        SetOutcome::Set { version, changes, findings } => {
            let is_live = changes.iter().any(|change| change.effect.starts_with("reaches "));
            let reader = reader.filter(|_| is_live);
            let obstacle = reader.as_ref().and_then(|reader| reader.find_obstacle(component));
            let refusal = reader
                .filter(|_| obstacle.is_none())
                .and_then(|reader| reader.await_refusal(component, parameter, before.as_deref()));
            end_printing(if format == OutputFormat::Json {
                let changes = changes.iter().map(record_to_json).collect::<Result<Vec<_>>>()?;
                let found = findings.iter().map(record_to_json).collect::<Result<Vec<_>>>()?;
                let mut printed = json!({
                    "set": true, "version": version, "changes": changes, "findings": found,
                });
                if let Some(refusal) = &refusal {
                    printed["refused"] = refusal.as_str().into();
                }
                if let Some(obstacle) = &obstacle {
                    printed["delayed"] = obstacle.as_str().into();
                }
                print_line(printed)
            } else if changes.is_empty() {
                print_wrapped(format_args!(
                    "{component}.{parameter} already has this value; nothing was written"
                ))
            } else {
                changes.iter().try_for_each(|change| match file {
                    Some(_) => print_wrapped(&change.text),
                    None => {
                        let text = match &obstacle {
                            Some(obstacle) => format!("{}; {obstacle}", change.text),
                            None => in_words(change),
                        };
                        print_wrapped(format_args!("version {version}: {text}"))
                    }
                })
            })?;
            if format != OutputFormat::Json {
                print_findings(&findings)?;
            }
            let Some(refusal) = refusal else { return Ok(CommandEnding::Fine) };
            print_notice(format_args!(
                "error: {component} refuses the value, which the file has now: {refusal}. Set one that it \
                 accepts{undo}"
            ));
            Ok(CommandEnding::Failed)
        }
        SetOutcome::Rejected { text, findings, left_out } => {
            print_rejection(&text, &findings, left_out, format)?;
            Ok(CommandEnding::Failed)
        }
    }
}

/// Returns the command that gives a parameter the value again that it has now, as the end of a sentence;
/// empty if its value is not known.
fn describe_undo(store: &mut ParameterStore, component: &str, parameter: &str) -> String {
    let found = store.parameters(Some(component)).ok();
    let parameters = found.into_iter().flat_map(|found| found.parameters);
    let Some(one) = parameters.into_iter().find(|one| one.name == parameter) else {
        return String::new();
    };
    let name = format!("{component}.{parameter}");
    let value = match one.origin.as_str() {
        "default" => "--default".into(),
        _ => format!("'{}'", one.value.replace('\'', "'\\''")),
    };
    format!(", such as the one before: `armor param set {name} {value}`")
}

fn in_words(change: &ChangeRecord) -> String {
    match change.effect.as_str() {
        "" => change.text.clone(),
        effect => format!("{}; it {effect}", change.text),
    }
}

fn print_differences(arguments: &DiffArguments, format: OutputFormat) -> Result<()> {
    let found = match arguments.files.as_slice() {
        [] => ParameterStore::running(&arguments.running)?
            .differences(arguments.from, arguments.to)?,
        [old, new] => ParameterStore::between(old, new, &arguments.kinds)?,
        _ => bail!("give --file twice: the old file, then the new one"),
    };
    let Differences { from, to, changes, left_out } = &found;
    if format == OutputFormat::Json {
        return changes.iter().try_for_each(|change| print_line(record_to_json(change)?));
    }
    let is_running = arguments.files.is_empty();
    if is_running {
        print_line(format_args!("from version {from} to version {to}:"))?;
    }
    if changes.is_empty() {
        print_line("nothing that means anything else than before")?;
    }
    for change in changes {
        if is_running { print_wrapped(in_words(change))? } else { print_wrapped(&change.text)? }
    }
    if *left_out > 0 {
        print_line(format_args!("and {left_out} more"))?;
    }
    Ok(())
}
