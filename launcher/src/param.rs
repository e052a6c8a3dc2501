//! `armor param`: the parameters of a running system, or of a file without one: seen, set in the
//! file, and compared from version to version.

pub mod arguments;
mod desk;
mod told;

use anyhow::{Result, bail};
use armor_sdk::configuration::{Differences, Parameters, SetOutcome};
use armor_wire::config::{ChangeRecord, ListedParameter};
use serde_json::json;

use crate::arguments::Format;
use crate::exit::Ending;
use crate::inspect_cli::{printed, say};
use crate::print;
use arguments::{Diff, Get, List, Param, Set, Where};
use desk::Desk;
use told::{json_of, say_rejected};

/// Does what is asked.
///
/// # Errors
/// If no system is found, the file is not valid, or there is no such component, parameter or
/// version.
pub fn run(param: &Param, format: Format) -> Result<Ending> {
    let done = match param {
        Param::List(arguments) => list(arguments, format),
        Param::Get(arguments) => get(arguments, format),
        Param::Set(arguments) => return set(arguments, format),
        Param::Diff(arguments) => diff(arguments, format),
    };
    printed(done)
}

fn list(arguments: &List, format: Format) -> Result<()> {
    let List { component, at } = arguments;
    let found = Desk::open(at)?.parameters(component.as_deref())?;
    warn_if_refused(&found);
    if format == Format::Json {
        return found.parameters.iter().try_for_each(|one| say(json_of(one)?));
    }
    let with_places = found.parameters.iter().any(|one| !one.places.is_empty());
    let rows: Vec<_> = found.parameters.iter().map(|one| row(one, with_places)).collect();
    let mut headings = vec!["PARAMETER", "VALUE", "UNIT", "RANGE", "LIVE", "FROM"];
    headings.extend(with_places.then_some("IN PLACES"));
    say(print::table(&headings, &rows).trim_end())
}

fn row(one: &ListedParameter, with_places: bool) -> Vec<String> {
    let dash = |text: &str| if text.is_empty() { "-".to_owned() } else { text.to_owned() };
    let name = format!("{}.{}", one.component, one.name);
    let live = if one.live { "live" } else { "-" };
    let (value, unit, range) = (quoted(&one.value), dash(&one.unit), dash(&one.range));
    let mut row = vec![name, value, unit, range, live.into(), one.origin.clone()];
    row.extend(with_places.then(|| dash(&one.places)));
    row
}

fn quoted(text: &str) -> String {
    if text.is_empty() { "\"\"".into() } else { text.to_owned() }
}

fn warn_if_refused(found: &Parameters) {
    if found.refused {
        eprintln!(
            "warning: the file on the disk is not valid; these are the values of version {}, which \
             is in force",
            found.version
        );
    }
}

fn get(arguments: &Get, format: Format) -> Result<()> {
    let (component, parameter) = &arguments.name;
    let found = Desk::open(&arguments.at)?.parameters(Some(component))?;
    warn_if_refused(&found);
    let Some(one) = found.parameters.iter().find(|one| one.name == *parameter) else {
        let names: Vec<_> = found.parameters.iter().map(|one| one.name.as_str()).collect();
        let names = if names.is_empty() { "none".into() } else { names.join(", ") };
        bail!("{component} has no parameter called {parameter}; it has: {names}");
    };
    if format == Format::Json { say(json_of(one)?) } else { say(&one.value) }
}

fn set(arguments: &Set, format: Format) -> Result<Ending> {
    let (component, parameter) = &arguments.name;
    let Where { file, .. } = &arguments.at;
    let value = arguments.value.as_deref();
    match Desk::open(&arguments.at)?.set(component, parameter, value)? {
        SetOutcome::Set { version, changes } => printed(if format == Format::Json {
            let changes = changes.iter().map(json_of).collect::<Result<Vec<_>>>()?;
            say(json!({"set": true, "version": version, "changes": changes}))
        } else if changes.is_empty() {
            say(format_args!("{component}.{parameter} already has this value; nothing was written"))
        } else {
            changes.iter().try_for_each(|change| match file {
                Some(_) => say(&change.text),
                None => say(format_args!("version {version}: {}", in_words(change))),
            })
        }),
        SetOutcome::Rejected { text, findings, left_out } => {
            say_rejected(&text, &findings, left_out, format)?;
            Ok(Ending::Failed)
        }
    }
}

fn in_words(change: &ChangeRecord) -> String {
    match change.effect.as_str() {
        "" => change.text.clone(),
        effect => format!("{}; it {effect}", change.text),
    }
}

fn diff(arguments: &Diff, format: Format) -> Result<()> {
    let found = match arguments.files.as_slice() {
        [] => Desk::running(&arguments.running)?.differences(arguments.from, arguments.to)?,
        [old, new] => Desk::between(old, new, &arguments.kinds)?,
        _ => bail!("give --file twice: the old file, then the new one"),
    };
    let Differences { from, to, changes, left_out } = &found;
    if format == Format::Json {
        return changes.iter().try_for_each(|change| say(json_of(change)?));
    }
    let is_running = arguments.files.is_empty();
    if is_running {
        say(format_args!("from version {from} to version {to}:"))?;
    }
    if changes.is_empty() {
        say("nothing that means anything else than before")?;
    }
    for change in changes {
        if is_running { say(in_words(change))? } else { say(&change.text)? }
    }
    if *left_out > 0 {
        say(format_args!("and {left_out} more"))?;
    }
    Ok(())
}
